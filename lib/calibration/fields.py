# SPDX-License-Identifier: MIT
"""What the numbers of a Calibration may be, where they come from a file."""

from math import isfinite

from calibration import VERSION

# Name, how many numbers, largest magnitude that a working part can need (PS p. 12-13, doubled)
_FIELDS = (
    ("gyro_bias_dps", 3, 80),
    ("accel_bias_g", 3, 0.5),
    ("gyro_matrix", 9, 1.5),
    ("accel_matrix", 9, 1.5),
    ("gyro_slope_dps_per_c", 3, 2),
    ("accel_slope_g_per_c", 3, 0.01),
)


def checked(fields):
    """The dict of a file as arguments of a Calibration; ValueError that names the field and what
    is wrong with it."""
    if not isinstance(fields, dict):
        raise ValueError("calibration: not a dict but %s" % type(fields).__name__)
    fields = dict(fields)
    if fields.pop("version", VERSION) != VERSION:
        raise ValueError("calibration: this version is not known, expected %d" % VERSION)
    kept = {}
    for name, count, limit in _FIELDS:
        if name in fields:
            kept[name] = _numbers(name, fields.pop(name), count, limit)
    for name, limit in (("temp_c", 200), ("residual_mg", 1000), ("who_am_i", 255)):
        value = fields.pop(name, None)
        if value is not None:
            kept[name] = _number(name, value, limit)
    date = fields.pop("date", "")
    if not isinstance(date, str) or len(date) > 40:
        raise ValueError("calibration: date is not a text of at most 40 characters")
    if fields:
        raise ValueError("calibration: unknown field %s" % sorted(map(str, fields))[0][:40])
    for name in ("gyro_matrix", "accel_matrix"):
        if name in kept and not 0.5 < _determinant(kept[name]) < 2:
            raise ValueError("calibration: %s turns space inside out or flattens it" % name)
    kept["date"] = date
    return kept


def _determinant(m):
    """Determinant of a row-major 3 x 3 matrix."""
    return (
        m[0] * (m[4] * m[8] - m[5] * m[7])
        - m[1] * (m[3] * m[8] - m[5] * m[6])
        + m[2] * (m[3] * m[7] - m[4] * m[6])
    )


def _numbers(name, values, count, limit):
    if not isinstance(values, (list, tuple)) or len(values) != count:
        raise ValueError("calibration: %s is not a list of %d numbers" % (name, count))
    return tuple([_number(name, value, limit) for value in values])


def _number(name, value, limit):
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError("calibration: %s holds something that is no number" % name)
    if not -limit <= value <= limit or not isfinite(value):
        raise ValueError("calibration: %s is beyond +-%s" % (name, limit))
    return value

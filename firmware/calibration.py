# SPDX-License-Identifier: MIT
"""The calibration of the part that is there, on the flash."""

from calibration import IDENTITY, Calibration, multiply

from firmware import store
from firmware.config import CALIBRATION_PATH as PATH

_KIND = "calibration"
_VERSION = 1

_WORTH_DPS, _WORTH_SCALE = 0.05, 0.002  # less is not worth a write to flash
_KNOWN_SCALE = 0.0025  # an axis' scale that is known no better is not kept


def load_for(imu, path=PATH):
    """(Calibration, warnings) of what is stored and fits this part."""
    cal, warnings = load_calibration(path)
    if cal.who_am_i not in (None, imu.who_am_i):
        warnings.append("%s is of another kind of sensor: only its mounting is used" % path)
        cal = cal.mounting()
    return cal, warnings


def load_calibration(path=PATH):
    """(Calibration, warnings) of what is stored; the ideal one when there is none."""
    stored, warnings = store.load(path, _KIND, _VERSION, ("date",))
    if stored:
        try:
            return Calibration.from_dict(stored), warnings
        except ValueError as error:
            warnings.append("%s: %s; none used" % (path, error))
    return Calibration(), warnings


def save_calibration(cal, path=PATH):
    """Store a Calibration safely (firmware.store). OSError when the flash refuses; ValueError for
    numbers that no working part needs.
    """
    fields = cal.to_dict()
    Calibration.from_dict(fields)  # what load_calibration() would refuse is not written
    del fields["version"]
    store.save(path, _KIND, _VERSION, {k: v for k, v in fields.items() if v not in (None, "")})


def keep_learned(learned, imu, path=PATH, scale=None):
    """Store what was learned of this part's gyro: a Calibration or None, where it is another bias
    than the stored one; and what scale_learned() says. OSError, ValueError."""
    if not learned and not scale:
        return
    new = stored = load_calibration(path)[0]
    if stored.who_am_i not in (None, imu.who_am_i):  # another part's calibration is worth more
        return
    if learned:
        old = stored.at(learned.temp_c).gyro_bias_dps
        off = max([abs(a - b) for a, b in zip(learned.gyro_bias_dps, old)])
        if off >= _WORTH_DPS or not any(stored.gyro_bias_dps):
            new = stored.gyro_from(learned)
    if scale and scale[0] == stored.gyro_matrix:
        new = new.but(gyro_matrix=multiply(scale[1], stored.gyro_matrix))
    if new is not stored:
        save_calibration(new, path)


def scale_learned(filter, calibration):
    """(gyro_matrix that was used, matrix that makes its rates truer), of the axes whose scale the
    filter knows well by now; None: nothing that is worth a write."""
    if not hasattr(filter, "calibration_learned"):
        return None
    found, sigma = filter.calibration_learned(), filter.learned()[1]
    rows: list = []
    worth = False
    for i in range(3):
        known = sigma[i] <= _KNOWN_SCALE
        rows += found[3 * i : 3 * i + 3] if known else IDENTITY[3 * i : 3 * i + 3]
        worth = worth or abs(rows[4 * i] - 1.0) >= _WORTH_SCALE
    return (calibration.gyro_matrix, rows) if worth else None


def forget_scale(path=PATH):
    """The gyro's scale is as the datasheet has it; its bias and the mounting stay. OSError."""
    stored, _ = load_calibration(path)
    turned = stored.rotation()
    if turned != stored.gyro_matrix:
        save_calibration(stored.but(gyro_matrix=turned), path)

# SPDX-License-Identifier: MIT
"""What a sensor's counts mean: its ranges, and a calibration folded into one product a row; and
what all filters that take counts refuse."""

GYRO_LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
ACCEL_LSB_PER_G = {2: 16384, 4: 8192, 8: 4096, 16: 2048}
IDENTITY = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


class Ideal:
    """The calibration of a sensor without faults, mounted along the axes."""

    gyro_bias_dps = accel_bias_g = (0.0, 0.0, 0.0)
    gyro_matrix = accel_matrix = IDENTITY


def lsb(table, full_scale, name):
    """The sensitivity that belongs to a full scale; ValueError lists those that exist."""
    if full_scale not in table:
        raise ValueError("%s %s: must be one of %s" % (name, full_scale, sorted(table)))
    return table[full_scale]


def period16(period_us, nominal16):
    """period_us in sixteenths, as nominal16; ValueError with the possible range beyond 5 %.

    A clock further off than that is a fault, not a clock. A whole period_us allocates nothing.
    """
    value = int(period_us * 16)
    span = nominal16 // 20
    if not -span <= value - nominal16 <= span:
        limits = (period_us, (nominal16 - span) / 16, (nominal16 + span) / 16)
        raise ValueError("period_us %s: must be %.1f to %.1f at this rate_hz" % limits)
    return value


def row_of(matrix, row, bias):
    """(a, b, c, offset) of one row of matrix (reading - bias)."""
    a, b, c = matrix[3 * row : 3 * row + 3]
    return a, b, c, -(a * bias[0] + b * bias[1] + c * bias[2])


def set_known(self, name, value):
    """A filter's __setattr__: a name that is not there would be taken in silence, and change
    nothing."""
    if self._made and name[0] != "_" and not hasattr(self, name):
        text = "no attribute %s: settings go in by app.set(), or prepare(settings={...})"
        raise AttributeError(text % name)
    object.__setattr__(self, name, value)


def known(cal):
    """What a calibration tells of how well a gyro is known, as settings of Attitude: a bias that
    was measured is no more than warmth away, and who has scales has found them to 0.4 %."""
    settings = {}
    if any(cal.gyro_bias_dps):
        settings["start_sigma_dps"] = 1.0
    m = cal.gyro_matrix
    lengths = [m[i] * m[i] + m[i + 1] * m[i + 1] + m[i + 2] * m[i + 2] for i in (0, 3, 6)]
    if max([abs(length - 1.0) for length in lengths]) > 1e-5:
        settings["scale_sigma"] = 0.004
    return settings

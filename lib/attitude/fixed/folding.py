# SPDX-License-Identifier: MIT
"""Folds range, calibration, mounting and period into the integer coefficients of one step.

Float work for construction and calibration; nothing here runs in the loop. With counts x (int16)
a step computes y = (c0 x0 + c1 x1 + c2 x2 + offset) >> shift, so an ideal sensor and a
calibrated, skewed, rotated one cost the same. No sum can leave 32 bits: it is checked here.
"""

GYRO_LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
ACCEL_LSB_PER_G = {2: 16384, 4: 8192, 8: 4096, 16: 2048}

ACCEL_LIMIT = 65000  # the largest calibrated count that atan2's 15-bit quotient takes
_SUM_LIMIT = 2040000000  # 2^31 less 5 %, by which the period may move the coefficients

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


def check_rate(rate_hz, gyro_dps, least_hz=10):
    """ValueError for a rate that the fixed-point formats do not hold, whatever the gyro gives.

    A sample may turn by 25 degrees at most: 80 Hz at 2000 deg/s, 20 Hz at 500 deg/s.
    """
    least_hz = max(least_hz, gyro_dps / 25)
    if not least_hz <= rate_hz <= 2000:
        raise ValueError("rate_hz %s: must be %d to 2000 with this gyro" % (rate_hz, least_hz))


def largest_sum(matrix, row, offset):
    """Largest magnitude that a row can give, in the unit of the counts."""
    return 32768.0 * sum([abs(c) for c in matrix[3 * row : 3 * row + 3]]) + abs(offset)


def offset_of(matrix, row, bias):
    """-(M b) of one row."""
    return -sum([matrix[3 * row + i] * bias[i] for i in range(3)])


def fold_accel(store, at, cal, lsb_per_g):
    """Nine Q14 coefficients, then three Q14 offsets with the rounding in, from store[at] on.

    Results are counts of the same scale as the sensor's. ValueError when a full-scale input
    could pass ACCEL_LIMIT, which no rotation with the datasheet's tolerances does.
    """
    matrix = cal.accel_matrix
    for row in range(3):
        offset = offset_of(matrix, row, cal.accel_bias_g) * lsb_per_g
        if largest_sum(matrix, row, offset) > ACCEL_LIMIT:
            raise ValueError("accel_matrix row %d with its bias is beyond the number range" % row)
        for i in range(3):
            store[at + 3 * row + i] = _nearest(matrix[3 * row + i] * 16384.0)
        store[at + 9 + row] = _nearest(offset * 16384.0) + 8192


def fold_gyro(store, at, rows, cal, lsb_per_dps, unit_per_count):
    """3 `rows` coefficients, then `rows` offsets with the rounding in; returns the shift.

    The result is counts times unit_per_count (any unit per sample). The shift is the largest
    at which a full-scale sum stays inside 32 bits, so the coefficients use all of theirs.
    """
    matrix = cal.gyro_matrix
    offsets = [offset_of(matrix, row, cal.gyro_bias_dps) * lsb_per_dps for row in range(rows)]
    largest = max([largest_sum(matrix, row, offsets[row]) for row in range(rows)])
    shift = 0
    while shift < 24 and largest * unit_per_count * (2 << shift) < _SUM_LIMIT:
        shift += 1
    if largest * unit_per_count * (1 << shift) >= _SUM_LIMIT:
        raise ValueError("gyro_matrix or period beyond the number range")
    scale = unit_per_count * (1 << shift)
    for row in range(rows):
        for i in range(3):
            store[at + 3 * row + i] = _nearest(matrix[3 * row + i] * scale)
        store[at + 3 * rows + row] = _nearest(offsets[row] * scale) + (1 << shift >> 1)
    return shift


def _nearest(value):
    return int(value + 0.5) if value >= 0 else -int(0.5 - value)

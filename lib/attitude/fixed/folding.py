# SPDX-License-Identifier: MIT
"""Folds range, calibration, mounting and period into the integer coefficients of one step.

Float work for construction and calibration; nothing here runs in the loop. With counts x (int16)
a step computes y = (c0 x0 + c1 x1 + c2 x2 + offset) >> shift, so an ideal sensor and a
calibrated, skewed, rotated one cost the same. No sum can leave 32 bits: it is checked here.
"""

from micropython import const

from attitude.counts import row_of

ACCEL_LIMIT = 65000  # the largest calibrated count that atan2's 15-bit quotient takes
_SUM_LIMIT = const(2100000000)  # 2^31 less what rounding adds


def check_rate(rate_hz, gyro_dps, least_hz=10):
    """ValueError for a rate that the fixed-point formats do not hold, whatever the gyro gives.

    A sample may turn by 25 degrees at most: 80 Hz at 2000 deg/s, 20 Hz at 500 deg/s.
    """
    least_hz = max(least_hz, gyro_dps / 25)
    if not least_hz <= rate_hz <= 2000:
        raise ValueError("rate_hz %s: must be %d to 2000 with this gyro" % (rate_hz, least_hz))


def largest_sum(row):
    """Largest magnitude that a row can give, in the unit of the counts."""
    return 32768.0 * (abs(row[0]) + abs(row[1]) + abs(row[2])) + abs(row[3])


def fold_accel(store, at, cal, lsb_per_g):
    """Nine Q14 coefficients, then three Q14 offsets with the rounding in, from store[at] on.

    Results are counts of the same scale as the sensor's. ValueError when a full-scale input
    could pass ACCEL_LIMIT, which no rotation with the datasheet's tolerances does.
    """
    bias = [b * lsb_per_g for b in cal.accel_bias_g]
    for i in range(3):
        row = row_of(cal.accel_matrix, i, bias)
        if not largest_sum(row) <= ACCEL_LIMIT:
            raise ValueError("accel_matrix row %d with its bias is beyond the number range" % i)
        _put(store, at, i, row, 16384.0, 8192)


def fold_gyro(store, at, cal, lsb_per_dps, unit_per_count, spare=1.0):
    """Nine coefficients, then three offsets with the rounding in; returns the shift.

    The result is counts times unit_per_count (any unit per sample). The shift is the largest
    at which a full-scale sum, `spare` times as large, stays inside 32 bits, so the coefficients
    use all of theirs.
    """
    bias = [b * lsb_per_dps for b in cal.gyro_bias_dps]
    rows = [row_of(cal.gyro_matrix, i, bias) for i in range(3)]
    largest = max([largest_sum(row) for row in rows]) * unit_per_count * spare
    if not largest < _SUM_LIMIT:
        raise ValueError("gyro_matrix or its bias is beyond the number range")
    shift = 0
    while shift < 24 and largest * (2 << shift) < _SUM_LIMIT:
        shift += 1
    for i in range(3):
        _put(store, at, i, rows[i], unit_per_count * (1 << shift), 1 << shift >> 1)
    return shift


def mantissa(value):
    """(m, shift): value is m / 2^shift, with m of 15 bits or the shift 29."""
    shift = 0
    while shift < 29 and value * (2 << shift) < 32768.0:
        shift += 1
    return int(value * (1 << shift)), shift


def _put(store, at, i, row, scale, rounding):
    for k in range(3):
        store[at + 3 * i + k] = _nearest(row[k] * scale)
    store[at + 9 + i] = _nearest(row[3] * scale) + rounding


def _nearest(value):
    return int(value + 0.5) if value >= 0 else -int(0.5 - value)

# SPDX-License-Identifier: MIT
"""What the integer Attitude knows of its gyro's errors, and their use: attitude.GyroLearning.

An error's variance is kept in a unit of its own, 2^-E, so that it is a quarter to one of it: the
rows of the covariance keep their bits while the errors become known by and by.
Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

from attitude.fixed.intmath import isqrt

_GYRO = const(12)
_START = const(73)
_SCALE = const(75)
_CROSS = const(77)
_USED = const(124)
_E = const(289)
_COV = const(303)
_SPREAD = const(499)
_MATRIX = const(503)
_NOISE = const(512)
_LOOKS = const(513)
_TILT = const(552)
_LEAST = const(4295)  # (2 mg)^2, Q30


@micropython.viper
def unknown(array, i: int, e: int, variance: int):
    """Error i is unknown by this variance in units of 2^-e, Q30, and related to no other."""
    s = ptr32(array)
    j = 0
    while j < 14:
        s[_COV + 14 * i + j] = 0
        s[_COV + 14 * j + i] = 0
        j += 1
    s[_COV + 15 * i] = variance
    s[_E + i] = e


@micropython.viper
def know_nothing(array):
    """Nothing is known but the settings."""
    s = ptr32(array)
    i = 0
    while i < 14:
        at = _START
        if i > 2:
            at = _CROSS
            if i & 3 == 3:
                at = _SCALE
        if i < 12:
            unknown(array, i, s[at], s[at + 1])
        else:
            unknown(array, i, 0, 0)
        i += 1
    i = 0
    while i < 9:
        s[_MATRIX + i] = 0
        i += 1
    s[_NOISE] = _LEAST
    s[_LOOKS] = 0
    spread(array)


@micropython.viper
def spread(array):
    """Sum up the variances, in (rad/s)^2 Q28: of the biases, of what goes with each rate; and that
    of the unknown tilt."""
    s = ptr32(array)
    i = 0
    while i < 4:
        s[_SPREAD + i] = 0
        i += 1
    i = 0
    while i < 12:
        at = _SPREAD
        if i > 2:
            at += 1 + i % 3
        e = 2 * s[_E + i] + 2
        t = 0
        if e < 31:
            t = s[_COV + 15 * i] >> e
        s[at] += t
        i += 1
    t = (s[_COV + 180] >> 2 * s[_E + 12]) + (s[_COV + 195] >> 2 * s[_E + 13])
    s[_TILT] = int(isqrt(t))


@micropython.viper
def use(array, i: int):
    """Make row i of the gyro's coefficients with what was learned; 3: all."""
    s = ptr32(array)
    end = i + 1
    if i == 3:
        i = 0
    while i < end and i < 3:
        a = s[_MATRIX + 3 * i]  # 0.06 at most: 2^26
        b = s[_MATRIX + 3 * i + 1]
        c = s[_MATRIX + 3 * i + 2]
        x = s[_GYRO + 9]
        y = s[_GYRO + 10]
        z = s[_GYRO + 11]
        t = (a >> 12) * (x >> 18) + (b >> 12) * (y >> 18) + (c >> 12) * (z >> 18)
        t += (a >> 15) * (x >> 3 & 0x7FFF) + (b >> 15) * (y >> 3 & 0x7FFF) >> 12
        s[_USED + 9 + i] = s[_GYRO + 9 + i] + t + ((c >> 15) * (z >> 3 & 0x7FFF) >> 12)
        a >>= 12
        b >>= 12
        c >>= 12
        j = 0
        while j < 3:
            t = a * s[_GYRO + j] + b * s[_GYRO + 3 + j] + c * s[_GYRO + 6 + j] + 131072
            s[_USED + 3 * i + j] = s[_GYRO + 3 * i + j] + (t >> 18)
            j += 1
        i += 1

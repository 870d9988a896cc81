# SPDX-License-Identifier: MIT
"""What the integer Attitude knows of its gyro's errors, and their use: attitude.GyroLearning.

Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

from attitude.fixed.intmath import isqrt

_GYRO = const(12)
_START = const(72)
_USED = const(84)
_SIGMA = const(105)
_SPREAD = const(122)
_TILT = const(126)
_MATRIX = const(127)
_NOISE = const(136)
_LOOKS = const(137)
_LEAST_NOISE = const(4295)  # (2 mg)^2, Q30


@micropython.viper
def know_nothing(array):
    """Nothing is known but the settings."""
    s = ptr32(array)
    end = _NOISE
    i = 0
    while i < 12:
        k = 2
        if i < 3:
            k = 0
        elif i & 3 == 3:
            k = 1
        s[_SIGMA + i] = s[_START + k]
        i += 1
    i = _SIGMA + 12
    while i < end:
        s[i] = 0
        i += 1
    s[_NOISE] = _LEAST_NOISE
    s[_LOOKS] = 0
    spread(array)


@micropython.viper
def spread(array):
    """Sum up the variances, in (rad/s)^2 Q28: of the biases, of what goes with each rate; and the
    sigma of the unknown tilt.
    """
    s = ptr32(array)
    i = 0
    while i < 12:
        k = _SPREAD
        t = s[_SIGMA + i] + 32768 >> 16
        t *= t
        if i > 2:
            k += 1 + i % 3
        if i and i != 3 and i != 4 and i != 5:
            t += s[k]
        s[k] = t
        i += 1
    t = s[_SIGMA + 12] >> 15
    i = s[_SIGMA + 13] >> 15
    s[_TILT] = int(isqrt(t * t + i * i))


@micropython.viper
def use(array, i: int):
    """Make row i of the gyro's coefficients with what was learned."""
    s = ptr32(array)
    at = _GYRO
    a = s[_MATRIX + 3 * i] >> 12  # 0.06 at most: 2^14
    b = s[_MATRIX + 3 * i + 1] >> 12
    c = s[_MATRIX + 3 * i + 2] >> 12
    i *= 3
    end = i + 3
    while i < end:
        t = a * s[at] + b * s[at + 3] + c * s[at + 6] + 131072
        s[_USED + i] = s[_GYRO + i] + (t >> 18)
        at += 1
        i += 1
    i = end // 3 + 8  # the offset
    x = s[_GYRO + 9]
    y = s[_GYRO + 10]
    z = s[_GYRO + 11]
    t = (a * (x >> 15) >> 2) + (b * (y >> 15) >> 2) + (c * (z >> 15) >> 2)
    t += a * (x & 0x7FFF) + b * (y & 0x7FFF) + c * (z & 0x7FFF) >> 17
    s[_USED + i] = s[_GYRO + i] + (t >> 1)

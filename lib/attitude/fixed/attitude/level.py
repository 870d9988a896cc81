# SPDX-License-Identifier: MIT
"""Levelling the integer attitude and beginning anew: rare, so it has its own functions and
takes its time. Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.errors import know_nothing, use
from attitude.fixed.intmath import isqrt

_ONE = const(32)
_W = const(76)
_X = const(77)
_Y = const(78)
_Z = const(79)
_YAW_NOISE = const(138)
_ROLL = const(155)
_TRIM = const(166)
_K_SHIFT = const(178)
_MOST_G = const(180)
_LEFT = const(181)
_BEGIN = const(80)
_RATES = const(158)
_UNCERTAIN = const(165)
_MOVED = const(104)
_CHANGE = const(360)
_STATE = const(75)
_STATE_END = const(364)


@micropython.viper
def turn(array, w: int, x: int, y: int, z: int):
    """q <- (w, x, y, z) q, a rotation of the earth frame of any length below 2^30.

    array is the filter's. The turn's angle has an error of 1e-4 of itself.
    All zero is half a turn about x.
    """
    s = ptr32(array)
    if not w | x | y | z:
        x = 1
    a = w ^ w >> 31 | x ^ x >> 31 | y ^ y >> 31 | z ^ z >> 31 | 1
    while not a >> 28:
        a <<= 1
        w <<= 1
        x <<= 1
        y <<= 1
        z <<= 1
    a = w >> 15
    b = x >> 15
    c = y >> 15
    d = z >> 15
    n = int(isqrt(a * a + b * b + c * c + d * d))
    # the quotients Q30 in two steps; w less one, so that a small turn keeps all of q's bits
    w = (w // n << 15) + ((w % n << 15) // n) - s[_ONE]
    x = (x // n << 15) + ((x % n << 15) // n)
    y = (y // n << 15) + ((y % n << 15) // n)
    z = (z // n << 15) + ((z % n << 15) // n)
    a = w >> 15
    b = x >> 15
    c = y >> 15
    d = z >> 15
    w = w & 0x7FFF
    x = x & 0x7FFF
    y = y & 0x7FFF
    z = z & 0x7FFF
    h = s[_W] + 16384 >> 15
    i = s[_X] + 16384 >> 15
    j = s[_Y] + 16384 >> 15
    k = s[_Z] + 16384 >> 15
    s[_W] += a * h - b * i - c * j - d * k + (w * h - x * i - y * j - z * k + 16384 >> 15)
    s[_X] += a * i + b * h + c * k - d * j + (w * i + x * h + y * k - z * j + 16384 >> 15)
    s[_Y] += a * j - b * k + c * h + d * i + (w * j - x * k + y * h + z * i + 16384 >> 15)
    s[_Z] += a * k + b * j - c * i + d * h + (w * k + x * j - y * i + z * h + 16384 >> 15)
    s[_TRIM] = 0


@micropython.viper
def level(array, x: int, y: int, z: int, least: int) -> int:
    """Turn q the short way so that the earth vector (x, y, z) points up.

    Any scale up to 2^29. Returns the vector's length (within 1e-4), or 0 when it is shorter than
    least, which changes nothing; least is at least 1. The rotation is (|u| + z, y, -x, 0), coarse
    (a quarter of a degree) next to upside down.
    """
    # the largest component to 29 bits
    if not x | y | z:
        return 0
    t = x ^ x >> 31 | y ^ y >> 31 | z ^ z >> 31 | 1
    k = 0
    while not t >> 28:
        t <<= 1
        k += 1
    x <<= k
    y <<= k
    z <<= k
    i = x >> 15
    j = y >> 15
    h = z >> 15
    n = int(isqrt(i * i + j * j + h * h))
    length = n << 15 >> k
    if length < least:
        return 0
    w = (n << 14) + (z >> 1)
    if z < 0:
        w = (i * i + j * j) // (n - h) << 14  # n + z without its cancellation
    turn(array, w, y >> 1, 0 - (x >> 1), 0)
    return length


@micropython.viper
def zero_yaw(array):
    """Turn q about the vertical to yaw 0, which counts from here; straight up or down there is no
    yaw to take."""
    s = ptr32(array)
    w = s[_W] + 16384 >> 15
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    c = 16384 - (y * y + z * z >> 15)  # cosine and sine of the yaw, Q14
    z = w * z + x * y >> 15
    n = int(isqrt(c * c + z * z))
    if n > 15:
        if c < 0:
            n = z * z // (n - c)  # n + c without its cancellation
        else:
            n += c
        turn(array, n << 14, 0, 0, 0 - (z << 14))
    end = _ROLL
    i = _YAW_NOISE
    while i < end:
        s[i] = 0
        i += 1
    s[_CHANGE + 2] = 0


@micropython.viper
def begin(array):
    """Forget everything; the next sample levels, with yaw 0."""
    s = ptr32(array)
    end = _RATES
    i = _STATE
    while i < end:
        s[i] = 0
        i += 1
    s[_W] = s[_ONE]
    know_nothing(array)
    begin_again(array)
    s[_BEGIN] = 2
    s[_MOVED] = 0


@micropython.viper
def begin_again(array):
    """The next samples level anew; attitude, bias and what is known of the gyro stay till then."""
    s = ptr32(array)
    end = _STATE_END
    i = _RATES
    while i < end:
        s[i] = 0
        i += 1
    if s[_BEGIN] == 0:
        s[_BEGIN] = 1
    elif s[_BEGIN] == 3:
        s[_BEGIN] = 2
    s[_MOVED] = 1  # who knows
    s[_K_SHIFT] = 9
    s[_MOST_G] = 1073741823
    s[_LEFT] = 1  # the first block is the first sample: it levels
    s[_UNCERTAIN] = 1
    i = 0
    while i < 3:
        use(array, i)
        i += 1

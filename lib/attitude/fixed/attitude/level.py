# SPDX-License-Identifier: MIT
"""Levelling the integer attitude and beginning anew: rare, so it has its own functions and
takes its time. Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

from attitude.fixed.intmath import isqrt

_ONE = const(32)
_W = const(56)
_X = const(57)
_Y = const(58)
_Z = const(59)
_TRIM = const(60)
_BIAS = const(64)
_FRACTION = const(67)
_K_SHIFT = const(75)
_LEFT = const(77)
_BEGIN = const(81)
_SUM = const(82)
_ROLL = const(88)
_RATES = const(91)
_HOME = const(104)
_UP = const(110)
_RESTED = const(116)
_MOVED = const(118)
_SPEED = const(119)
_GAIN = const(121)
_STATE = const(55)
_STATE_END = const(140)


@micropython.viper
def turn(array, w: int, x: int, y: int, z: int):
    """q <- (w, x, y, z) q, a rotation of the earth frame of any length below 2^30.

    array is the filter's. The turn's angle has an error of 1e-4 of itself.
    All zero is half a turn about x.
    """
    s = ptr32(array)
    a = (w if w >= 0 else 0 - w) | (x if x >= 0 else 0 - x)
    a |= (y if y >= 0 else 0 - y) | (z if z >= 0 else 0 - z)
    if a == 0:
        x = a = 268435456
    while a < 268435456:
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
    t = (x if x >= 0 else 0 - x) | (y if y >= 0 else 0 - y) | (z if z >= 0 else 0 - z)
    if t == 0:
        return 0
    k = 0
    while t < 268435456:
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
def without_yaw(array):
    """Turn q about the vertical to yaw 0; straight up or down there is no yaw to take."""
    s = ptr32(array)
    w = s[_W] + 16384 >> 15
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    c = 16384 - (y * y + z * z >> 15)  # cosine and sine of the yaw, Q14
    z = w * z + x * y >> 15
    n = int(isqrt(c * c + z * z))
    if n < 16:
        return
    if c < 0:
        n = z * z // (n - c)  # n + c without its cancellation
    else:
        n += c
    turn(array, n << 14, 0, 0, 0 - (z << 14))


@micropython.viper
def begin(array):
    """Forget everything; the next sample levels, with yaw 0."""
    s = ptr32(array)
    end = _STATE_END
    i = _STATE
    while i < end:
        s[i] = 0
        i += 1
    s[_W] = s[_ONE]
    s[_K_SHIFT] = 9
    s[_LEFT] = 1  # the first block is the first sample: it levels
    s[_BEGIN] = 2


@micropython.viper
def begin_again(array):
    """The next samples level anew; attitude, bias and what is known of the bias stay till then."""
    s = ptr32(array)
    end = _STATE_END
    i = _TRIM
    while i < _BIAS:
        s[i] = 0
        i += 1
    i = _FRACTION
    while i < _BEGIN:
        s[i] = 0
        i += 1
    i = _SUM
    while i < _ROLL:
        s[i] = 0
        i += 1
    i = _RATES
    while i < _HOME:
        s[i] = 0
        i += 1
    i = _UP
    while i < _RESTED:
        s[i] = 0
        i += 1
    s[_SPEED] = 0
    i = _GAIN
    while i < end:
        s[i] = 0
        i += 1
    s[_K_SHIFT] = 9
    s[_LEFT] = 1
    if s[_BEGIN] == 0:
        s[_BEGIN] = 1
    s[_MOVED] = 1  # who knows

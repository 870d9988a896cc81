# SPDX-License-Identifier: MIT
"""Levelling the integer attitude: rare, so it has its own function and takes its time."""

import micropython
from micropython import const

from attitude.fixed.intmath import isqrt

_ONE = const(29)
_W = const(34)
_X = const(35)
_Y = const(36)
_Z = const(37)
_TRIM = const(38)
_VX = const(48)
_VY = const(49)
_PX = const(50)
_PY = const(51)


@micropython.viper
def level(array, x: int, y: int, z: int, least: int) -> int:
    """Turn q the short way so that the earth vector (x, y, z) points up; forget v and p.

    array is the filter's, see attitude_step. Any scale up to 2^29. Returns the vector's length
    (within 1e-4), or 0 when it is shorter than least, which changes nothing; least is at least 1.
    The rotation is (|u| + z, y, -x, 0) / norm; its angle has an error of 1e-4 of itself, and a
    quarter of a degree next to upside down.
    """
    s = ptr32(array)
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
    if z < 0:
        w = (i * i + j * j) // (n - h) << 15  # n + z without its cancellation
        if w == 0:
            x = 0
            y = 268435456
    else:
        w = (n << 15) + z
    i = x >> 16
    j = y >> 16
    h = w >> 16
    n = int(isqrt(i * i + j * j + h * h))

    # the quotients Q30 in two steps; w less one, so that a small turn keeps all of q's bits
    x = 0 - x
    w = (w // n << 14) + ((w % n << 14) // n) - s[_ONE]
    x = (x // n << 14) + ((x % n << 14) // n)
    y = (y // n << 14) + ((y % n << 14) // n)
    a = w >> 15
    b = y >> 15
    c = x >> 15
    w &= 0x7FFF
    y &= 0x7FFF
    x &= 0x7FFF
    h = s[_W] + 16384 >> 15
    i = s[_X] + 16384 >> 15
    j = s[_Y] + 16384 >> 15
    k = s[_Z] + 16384 >> 15
    s[_W] += a * h - b * i - c * j + (w * h - y * i - x * j + 16384 >> 15)
    s[_X] += a * i + b * h + c * k + (w * i + y * h + x * k + 16384 >> 15)
    s[_Y] += a * j + c * h - b * k + (w * j + x * h - y * k + 16384 >> 15)
    s[_Z] += a * k + b * j - c * i + (w * k + y * j - x * i + 16384 >> 15)
    s[_TRIM] = 0
    s[_VX] = 0
    s[_VY] = 0
    s[_PX] = 0
    s[_PY] = 0
    return length

# SPDX-License-Identifier: MIT
"""The integer Attitude's view of what each error of its gyro adds: attitude.GyroView, spread over
the samples after each block. Places and formats: this folder's __init__. Errors are numbered as
there: 0 to 2 biases, 3 to 11 a matrix row by row, then the tilt that is unknown.

No number leaves its range: an input is below 2^22, a tilt is clamped to 2^28, and the filter
behind it, with a step of a quarter at most, makes no more than its double.
"""

import micropython
from micropython import const

_VIEW_N = const(71)
_KEEPS = const(69)
_WORK = const(176)
_FLAGS = const(180)
_G = const(181)
_TURN = const(182)
_ROWS = const(186)
_FRESH_ROWS = const(201)
_VIEW = const(202)
_OWN = const(274)
_YAW_VIEW = const(277)


@micropython.viper
def view(array):
    """Follow the last block with the next VIEW_N errors."""
    s = ptr32(array)
    most = 268435456  # 2^28
    n = s[_VIEW_N]
    k = s[_WORK]
    flags = s[_FLAGS]
    g = s[_G]
    while n and k < 13:
        n -= 1
        i = k - 1
        k += 1
        r = i
        t = 3  # a bias turns by itself times the block's span
        if i > 2:
            r = (i - 3) // 3
            t = (i - 3) % 3
        m = s[_TURN + t]

        at = _YAW_VIEW + i
        t = s[at]
        if i < 3:
            t = (t >> 15) * s[_KEEPS] + ((t & 0x7FFF) * s[_KEEPS] >> 15)
        t += s[_ROWS + 6 + r] * m >> 9
        if t > most:
            t = most
        elif t < 0 - most:
            t = 0 - most
        s[at] = t
        if flags & 8:
            continue

        axis = 0
        at = _VIEW + i
        while axis < 2:
            p = s[at + 24]
            t = s[at] + (s[_ROWS + r] * m >> 9)
            if flags & 1 << axis == 0:
                t -= (p >> 15) * g + ((p & 0x7FFF) * g >> 15)
            if t > most:
                t = most
            elif t < 0 - most:
                t = 0 - most
            s[at] = t
            v = 0
            if flags & 4 == 0:
                v = s[at + 12]
            t -= p << 1
            v += (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
            s[at + 12] = v
            t = v - (p << 1)
            s[at + 24] = p + (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
            axis += 1
            at += 36
            r += 3
    if n and k == 13:
        k = 14
        if flags & 8 == 0:
            p = s[_OWN + 2]
            t = s[_OWN]
            if flags & 3 == 0:
                t -= (p >> 15) * g + ((p & 0x7FFF) * g >> 15)
            s[_OWN] = t
            v = 0
            if flags & 4 == 0:
                v = s[_OWN + 1]
            t -= p << 1
            v += (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
            s[_OWN + 1] = v
            t = v - (p << 1)
            s[_OWN + 2] = p + (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
    s[_WORK] = k


@micropython.viper
def clear(array):
    """No error has shown yet; yaw remembers."""
    s = ptr32(array)
    end = _YAW_VIEW
    i = _VIEW
    while i < end:
        s[i] = 0
        i += 1
    s[_FRESH_ROWS] = 1

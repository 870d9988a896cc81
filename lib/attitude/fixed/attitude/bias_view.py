# SPDX-License-Identifier: MIT
"""The integer Attitude's gyro bias in motion: attitude.BiasView, one sample after each block.

A bias is fixed to the sensor, the level loop to the earth and slow, so the attitude matrix goes
through the loop's own third-order filter; the loop's position projected on it is the bias.
Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

_K = const(74)
_K_SHIFT = const(75)
_W = const(56)
_X = const(57)
_Y = const(58)
_Z = const(59)
_BIAS = const(64)
_PX = const(72)
_PY = const(73)
_HOME_BIAS = const(107)
_AGE = const(114)
_STILL = const(115)
_LEARNED = const(117)
_KNOWN = const(120)
_TILT = const(122)
_VELOCITY = const(128)
_POSITION = const(134)
_N = const(33)
_LIMIT_BIAS = const(39)
_REST = const(41)
_QUICK = const(48)
_KNOWN_MAX = const(49)
_LEARN_AGE = const(50)
_MOST = const(26214)  # 0.05 g, Q19: more is no bias but a wrong attitude


@micropython.viper
def view(array):
    """Follow the attitude by one block; away from rest, learn."""
    s = ptr32(array)
    if s[_STILL] >= s[_REST]:
        return
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    w = s[_W] + 16384 >> 15
    k = s[_K_SHIFT]
    g = s[_K] * s[_N] >> k  # gain times the block's time, Q15
    if g > 8192:
        g = 8192
    i = 0
    while i < 6:
        # the rows' elements, Q15
        if i == 0:
            t = w * w + x * x - y * y - z * z >> 15
        elif i == 1:
            t = x * y - w * z >> 14
        elif i == 2:
            t = x * z + w * y >> 14
        elif i == 3:
            t = x * y + w * z >> 14
        elif i == 4:
            t = w * w - x * x + y * y - z * z >> 15
        else:
            t = y * z - w * x >> 14
        p = s[_POSITION + i]
        t = (t << 9) - p
        t = s[_TILT + i] + (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
        s[_TILT + i] = t
        p <<= 1
        t -= p
        t = s[_VELOCITY + i] + (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
        s[_VELOCITY + i] = t
        t -= p
        s[_POSITION + i] = (p >> 1) + (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
        i += 1
    if s[_AGE] <= s[_LEARN_AGE]:
        return

    # quick as long as the bias has been watched for a short time only
    t = s[_KNOWN] + 1
    if t > s[_KNOWN_MAX]:
        t = s[_KNOWN_MAX]
    s[_KNOWN] = t
    if t < s[_QUICK]:
        t = s[_QUICK]
    x = s[_PX] >> 5
    y = s[_PY] >> 5
    if x > _MOST:
        x = _MOST
    elif x < -_MOST:
        x = -_MOST
    if y > _MOST:
        y = _MOST
    elif y < -_MOST:
        y = -_MOST
    g = s[_K]
    k -= 2
    w = s[_LIMIT_BIAS + s[_LEARNED]]
    i = 0
    while i < 3:
        # g Q19 times Q14, times gain, in inc Q8 per sample: 2^33 / dt cancels to 2^-21 below
        p = (s[_POSITION + 3 + i] >> 10) * x - (s[_POSITION + i] >> 10) * y
        p = (p >> 15) * g + ((p & 0x7FFF) * g >> 15) >> k
        # rounded: what is cut off would pile up in the axis that nobody sees, yaw
        p = s[_BIAS + i] - s[_HOME_BIAS + i] + ((p << 1) + (t >> 1)) // t
        if p > w:
            p = w
        elif p < 0 - w:
            p = 0 - w
        s[_BIAS + i] = s[_HOME_BIAS + i] + p
        i += 1

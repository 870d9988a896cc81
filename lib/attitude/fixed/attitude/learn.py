# SPDX-License-Identifier: MIT
"""The integer Attitude's look at its level loop: attitude.GyroLearning, in steps that are spread
over the samples of three blocks. Places and formats: this folder's __init__.

    1       the view of one level axis' position, its noise, and one scale for both
    2-6     three rows of the covariance each: the errors' covariance with the position
    7       the position's sigma; what was seen by it
    9-13    three errors each: what is changed, made good as if it had always been known
    14      turn, coefficients
    17-21   three rows of the covariance each, less what has been told
    22      units

8 and 16 wait for the next block. In that scale views and noise together are below 2^15, so a
row's sum is below 2^21, a variance below 2^30. A part by its sigma is no more than the square
root of the error's own variance.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.errors import spread, use
from attitude.fixed.attitude.level import turn
from attitude.fixed.intmath import isqrt, mul_q30

_WALK = const(66)
_WALKS = const(67)
_K_MOTION = const(50)
_LEARN_N = const(72)
_INC_RAD = const(59)
_BIAS = const(88)
_VX = const(94)
_PX = const(96)
_SINCE = const(163)
_LEARNED = const(164)
_GAIN = const(166)
_LEVEL = const(170)
_PHASE = const(177)
_AXIS = const(179)
_VIEW = const(202)
_OWN = const(274)
_E = const(289)
_COV = const(303)
_MATRIX = const(503)
_NOISE = const(512)
_LOOKS = const(513)
_EXPLAINED = const(514)
_SEEN_BY = const(517)
_TOLD = const(531)
_SH = const(545)
_SIGMA = const(546)
_OFF = const(547)
_NU = const(548)
_CHANGE = const(549)
_MOST_MATRIX = const(64424509)  # 0.06, Q30
_LEAST = const(4295)  # (2 mg)^2, Q30
_WALKED = const(3748229)  # 0.05 deg/s in rad/s, Q32


@micropython.viper
def learn(array):
    """The next LEARN_N steps of this block."""
    s = ptr32(array)
    n = s[_LEARN_N]
    while n and s[_PHASE] & 7:  # not 0 or 8
        n -= 1
        _step(array)


@micropython.viper
def new_block(array):
    """The last block's steps are over, those of the next begin."""
    s = ptr32(array)
    while s[_PHASE] & 7:
        _step(array)
    if s[_PHASE]:
        s[_PHASE] += 1


@micropython.viper
def finish(array):
    """To the end, if errors have been changed; otherwise forget the look."""
    s = ptr32(array)
    if s[_PHASE] < 10:
        s[_PHASE] = 0
    while s[_PHASE]:
        _step(array)


@micropython.viper
def _step(array):
    s = ptr32(array)
    k = s[_PHASE]
    s[_PHASE] = k + 1
    if k == 1:
        _see(array)
    elif k < 7:
        _told(array, 3 * k - 6)
    elif k == 7:
        _sum(array)
    elif k < 9:
        return
    elif k < 14:
        i = 3 * k - 27
        k = i + 3
        while i < k and i < 14:
            _change(array, i)
            i += 1
    elif k < 15:
        _turn(array)
        s[_PHASE] = 16
    elif k < 17:
        return
    elif k < 22:
        _less(array, 3 * k - 51)
    else:
        _units(array)


@micropython.viper
def _told(array, i: int):
    """Three errors' covariance with the position."""
    s = ptr32(array)
    end = i + 3
    if end > 14:
        end = 14
    while i < end:
        t = 0
        at = _COV + 14 * i
        j = 0
        while j < 14:
            t += (s[at + j] + 16384 >> 15) * s[_SEEN_BY + j] >> 9
            j += 1
        s[_TOLD + i] = t
        i += 1


@micropython.viper
def _less(array, i: int):
    """Three errors' covariances less what has been told of them."""
    s = ptr32(array)
    end = i + 3
    if end > 14:
        end = 14
    while i < end:
        r = s[_TOLD + i]
        at = _COV + 14 * i
        j = 0
        while j < 14:
            t = (s[at + j] >> 1) - (r * s[_TOLD + j] >> 1)
            if t > 536870911:
                t = 536870911
            elif t < -536870911:
                t = -536870911
            s[at + j] = t << 1
            j += 1
        if r and s[at + i] < 65536:
            s[at + i] = 65536
        i += 1


@micropython.viper
def _see(array):
    s = ptr32(array)
    _walk(array)

    # what passes for noise: what no error has explained so far, and the accelerations
    k = (s[_GAIN] << 8) // ((s[_K_MOTION] >> 2) + 1)  # the gain by its least, Q10
    if k < 1024:
        k = 1024
    elif k > 32768:
        k = 32768
    t = (s[_LEVEL] >> 5) * (655 + 104858 // (80 + s[_LOOKS])) >> 15
    if t > 23170:
        t = 23170
    t = t * k >> 10
    if t > 23170:
        t = 23170
    k = s[_NOISE] << 4
    if k < _LEAST:
        k = _LEAST
    noise = int(isqrt(t * t + k)) << 11  # g Q26
    if noise > 67108864:
        noise = 67108864

    # each error's unit in the position, g Q26
    axis = s[_AXIS]
    at = _VIEW + 36 * axis + 24
    total = noise
    i = 0
    while i < 14:
        t = 0
        if i < 12:
            t = s[at + i]
        elif i - 12 == axis:
            t = s[_OWN + 2]
        e = s[_E + i]
        if e < 8:
            k = 1048576 << e
            if t > k:
                t = k
            elif t < 0 - k:
                t = 0 - k
        if e < 6:
            t <<= 6 - e
        else:
            t >>= e - 6
        s[_SEEN_BY + i] = t
        total += t if t >= 0 else 0 - t
        i += 1
    k = 0
    while total >> k > 32767:
        k += 1
    s[_SH] = k
    i = 0
    while i < 14:
        s[_SEEN_BY + i] >>= k
        i += 1
    s[_SIGMA] = noise >> k
    s[_OFF] = s[_PX + axis] << 2 >> k


@micropython.viper
def _walk(array):
    """The biases walk, but no further from the last rest's than they can."""
    s = ptr32(array)
    most = 1073741823  # 2^30 - 1
    since = s[_SINCE]
    if since > 100000:
        since = 100000
    far = _WALKED + since * s[_WALKS]
    i = 0
    while i < 3:
        e = s[_E + i]
        k = 2 * e - 14
        if k > 0:
            t = 268435456
            if k < 30 and s[_WALK] < 268435456 >> k:
                t = s[_WALK] << k
        else:
            t = s[_WALK] >> 0 - k
        v = s[_COV + 15 * i]
        if e and (t >= 268435456 or t > most - v):
            unit(array, i, e - 1)
            continue
        if t < most - v:
            v += t
        k = 32768
        if e < 17:
            k = far >> 17 - e
        if s[_LEARNED] == 0 or k > 32767 or v < k * k:
            s[_COV + 15 * i] = v
        i += 1


@micropython.viper
def unit(array, i: int, e: int):
    """Error i in a unit of 2^-e, half or double that of before."""
    s = ptr32(array)
    double = e < s[_E + i]
    s[_E + i] = e
    at = _COV + 15 * i
    t = s[at]
    s[at] = t >> 1 if double else t << 1  # and once more below
    j = 0
    while j < 14:
        k = 0
        at = _COV + 14 * i + j
        while k < 2:
            t = s[at]
            if double:
                t >>= 1
            elif t > 536870911:
                t = 1073741823
            elif t < -536870911:
                t = -1073741823
            else:
                t <<= 1
            if k == 0 or j != i:
                s[at] = t
            at = _COV + 14 * j + i
            k += 1
        j += 1


@micropython.viper
def _sum(array):
    s = ptr32(array)
    t = 0
    i = 0
    while i < 14:
        t += s[_SEEN_BY + i] * (s[_TOLD + i] >> 6)
        i += 1
    if t < 0:
        t = 0
    noise = s[_SIGMA]
    sigma = int(isqrt(t + noise * noise))
    if sigma < 1:
        sigma = 1
    y = s[_OFF]
    if y > 3 * sigma:
        y = 3 * sigma
    elif y < -3 * sigma:
        y = -3 * sigma
    s[_NU] = (y << 13) // sigma
    i = 0
    while i < 14:
        y = (s[_TOLD + i] << 9) // sigma
        k = int(isqrt(s[_COV + 15 * i]))
        if y > k:
            y = k
        elif y < 0 - k:
            y = 0 - k
        s[_TOLD + i] = y
        i += 1

    # the variance that the errors explain, g^2 Q30, and what they do not
    k = 2 * s[_SH] - 22
    if k <= 0:
        t >>= 0 - k
    elif t >> 28 - k if k < 28 else t:
        t = 268435456
    else:
        t <<= k
    s[_EXPLAINED + s[_AXIS]] = t
    y = s[_PX + s[_AXIS]]
    y = (y if y >= 0 else 0 - y) >> 9
    if y > 16384:
        y = 16384
    t = y * y - t
    if t < 0:
        t = 0
    t -= s[_NOISE]
    t = s[_NOISE] + ((t >> 15) * 197 + ((t & 0x7FFF) * 197 >> 15))
    if t > 33554432:
        t = 33554432
    s[_NOISE] = t
    if s[_LOOKS] < 32767:
        s[_LOOKS] += 1
    i = 0
    while i < 3:
        s[_CHANGE + i] = 0
        i += 1


@micropython.viper
def _change(array, i: int):
    s = ptr32(array)
    # the error's change in its unit, Q28; what it does to attitude and loop, rad and g Q24
    d = s[_TOLD + i] * s[_NU]
    e = s[_E + i]
    dh = d >> 15
    dl = d & 0x7FFF
    at = _VIEW + i
    n = 7
    if i > 11:
        at = _OWN
        n = 3
    k = 0
    while k < n:
        t = s[at]
        h = t >> 15
        t = h * dh + ((h * dl >> 1) + (dh * (t & 0x7FFF) >> 1) >> 14)  # Q18
        if e < 13:
            j = 131072 << e
            if t > j:
                t = j
            elif t < 0 - j:
                t = 0 - j
        if e < 6:
            t <<= 6 - e
        else:
            t >>= e - 6
        j = _CHANGE + 2  # in the order of the view: tilt, velocity, position of x, of y, yaw
        if k == 0:
            j = _CHANGE
        elif k < 3:
            j = _VX + 2 * k - 2
        elif k == 3:
            j = _CHANGE + 1
        elif k < 6:
            j = _VX + 2 * k - 7
        if i == 13:
            j += 1
        if k % 3 and k < 6:
            t = 0 - t
        s[j] += t
        at += 12
        if i > 11:
            at -= 11
        elif k == 5:
            at += 3
        k += 1

    # and to the rates
    if i < 3:
        t = int(mul_q30(d, s[_INC_RAD]))
        if t > 268435456:
            t = 268435456
        elif t < -268435456:
            t = -268435456
        s[_BIAS + i] += t << 2 >> e
    elif i < 12:
        k = (i - 3) // 3
        n = (i - 3) % 3
        if e < 2:
            d <<= 2 - e
        else:
            d >>= e - 2
        j = 0
        while j < 3:
            at = _MATRIX + 3 * k + j
            t = s[at] - int(mul_q30(d, s[_MATRIX + 3 * n + j]))
            if j == n:
                t -= d
            if t > _MOST_MATRIX:
                t = _MOST_MATRIX
            elif t < -_MOST_MATRIX:
                t = -_MOST_MATRIX
            s[at] = t
            j += 1
        s[_BIAS + k] -= int(mul_q30(d, s[_BIAS + n]))
    if i < 12:
        _hold(array)


@micropython.viper
def _hold(array):
    """No bias beyond what the formats hold: 39 deg/s."""
    s = ptr32(array)
    most = (s[_INC_RAD] >> 1) + (s[_INC_RAD] >> 3) + (s[_INC_RAD] >> 4)
    i = 0
    while i < 3:
        if s[_BIAS + i] > most:
            s[_BIAS + i] = most
        elif s[_BIAS + i] < 0 - most:
            s[_BIAS + i] = 0 - most
        i += 1


@micropython.viper
def _turn(array):
    s = ptr32(array)
    i = 0
    while i < 3:
        t = s[_CHANGE + i]
        if t > 33554431:
            t = 33554431
        elif t < -33554431:
            t = -33554431
        s[_CHANGE + i] = t << 3
        i += 1
    turn(array, 268435456, s[_CHANGE + 1], 0 - s[_CHANGE], 0 - s[_CHANGE + 2])
    use(array)


@micropython.viper
def _units(array):
    s = ptr32(array)
    i = 0
    while i < 14:
        t = s[_COV + 15 * i]
        if t > 0 and t < 268435456 and s[_E + i] < 20:
            unit(array, i, s[_E + i] + 1)
            continue
        i += 1
    spread(array)
    s[_PHASE] = 0

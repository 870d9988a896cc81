# SPDX-License-Identifier: MIT
"""The integer Attitude's look at its level loop: attitude.GyroLearning, in steps that are spread
over the samples of three blocks. Places and formats: this folder's __init__.

    1       what passes for noise; the biases walk
    2       the view of one level axis' position, and one scale for both
    3-9     two rows of the covariance each: the errors' covariance with the position
    10-12   the position's sigma; what it tells of the noise; what was seen by the sigma
    17-28   one error each: what is changed, made good as if it had always been known
    29      turn
    33-39   two rows of the covariance each, a short and a long one, less what has been told
    40-43   a unit, what follows from them, and a row of the coefficients as exact as can be

13 to 16, 30 to 32 wait for the next block. In that scale views and noise together are below 2^15,
so a row's sum is below 2^21, a variance below 2^30. A part by its sigma is no more than the
square root of the error's own variance.
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
_KEEPS = const(69)
_LOOK = const(70)
_W = const(80)
_X = const(81)
_Y = const(82)
_Z = const(83)
_YAW_VIEW = const(277)
_YAW_NOISE = const(516)
_INC_RAD = const(59)
_BIAS = const(88)
_VX = const(94)
_PX = const(96)
_USED = const(124)
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
    while n and s[_PHASE] & 15:
        n -= 1
        _step(array)


@micropython.viper
def new_block(array):
    """The last block's steps are over, those of the next begin."""
    s = ptr32(array)
    while s[_PHASE] & 15:
        _step(array)
    if s[_PHASE]:
        s[_PHASE] += 1


@micropython.viper
def finish(array):
    """To the end, if errors have been changed; otherwise forget the look."""
    s = ptr32(array)
    if s[_PHASE] < 18:
        s[_PHASE] = 0
    while s[_PHASE]:
        _step(array)


@micropython.viper
def _step(array):
    s = ptr32(array)
    k = s[_PHASE]
    s[_PHASE] = k + 1
    if k > 32:
        if k < 40:
            _less(array, k - 33)
        elif k == 40:
            _units(array)
        elif k == 41:
            spread(array)
        elif k == 42:
            _forget(array)
        else:
            use(array, s[_LOOKS] % 3)
            s[_PHASE] = 0
    elif k > 16:
        if k < 29:
            _change(array, k - 17)
        else:
            if s[_OWN] > 1024 or s[_OWN] < -1024 or s[_OWN + 2] > 1024 or s[_OWN + 2] < -1024:
                _own(array)
            _turn(array)
            s[_PHASE] = 32
    elif k > 2:
        if k < 10:
            _told(array, 2 * k - 6)
        elif k == 10:
            _sum(array)
        elif k == 11:
            _unexplained(array)
        else:
            _share(array)
            s[_PHASE] = 16
    elif k == 1:
        _noise(array)
    else:
        _see(array)


@micropython.viper
def _told(array, i: int):
    """Two errors' covariance with the position."""
    s = ptr32(array)
    end = i + 2
    while i < end:
        t = 0
        at = _COV + 14 * i
        j = 0
        while j < i:
            t += (s[at] >> 15) * s[_SEEN_BY + j] >> 9
            at += 1
            j += 1
        while j < 14:
            t += (s[at] >> 15) * s[_SEEN_BY + j] >> 9
            at += 14
            j += 1
        s[_TOLD + i] = t
        i += 1


@micropython.viper
def _less(array, i: int):
    """The rows of errors i and 13 - i less what has been told of them."""
    s = ptr32(array)
    n = 2
    while n:
        n -= 1
        r = s[_TOLD + i]
        at = _COV + 14 * i
        j = 0
        while j <= i:
            t = (s[at] >> 1) - (r * s[_TOLD + j] >> 1)
            if t > 536870911:
                t = 536870911
            elif t < -536870911:
                t = -536870911
            s[at] = t << 1
            at += 1
            j += 1
        if r and s[at - 1] < 65536:
            s[at - 1] = 65536
        i = 13 - i


@micropython.viper
def _noise(array):
    """What passes for noise of the position: what no error has explained so far, accelerations."""
    s = ptr32(array)
    _walk(array)
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
    k = s[_NOISE] * 9
    if k < _LEAST:
        k = _LEAST
    t = int(isqrt(t * t + k)) << 11  # g Q26
    if t > 67108864:
        t = 67108864
    s[_SIGMA] = t


@micropython.viper
def _see(array):
    """Each error's unit in the position, g Q26, then in a scale that all fit."""
    s = ptr32(array)
    axis = s[_AXIS]
    at = _VIEW + 36 * axis + 24
    total = s[_SIGMA]
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
    while total > 32767:
        total >>= 1
        k += 1
    s[_SH] = k
    i = 0
    while i < 14:
        s[_SEEN_BY + i] >>= k
        i += 1
    s[_SIGMA] >>= k
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
    walk = s[_WALK]
    if s[_LOOKS] > 255:  # looks are rarer
        walk <<= 1
    i = 0
    while i < 3:
        e = s[_E + i]
        k = 2 * e - 14
        if k > 0:
            t = 268435456
            if k < 30 and walk < 268435456 >> k:
                t = walk << k
        else:
            t = walk >> 0 - k
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
    at = _COV + 14 * i
    j = 0
    while j < 14:
        t = s[at]
        if double:
            t >>= 1
            if j == i:
                t >>= 1
        else:
            if j == i:
                t <<= 1  # it was below a quarter
            if t > 536870911:
                t = 536870911
            elif t < -536870911:
                t = -536870911
            t <<= 1
        s[at] = t
        at += 1
        if j >= i:
            at += 13
        j += 1


@micropython.viper
def _sum(array):
    """The position's variance, and what of it the errors explain."""
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
    s[_SIGMA] = sigma
    y = s[_OFF]
    if y > 3 * sigma:
        y = 3 * sigma
    elif y < -3 * sigma:
        y = -3 * sigma
    s[_NU] = (y << 13) // sigma
    s[_OFF] = t  # for the next step


@micropython.viper
def _unexplained(array):
    """The variance that the errors explain, g^2 Q30, and the noise by what they do not."""
    s = ptr32(array)
    t = s[_OFF]
    k = 2 * s[_SH] - 22
    if k <= 0:
        t >>= 0 - k
    elif k > 27 or t >> 28 - k:
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
    t = s[_NOISE] + ((t >> 15) * 262 + ((t & 0x7FFF) * 262 + 16384 >> 15))
    if t > 33554432:
        t = 33554432
    s[_NOISE] = t
    if s[_LOOKS] < 32767:
        s[_LOOKS] += 1


@micropython.viper
def _share(array):
    """What each error is told, by the sigma."""
    s = ptr32(array)
    sigma = s[_SIGMA]
    i = 0
    while i < 14:
        t = (s[_TOLD + i] << 9) // sigma
        if t > 32767:
            t = 32767
        elif t < -32767:
            t = -32767
        if t * t > s[_COV + 15 * i]:  # by rounding only
            k = int(isqrt(s[_COV + 15 * i]))
            t = k if t >= 0 else 0 - k
        s[_TOLD + i] = t
        i += 1
    i = 0
    while i < 3:
        s[_CHANGE + i] = 0
        i += 1


@micropython.viper
def _change(array, i: int):
    """Error i: the rates to come, attitude and loop as if it had been known."""
    s = ptr32(array)
    # the change in the error's unit, Q28, as m 2^k with m of 15 bits
    d = s[_TOLD + i] * s[_NU]
    if d == 0:
        return
    m = d
    e = s[_E + i] + 9
    while m > 32767 or m < -32767:
        m >>= 1
        e -= 1
    # a view Q20 times m, >> 15, then >> e: rad or g Q24
    most = 1073741823
    k = 0
    if e < 0:
        k = 0 - e
        e = 0
        most = 16777216 >> k
    a = 0
    at = _VIEW + i
    while a < 3:
        if a == 2:
            at += 3  # of the yaw
        t = s[at]
        t = (t >> 15) * m + ((t & 0x7FFF) * m >> 15) >> e
        if t > most:
            t = most
        elif t < 0 - most:
            t = 0 - most
        s[_CHANGE + a] += t << k
        if a < 2:
            t = s[at + 12]
            t = (t >> 15) * m + ((t & 0x7FFF) * m >> 15) >> e
            if t > most:
                t = most
            elif t < 0 - most:
                t = 0 - most
            s[_VX + a] -= t << k
            t = s[at + 24]
            t = (t >> 15) * m + ((t & 0x7FFF) * m >> 15) >> e
            if t > most:
                t = most
            elif t < 0 - most:
                t = 0 - most
            s[_PX + a] -= t << k
        at += 36
        a += 1

    e = s[_E + i]
    if i < 3:
        t = int(mul_q30(d, s[_INC_RAD]))
        if t > 268435456:
            t = 268435456
        elif t < -268435456:
            t = -268435456
        s[_BIAS + i] += t << 2 >> e
    else:  # d (1 + what was learned), which matters little there
        k = (i - 3) // 3
        n = (i - 3) % 3
        if e < 2:
            d <<= 2 - e
        else:
            d >>= e - 2
        m = d >> 15
        e = d >> 12
        j = 0
        while j < 3:
            at = _MATRIX + 3 * k + j
            t = s[at] - m * (s[_MATRIX + 3 * n + j] >> 15)
            if j == n:
                t -= d
            if t > _MOST_MATRIX:
                t = _MOST_MATRIX
            elif t < -_MOST_MATRIX:
                t = -_MOST_MATRIX
            s[at] = t
            s[_USED + 3 * k + j] -= e * s[_USED + 3 * n + j] + 131072 >> 18
            j += 1
        s[_USED + 9 + k] -= e * (s[_USED + 9 + n] >> 18)
        s[_BIAS + k] -= m * (s[_BIAS + n] >> 15)
    # no bias beyond what the formats hold: 39 deg/s
    most = (s[_INC_RAD] >> 1) + (s[_INC_RAD] >> 3) + (s[_INC_RAD] >> 4)
    k = i
    if i > 2:
        k = (i - 3) // 3
    if s[_BIAS + k] > most:
        s[_BIAS + k] = most
    elif s[_BIAS + k] < 0 - most:
        s[_BIAS + k] = 0 - most


@micropython.viper
def _own(array):
    """The tilt that was unknown."""
    s = ptr32(array)
    a = 0
    while a < 2:
        d = s[_TOLD + 12 + a] * s[_NU]
        e = s[_E + 12 + a] + 9
        while d > 32767 or d < -32767:
            d >>= 1
            e -= 1
        k = 0
        while k < 3:
            t = s[_OWN + k]
            t = (t >> 15) * d + ((t & 0x7FFF) * d >> 15)
            if e >= 0:
                t >>= e
            else:
                j = 16777216 >> 0 - e
                if t > j:
                    t = j
                elif t < 0 - j:
                    t = 0 - j
                t <<= 0 - e
            if k == 0:
                s[_CHANGE + a] += t
            else:
                s[_VX + 2 * k - 2 + a] -= t
            k += 1
        a += 1


@micropython.viper
def _turn(array):
    s = ptr32(array)
    i = 0
    far = 0
    while i < 3:
        t = s[_CHANGE + i]
        if t > 524288 or t < -524288:  # 2 degrees
            far = 1
        if t > 33554431:
            t = 33554431
        elif t < -33554431:
            t = -33554431
        s[_CHANGE + i] = t
        i += 1
    if far:
        x = s[_CHANGE + 1] << 3
        turn(array, 268435456, x, 0 - (s[_CHANGE] << 3), 0 - (s[_CHANGE + 2] << 3))
    else:
        wh = s[_W] + 16384 >> 15
        ih = s[_X] + 16384 >> 15
        jh = s[_Y] + 16384 >> 15
        kh = s[_Z] + 16384 >> 15
        x = s[_CHANGE + 1] >> 1  # Q24, as half angles: Q9 too much for Q15 times Q15
        y = 0 - s[_CHANGE] >> 1
        z = 0 - s[_CHANGE + 2] >> 1
        i = x >> 9
        j = y >> 9
        k = z >> 9
        x &= 511
        y &= 511
        z &= 511
        s[_W] -= i * ih + j * jh + k * kh + (x * ih + y * jh + z * kh >> 9)
        s[_X] += i * wh + j * kh - k * jh + (x * wh + y * kh - z * jh >> 9)
        s[_Y] += j * wh + k * ih - i * kh + (y * wh + z * ih - x * kh >> 9)
        s[_Z] += k * wh + i * jh - j * ih + (z * wh + x * jh - y * ih >> 9)


@micropython.viper
def _units(array):
    """The next error whose unit is too large in one that suits it."""
    s = ptr32(array)
    n = 14
    i = s[_LOOKS] % 14
    while n:
        t = s[_COV + 15 * i]
        if t > 0 and t < 268435456 and s[_E + i] < 20:
            unit(array, i, s[_E + i] + 1)
            return
        i = 0 if i == 13 else i + 1
        n -= 1


@micropython.viper
def _forget(array):
    """What an old bias has done to the yaw, when its view forgets it."""
    s = ptr32(array)
    t = s[_YAW_NOISE]
    i = 0
    while i < 3:
        k = (s[_COV + 15 * i] >> 15) * 21845 + 357913941 >> 15  # its root, within 6 %
        k = (s[_YAW_VIEW + i] >> 10) * k >> s[_E + i] + 10
        if k > 8000 or k < -8000:
            k = 8000
        t += (k * k >> 12) * (32768 - s[_KEEPS]) * s[_LOOK]
        i += 1
    if t > 1073741823:
        t = 1073741823
    s[_YAW_NOISE] = t

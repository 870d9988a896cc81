# SPDX-License-Identifier: MIT
"""The integer Attitude's look at its level loop: attitude.GyroView and attitude.GyroLearning, a
piece each sample after a block. Places and formats: this folder's __init__.

Errors are numbered as there: 0 to 2 biases, 3 to 11 a matrix row by row, 12 and 13 the tilts
that are unknown, of which a look sees one. WORK says what is next:

    30, 31  see pace
    1-13    what the block adds: VIEW_N errors a sample, the unknown tilt of both axes at last
    14      the biases walk; what a sigma of each error shows of the position, SHARE, in a scale
            that all of them and the noise fit: Q(20 - SCALED), their sum below 2^14
    15      what is seen by its sigma (NU), and of each error (TOLD); what passes for noise
    16      the change of each error, Q28 in SHARE, and its sigma afterwards
    17-20   what the changes add up to in attitude and loop
    21      the biases and the matrix
    22      turn
    23-25   a row each of the coefficients

A view is clamped to 2^28; the filter behind it, with a step of a quarter at most, makes no more
than its double. A change is below 2^26, so that a product is below 2^27, a sum 2^31.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.errors import spread, use
from attitude.fixed.attitude.level import turn
from attitude.fixed.attitude.pace import gain, pace
from attitude.fixed.intmath import isqrt

_K_MOTION = const(50)
_INC_RAD = const(59)
_WALK = const(66)
_WALKS = const(67)
_KEEPS = const(69)
_VIEW_N = const(71)
_BIAS = const(81)
_SINCE = const(102)
_LEARNED = const(103)
_SIGMA = const(105)
_RELATED = const(119)
_MATRIX = const(127)
_NOISE = const(136)
_LOOKS = const(137)
_YAW_NOISE = const(138)
_YAW_VIEW = const(142)
_VX = const(173)
_PX = const(175)
_GAIN = const(212)
_LEVEL = const(216)
_WORK = const(222)
_AXIS = const(224)
_FLAGS = const(225)
_G = const(226)
_SPAN = const(60)
_TURN = const(227)
_ROWS = const(230)
_MID = const(245)
_VIEW = const(251)
_EXPLAINED = const(329)
_SHARE = const(331)
_TOLD = const(344)
_SCALED = const(357)
_QUIET = const(358)
_NU = const(359)
_CHANGE = const(360)
_MOST_MATRIX = const(64424509)  # 0.06, Q30
_LEAST_NOISE = const(4295)  # (2 mg)^2, Q30
_MOST_RELATED = const(32113)  # 0.98, Q15
_WALKED = const(937057)  # 0.05 deg/s in rad/s, Q30


@micropython.viper
def _follow(array):
    """1-13: how the errors show, as far as a tick goes."""
    s = ptr32(array)
    work = s[_WORK]
    n = s[_VIEW_N]
    flags = s[_FLAGS]
    g = s[_G]
    while n and work < 14:
        n -= 1
        i = work - 1
        work += 1
        r = i
        m = s[_SPAN]  # a bias turns by itself times the block's span
        k = 32768
        if i < 3:
            k = s[_KEEPS]
            # what an old bias has done to the yaw, when its view forgets it: rad Q20, at most Q15
            t = (s[_YAW_VIEW + i] >> 15) * (s[_SIGMA + i] >> 15)
            t = (t ^ t >> 31) >> 5
            if t >> 13:
                t = 8191
            t = s[_YAW_NOISE] + ((t * t >> 4) * (32768 - k) >> 12)
            if t >> 28:
                t = 268435455
            s[_YAW_NOISE] = t
        else:
            r = (i - 3) // 3
            m = s[_TURN + (i - 3) % 3]
            if i == 12:
                m = 0
        at = _YAW_VIEW + i
        t = s[at]
        t = (t >> 15) * k + ((t & 0x7FFF) * k >> 15) + ((s[_ROWS + 6 + r] >> 1) * m >> 9)
        if t >> 28 ^ t >> 31:
            t = t >> 31 ^ 268435455
        s[at] = t
        if flags & 8:
            continue
        k = 1
        at = _VIEW + i
        while k < 3:
            p = s[at + 26]
            t = s[at] + (s[_MID + r] * m >> 9)
            if flags & k == 0:
                t -= (p >> 15) * g + ((p & 0x7FFF) * g >> 15)
            if t >> 28 ^ t >> 31:
                t = t >> 31 ^ 268435455
            s[at] = t
            v = 0
            if flags & 4 == 0:
                v = s[at + 13]
            t -= p << 1
            v += (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
            s[at + 13] = v
            t = v - (p << 1)
            s[at + 26] = p + (t >> 15) * g + ((t & 0x7FFF) * g >> 15)
            k += 1
            at += 39
            r += 3
    if work == 14 and flags & 16 == 0:
        work = 0
    s[_WORK] = work


@micropython.viper
def _weigh(array):
    """14: what each error has in the position, and what no error has."""
    s = ptr32(array)
    axis = s[_AXIS]
    walk = s[_WALK]
    if s[_LOOKS] >> 8:  # looks are rarer
        walk <<= 1
    t = s[_SINCE]
    if t >> 17:
        t = 131071
    most = _WALKED + (t * s[_WALKS] >> 2)
    if s[_LEARNED] == 0:
        most = 1073741823
    sum = 0
    i = 0
    while i < 13:
        u = s[_SIGMA + i]
        if i < 3:
            k = u + (walk // ((u >> 8) + 1) << 7)
            if k < most:
                u = k
                s[_SIGMA + i] = u
        elif i == 12:
            u = s[_SIGMA + 12 + axis]
        t = s[_VIEW + 39 * axis + 26 + i]
        k = u >> 15
        t = (t >> 15) * k + ((t & 0x7FFF) * k + (t >> 15) * (u & 0x7FFF) >> 15)
        if t >> 25 ^ t >> 31:
            t = t >> 31 ^ 33554431
        s[_SHARE + i] = t
        sum += t ^ t >> 31
        i += 1

    # what no error has explained so far, and accelerations, g^2 Q30
    k = (s[_GAIN] << 8) // ((s[_K_MOTION] >> 2) + 1)  # the gain by its least, Q10
    if not k >> 10:
        k = 1024
    if k >> 15:
        k = 32767
    t = (s[_LEVEL] >> 5) * (655 + 104858 // (80 + s[_LOOKS])) >> 15
    if t >> 14:
        t = 16383
    t = t * k >> 10
    if t >> 14:
        t = 16383
    k = s[_NOISE] * 9
    if k < _LEAST_NOISE:
        k = _LEAST_NOISE
    t = t * t + k
    k = 0
    while sum >> k + 14 or t >> 2 * k + 19:
        k += 1
    s[_SCALED] = k
    s[_QUIET] = t >> 2 * k << 10
    i = 0
    while i < 13:
        s[_SHARE + i] >>= k
        i += 1


@micropython.viper
def _look(array):
    """15: what the position tells of each error."""
    s = ptr32(array)
    axis = s[_AXIS]
    # a share of a scale tells of the scales that are related to it
    i = 0
    while i < 13:
        s[_TOLD + i] = s[_SHARE + i]
        i += 1
    i = 3
    while i:
        i -= 1
        t = _SHARE + 3 + 4 * ((i + 1) % 3)
        u = _SHARE + 3 + 4 * ((i + 2) % 3)
        k = s[_RELATED + i]
        s[t + 13] += s[u] * k >> 15
        s[u + 13] += s[t] * k >> 15
    sum = 0
    i = 0
    while i < 13:
        sum += s[_TOLD + i] * s[_SHARE + i]
        i += 1
    sum &= -1 ^ sum >> 31
    root = int(isqrt(sum + s[_QUIET])) + 1
    p = s[_PX + axis]
    k = s[_SCALED]
    t = p >> k + 4
    if (t ^ t >> 31) > 3 * root:
        t = 3 * root ^ t >> 31
    s[_NU] = (t << 13) // root
    i = 0
    while i < 13:
        t = (s[_TOLD + i] << 15) // root
        if t >> 15 ^ t >> 31:
            t = t >> 31 ^ 32767
        s[_TOLD + i] = t
        i += 1
    i = 3
    while i:
        i -= 1
        t = s[_TOLD + 3 + 4 * ((i + 1) % 3)]
        s[_RELATED + i] -= s[_TOLD + 3 + 4 * ((i + 2) % 3)] * t >> 15
    # the variance that the errors explain, g^2 Q30, and the noise by what they do not
    sum >>= 10
    while k:
        k -= 1
        sum <<= 2
        if sum >> 28:
            sum = 268435455
            k = 0
    s[_EXPLAINED + axis] = sum
    p = (p ^ p >> 31) >> 9
    if p >> 14:
        p = 16383
    t = p * p - sum
    t &= -1 ^ t >> 31
    p = s[_NOISE]
    t -= p
    t = p + ((t >> 15) * 262 + ((t & 0x7FFF) * 262 + 16384 >> 15))
    if t >> 25:
        t = 33554431
    s[_NOISE] = t
    t = s[_LOOKS] + 1
    s[_LOOKS] = t - (t >> 15)


@micropython.viper
def _settle(array):
    """16: the change of each error, and how well it is known now."""
    s = ptr32(array)
    axis = s[_AXIS]
    i = 0
    while i < 13:
        v = s[_TOLD + i]
        k = _SIGMA + i
        if i == 12:
            k += axis
        u = s[k]
        t = (u >> 15) * v + ((u & 0x7FFF) * v >> 15)
        t = (t >> 15) * s[_NU] + ((t & 0x7FFF) * s[_NU] >> 15)
        if t >> 26 ^ t >> 31:
            t = t >> 31 ^ 67108863
        s[_SHARE + i] = t
        # what is left of a sigma, Q15: a root to the third order
        v = v * v + 32768 >> 16
        v = 32768 - (v * (16384 + (v * (4096 + (v >> 4)) >> 15)) + 16384 >> 15)
        t = (u >> 15) * v + ((u & 0x7FFF) * v >> 15)
        if u >> 16 and not t >> 16:
            t = 65536
        s[k] = t
        # a scale that is known better is less related to the two others
        k = _RELATED
        while i & 3 == 3 and k < _RELATED + 3:
            if k != _RELATED + (i >> 2):
                t = (s[k] << 15) // v
                if (t ^ t >> 31) > _MOST_RELATED:
                    t = t >> 31 ^ _MOST_RELATED
                s[k] = t
            k += 1
        i += 1


@micropython.viper
def _make_good(array):
    """17-20: attitude, velocity and position as if that had always been known."""
    s = ptr32(array)
    work = s[_WORK] - 1
    axis = s[_AXIS]
    r = work - 17 << 1
    end = r + 2
    if work == 20:
        end = 7
    while r < end:
        at = _VIEW + 13 * r
        if r == 6:
            at = _YAW_VIEW
        t = 0
        v = 0
        i = 0
        while i < 13:
            u = s[_SHARE + i]
            p = s[at]
            if i == 12 and r // 3 != axis:  # the other axis' tilt
                u = 0
            k = u >> 13
            t += (p >> 15) * k
            v += ((p & 0x7FFF) * k >> 4) + ((p >> 15) * (u & 0x1FFF) >> 2)
            at += 1
            i += 1
        if t >> 21 ^ t >> 31:  # 2 rad, Q20
            t = t >> 31 ^ 2097151
        t = (t << 4) + (v >> 7)
        k = r % 3
        i = _VX - 2 + 2 * k + r // 3
        if not k:
            i = _CHANGE + r // 3
            s[i] = 0
        s[i] -= t
        r += 1


@micropython.viper
def _correct(array):
    """21: the gyro calibrated by that."""
    s = ptr32(array)
    i = 0
    while i < 12:
        t = s[_SHARE + i]
        if i < 3:
            k = i
            u = s[_INC_RAD] >> 15
            v = s[_BIAS + i] + (t >> 13) * u + ((t & 0x1FFF) * u >> 13)
        else:
            k = (i - 3) // 3
            v = s[_BIAS + (i - 3) % 3]  # of a rate that is true
            v = s[_BIAS + k] - ((t >> 13) * (v >> 15) + ((t >> 13) * (v & 0x7FFF) >> 15))
            t = s[_MATRIX + i - 3] - (t << 2)
            if (t ^ t >> 31) > _MOST_MATRIX:
                t = t >> 31 ^ _MOST_MATRIX
            s[_MATRIX + i - 3] = t
        # no bias beyond what the formats hold: 39 deg/s
        t = (s[_INC_RAD] >> 1) + (s[_INC_RAD] >> 3) + (s[_INC_RAD] >> 4)
        if (v ^ v >> 31) > t:
            v = t ^ v >> 31
        s[_BIAS + k] = v
        i += 1


@micropython.viper
def work(array):
    """The next piece of this block's work."""
    s = ptr32(array)
    work = s[_WORK]
    if work == 30:
        gain(array)
    elif work > 30:
        pace(array)
    elif work < 14:
        _follow(array)
    else:
        s[_WORK] = work + 1
        if work == 14:
            _weigh(array)
        elif work == 15:
            _look(array)
        elif work == 16:
            _settle(array)
        elif work < 21:
            _make_good(array)
        elif work == 21:
            _correct(array)
        elif work == 22:
            t = 0 - s[_CHANGE + 1] << 3
            turn(array, 268435456, t, s[_CHANGE] << 3, s[_CHANGE + 2] << 3)
        else:
            use(array, work - 23)
            if work == 25:
                spread(array)
                s[_WORK] = 0

# SPDX-License-Identifier: MIT
"""How fast the integer Attitude's level loop goes, how far, and whether to look: the rest of
attitude.Slow, with attitude.Bounds. Once per block, the two samples after slow.

Bits of EVENT: 1 rest begins, 2 rest ends, 4 the attitude was lost, 8 the tilt is unknown, 32 the
block turned too far, 64 the mean has levelled, 128 a gap may hide a turn (HIDDEN), 256 the first
rest was a slow tilt.

Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.errors import spread
from attitude.fixed.intmath import hypot, isqrt

_N = const(33)
_YOUNG = const(47)
_RAMP = const(49)
_K_MOTION = const(50)
_K_REST = const(51)
_RATE_K = const(56)
_PER_SPAN2 = const(57)
_SPAN = const(60)
_FASTER = const(61)
_MOST = const(62)
_MOST_SIGMAS = const(63)
_TOP = const(64)
_TOP_K = const(65)
_SHAKE_K = const(68)
_LOOK = const(70)
_VX = const(173)
_PX = const(175)
_K = const(177)
_K_SHIFT = const(178)
_K_HALF = const(179)
_MOST_G = const(180)
_OVER = const(183)
_STUCK = const(184)
_AT_REST = const(164)
_UNCERTAIN = const(165)
_NOW = const(205)
_AGE = const(208)
_GAIN = const(212)
_SQUARES = const(213)
_LEVEL = const(216)
_SEEN = const(217)
_PUSHED = const(218)
_SHAKE = const(220)
_EVENT = const(221)
_WORK = const(222)
_WAIT = const(223)
_AXIS = const(224)
_FLAGS = const(225)
_G = const(226)
_TURN = const(227)
_ROWS = const(230)
_LAST_ROWS = const(239)
_MID = const(245)
_VIEW = const(251)
_SIGMA = const(105)
_SPREAD = const(122)
_TILT = const(126)
_LOOKS = const(137)
_YAW_NOISE = const(138)
_EXPLAINED = const(329)
_REST_SIGMA = const(187402)  # 0.01 deg/s: how well a rest tells the bias; Q30
_SLOW_SIGMA = const(18740330)  # 1 deg/s: when a slow tilt has passed for rest
_REST_TILT = const(3748040)  # 0.2 degrees: how well it has seen the tilt that it leaves
_HIDDEN = const(363)
_UNTAUGHT = const(-50)  # blocks: until the loop has taken off what a gap has hidden
_UNSEEN = const(8176870)  # rad^2 Q26: 20 degrees, what a block beyond the gyro's range may hide
_START_TILT = const(281120000)  # 15 degrees: how well a mean levels
_CLAIMED = const(647600)  # rad^2 Q30, twice a level axis' variance less the least: 1 degree
_DOUBTED = const(5881000)  # 3 degrees


@micropython.viper
def gain(array):
    """30: the gain of the next block, and what has happened in this one."""
    s = ptr32(array)
    event = s[_EVENT]
    s[_EVENT] = 0
    if s[_OVER]:  # the gyro has lost a part of a turn: as unsure as just after the start
        s[_OVER] = 0
        event |= 24
        t = s[_YAW_NOISE] + _UNSEEN
        if t >> 28:
            t = 268435455
        s[_YAW_NOISE] = t
        if s[_AGE] > 2 * s[_YOUNG]:
            s[_AGE] = 2 * s[_YOUNG] + 1
    if event & 257:
        i = _SIGMA
        while i < _SIGMA + 3:
            s[i] = _REST_SIGMA
            if event & 256:
                s[i] = _SLOW_SIGMA
            i += 1
        s[_SIGMA + 12] = 0
        s[_SIGMA + 13] = 0
        spread(array)

    # by how much a level rate may be wrong, rad/s Q14; below 1
    error = s[_SPREAD]
    i = 0
    while i < 3:
        t = s[_SQUARES + i]
        m = s[_SPREAD + 1 + i]
        if m >> 20:
            m = 1048575
        k = t >> 18
        if k >> 9:
            k = 511
        error += k * m + ((m >> 2) * ((t & 0x3FFFF) >> 8) >> 8)
        if error >> 28:
            error = 268435455
        i += 1
    error = int(isqrt(error // 3 << 1))
    s[_G] = error  # for the next sample

    # level acceleration of late
    t = s[_LEVEL]
    if event & 32 == 0:
        x = s[_NOW]
        x ^= x >> 31
        y = s[_NOW + 1]
        y ^= y >> 31
        if x >> 15:
            x = 32767
        if y >> 15:
            y = 32767
        t = (int(hypot(x, y)) << 8) - t
        k = s[_RATE_K]
        n = s[_SEEN] + 1
        if n * k < 32768:
            s[_SEEN] = n
            if n:
                t //= n
        else:
            t = (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
        t += s[_LEVEL]
        s[_LEVEL] = t

    # the gain times dt, Q24: none at first, then high, then by what the gyro may err beside
    # what accelerations do
    last = s[_GAIN]
    gain = 0
    if s[_AGE] >= s[_YOUNG]:
        k = error * s[_FASTER] // (197 + ((t >> 10) * 3932 >> 10))  # Q10
        if k >> 14:
            k = 16384
        f = 1024
        if k >> 10:
            f = int(isqrt(k << 10))
        k = s[_K_MOTION]
        gain = (k >> 10) * f + ((k & 1023) * f >> 10)
        if gain >> 22:
            gain = 4194303
        k = s[_RAMP] // s[_AGE]
        if gain < k:
            gain = k
        if s[_AT_REST] and gain < s[_K_REST]:
            gain = s[_K_REST]
    s[_GAIN] = gain
    m = gain
    k = 9
    while m >> 15:
        m >>= 1
        k -= 1
    s[_K] = m
    s[_K_SHIFT] = k
    s[_K_HALF] = 1 << k >> 1

    # at rest there is no velocity; one that ends the rest goes on, in the new gain's scale
    if event & 7:
        k = 0
        if event & 2 and last > 127 and event & 4 == 0:
            k = (gain << 8) // (last >> 7)
            if k >> 16:
                k = 65535
        i = 0
        while i < 4:
            if i == 2:
                k = k * (k >> 1) >> 14
            m = s[_VX + i]
            s[_VX + i] = (m >> 15) * k + ((m & 0x7FFF) * k >> 15)
            i += 1
    if event & 55:  # what has shown so far belongs to what is over
        i = _VIEW
        while i < _EXPLAINED:
            s[i] = 0
            i += 1
    if event & 202 and s[_AT_REST] == 0:  # a tilt is unknown from now on
        m = _REST_TILT
        if event & 8:
            m = _START_TILT
        elif event & 128:
            m = s[_HIDDEN] << 15
            if m < s[_SIGMA + 12]:
                m = s[_SIGMA + 12]
            if m < s[_SIGMA + 13]:
                m = s[_SIGMA + 13]
            s[_WAIT] = _UNTAUGHT
        elif event & 64:  # what accelerated while the mean levelled, and turned unseen
            t >>= 5
            if t >> 14:
                t = 16383
            m = int(isqrt(t * t + (s[_SPREAD] >> 2) * 3)) << 15
            if m > _START_TILT:
                m = _START_TILT
        s[_SIGMA + 12] = m
        s[_SIGMA + 13] = m
        s[_TILT] = (m >> 15) * 46341 >> 15
        t = 1048576
        i = _VIEW + 12
        while i < _EXPLAINED:
            s[i] = t
            t = 0
            i += 13
            if i == _VIEW + 51:
                t = 1048576
    s[_FLAGS] = 0 if gain and event & 32 == 0 else 8
    s[_WORK] = 31


@micropython.viper
def pace(array):
    """31: how far the correction goes, what to claim, and whether to look."""
    s = ptr32(array)
    # how far: what the gyro does not explain is an acceleration, unless it makes too much speed
    flags = s[_FLAGS]
    x = s[_PX]
    x ^= x >> 31
    y = s[_PX + 1]
    y ^= y >> 31
    t = s[_MOST_G]
    if x > t:
        flags |= 1
    if y > t:
        flags |= 2
    if s[_STUCK]:
        s[_STUCK] = 0
        flags |= 4
    gain = s[_GAIN]
    error = s[_G]
    n = gain * s[_N] >> 9
    if n >> 13:
        n = 8191
    s[_G] = n
    m = 1073741823
    if gain and s[_AT_REST] == 0:
        t = s[_MOST] + (error * s[_MOST_SIGMAS] << 2)  # rad/s Q24
        if t >> 29:
            t = 536870911
        k = 4
        if t >> 23:
            k = 10
        t = (t >> k) * s[_SPAN] // (n | 1)
        if not t >> 19:
            i = s[_VIEW + 51]  # the larger one
            m = s[_VIEW + 12]
            i ^= i >> 31
            m ^= m >> 31
            if m < i:
                m = i
            m = (t << k) + 3 * ((m >> 5) * s[_TILT] >> 6)
        t = 0
        i = 0
        while i < 2:
            k = s[_PUSHED + i]
            if x > m or y > m:
                k += s[_NOW + i] >> 4
            else:
                k -= k * s[_TOP_K] + 16384 >> 15
            s[_PUSHED + i] = k
            k ^= k >> 31
            k >>= 2
            if k >> 14:
                k = 16383
            t += k * k
            i += 1
        if t > s[_TOP]:
            s[_PUSHED] = 0
            s[_PUSHED + 1] = 0
            s[_EVENT] |= 8
    s[_MOST_G] = m

    # what to claim
    x >>= 9
    y >>= 9
    if x >> 14:
        x = 16383
    if y >> 14:
        y = 16383
    k = s[_SHAKE_K]
    t = x * x + y * y - s[_SHAKE]
    t = s[_SHAKE] + (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
    s[_SHAKE] = t
    if s[_AT_REST]:
        s[_EXPLAINED] = 0
        s[_EXPLAINED + 1] = 0
    k = s[_EXPLAINED] + s[_EXPLAINED + 1]
    if k >> 27:
        k = 134217727
    t = (t >> 6) * 31
    if s[_AGE] < 3 * s[_YOUNG]:
        s[_UNCERTAIN] = 1
    elif t > _DOUBTED:
        s[_UNCERTAIN] = 2
    elif t + (k << 2) > _DOUBTED:
        s[_UNCERTAIN] = 1
    elif t + (k << 2) < _CLAIMED:
        s[_UNCERTAIN] = 0

    # mean squares of the rates, for the next block; the mean rows of the rotation matrix
    k = s[_RATE_K]
    i = 0
    while i < 3:
        t = s[_TURN + i]
        t = (t ^ t >> 31) >> 1
        t = (t * t >> 8) * s[_PER_SPAN2] >> 2
        m = s[_SQUARES + i]
        t -= m
        s[_SQUARES + i] = m + (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
        m = s[_ROWS + i]
        s[_MID + 3 + i] = 0 - (m + s[_LAST_ROWS + i] >> 2)
        s[_LAST_ROWS + i] = m
        m = s[_ROWS + 3 + i]
        s[_MID + i] = m + s[_LAST_ROWS + 3 + i] >> 2
        s[_LAST_ROWS + 3 + i] = m
        i += 1
    if s[_AT_REST]:
        s[_WORK] = 0
        return
    s[_WORK] = 1
    if s[_WAIT] < 0:
        flags |= 8
        s[_WAIT] += 1
    elif flags & 8 == 0:
        s[_WAIT] += 1
    k = s[_LOOK]
    if s[_LOOKS] >> 8:  # later looks are rarer
        k <<= 1
    if s[_WAIT] >= k:
        s[_WAIT] = 0
        k = 1 - s[_AXIS]
        s[_AXIS] = k
        if s[_NOW + 2] > 1228 and flags & 1 << k == 0:  # not in free fall, not pushed
            flags |= 16
    s[_FLAGS] = flags

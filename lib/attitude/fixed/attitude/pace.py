# SPDX-License-Identifier: MIT
"""How fast the integer Attitude's level loop goes, how far, and what it learns next: the rest of
attitude.Slow, with attitude.Bounds. Once per block, a sample after slow.

Bits of EVENT: 1 rest begins, 2 rest ends, 4 the attitude was lost, 8 the tilt is unknown, 16 the
gyro was over its range, 32 the block turned too far, 64 the mean has levelled.

Places and formats: this folder's __init__.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.errors import spread, unknown
from attitude.fixed.attitude.learn import finish, new_block
from attitude.fixed.attitude.view import clear
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
_W = const(80)
_X = const(81)
_Y = const(82)
_Z = const(83)
_VX = const(94)
_VY = const(95)
_PX = const(96)
_PY = const(97)
_K = const(98)
_K_SHIFT = const(99)
_K_HALF = const(100)
_MOST_G = const(101)
_OVER = const(104)
_STUCK = const(105)
_AT_REST = const(122)
_UNCERTAIN = const(123)
_NOW = const(156)
_AGE = const(159)
_GAIN = const(166)
_SQUARES = const(167)
_LEVEL = const(170)
_SEEN = const(171)
_PUSHED = const(172)
_SHAKE = const(174)
_EVENT = const(175)
_WORK = const(176)
_PHASE = const(177)
_WAIT = const(178)
_AXIS = const(179)
_FLAGS = const(180)
_G = const(181)
_TURN = const(182)
_LOOKS = const(513)
_TILT = const(552)
_ROWS = const(186)
_LAST_ROWS = const(195)
_FRESH_ROWS = const(201)
_OWN = const(274)
_SPREAD = const(499)
_EXPLAINED = const(514)
_REST_E = const(12)  # 0.01 deg/s: how well a rest tells the bias; see E, COV
_REST_COV = const(548742303)
_REST_TILT_E = const(8)  # 0.2 degrees: how well it has seen the tilt that it leaves
_REST_TILT_COV = const(857420981)
_START_TILT_E = const(1)  # 15 degrees: how well a mean levels
_START_TILT_COV = const(294367987)
_CLAIMED = const(647600)  # rad^2 Q30, twice a level axis' variance less the least: 1 degree
_DOUBTED = const(5881000)  # 3 degrees


@micropython.viper
def pace(array):
    """The gain of the next block, and what has happened in this one."""
    s = ptr32(array)
    if s[_PHASE]:
        new_block(array)
    event = s[_EVENT]
    s[_EVENT] = 0
    rest = s[_AT_REST]
    if s[_OVER]:  # the gyro has lost a part of a turn: as unsure as just after the start
        s[_OVER] = 0
        event |= 24
        if s[_AGE] > s[_YOUNG]:
            s[_AGE] = s[_YOUNG] + 1
    if event & 79:
        finish(array)
    if event & 1:
        i = 0
        while i < 3:
            unknown(array, i, _REST_E, _REST_COV)
            i += 1
        unknown(array, 12, 0, 0)
        unknown(array, 13, 0, 0)
        spread(array)
    error = int(_error(array))
    last = s[_GAIN]
    gain = int(_gain(array, error, event & 32))

    # at rest there is no velocity; one that ends the rest goes on, in the scale of the new gain
    k = -1
    if event & 1:
        k = 0
    elif event & 2:
        k = (gain << 8) // (last >> 7) if last > 127 else 0
        if k > 65535:
            k = 65535
    if event & 4:
        k = 0
    if k >= 0:
        i = s[_VX]
        j = s[_VY]
        s[_VX] = (i >> 15) * k + ((i & 0x7FFF) * k >> 15)
        s[_VY] = (j >> 15) * k + ((j & 0x7FFF) * k >> 15)
        k = k * (k >> 1) >> 14
        i = s[_PX]
        j = s[_PY]
        s[_PX] = (i >> 15) * k + ((i & 0x7FFF) * k >> 15)
        s[_PY] = (j >> 15) * k + ((j & 0x7FFF) * k >> 15)
    if event & 55:
        clear(array)
    if event & 74 and rest == 0:  # a tilt is unknown from now on
        e = _REST_TILT_E
        t = _REST_TILT_COV
        if event & 8:
            e = _START_TILT_E
            t = _START_TILT_COV
        elif event & 64:  # what accelerated while the mean levelled, and turned unseen
            t = s[_LEVEL] >> 5
            if t > 8579:  # 15 degrees, Q15
                t = 8579
            t = int(isqrt(t * t + (s[_SPREAD] >> 2) * 3))
            if t > 8579:
                t = 8579
            elif t < 1:
                t = 1
            e = 0
            while t < 16384:
                t <<= 1
                e += 1
            t *= t
        s[_OWN] = 1048576
        s[_OWN + 1] = 0
        s[_OWN + 2] = 0
        i = 12
        while i < 14:
            unknown(array, i, e, t)
            i += 1
        spread(array)

    flags = 0
    if gain == 0 or event & 32:
        flags = 8
    s[_FLAGS] = flags
    s[_G] = error  # for limit
    s[_WORK] = 16


@micropython.viper
def limit(array):
    """How far the correction goes, what to claim, and whether to look. The sample after."""
    s = ptr32(array)
    x = s[_PX] if s[_PX] >= 0 else 0 - s[_PX]
    y = s[_PY] if s[_PY] >= 0 else 0 - s[_PY]
    flags = s[_FLAGS]
    if s[_STUCK]:
        s[_STUCK] = 0
        flags |= 4
    if x > s[_MOST_G]:
        flags |= 1
    if y > s[_MOST_G]:
        flags |= 2
    s[_FLAGS] = flags
    error = s[_G]
    t = s[_GAIN] * s[_N] >> 9
    if t > 8192:
        t = 8192
    s[_G] = t
    _limit(array, error, x, y)
    _bounds(array, x, y)
    _square(array)
    if s[_AT_REST]:
        s[_WORK] = 0
        return
    s[_WORK] = 17
    if flags & 8 == 0:
        s[_WAIT] += 1
    k = s[_LOOK]
    if s[_LOOKS] > 255:  # later looks are rarer
        k <<= 1
    if s[_WAIT] >= k and s[_PHASE] == 0:
        s[_WAIT] = 0
        i = 1 - s[_AXIS]
        s[_AXIS] = i
        if s[_NOW + 2] > 1228 and flags & 1 << i == 0:  # not in free fall, not pushed
            s[_PHASE] = 1


@micropython.viper
def _error(array) -> int:
    """By how much a level rate may be wrong, rad/s Q14; below 1."""
    s = ptr32(array)
    sum = s[_SPREAD]
    i = 0
    while i < 3:
        t = s[_SQUARES + i]
        m = s[_SPREAD + 1 + i]
        if m > 1048576:
            m = 1048576
        h = t >> 18
        if h > 511:
            h = 511
        sum += h * m + ((m >> 2) * ((t & 0x3FFFF) >> 8) >> 8)
        if sum > 402653184:
            sum = 402653184
        i += 1
    return int(isqrt(sum // 3 << 1)) if sum < 402653184 else 16383


@micropython.viper
def _square(array):
    """The mean squares of the rates, for the next block."""
    s = ptr32(array)
    k = s[_RATE_K]
    i = 0
    while i < 3:
        t = s[_TURN + i]
        t = t if t >= 0 else 0 - t
        if t < 4096:
            t = (t * t >> 4) * s[_PER_SPAN2] >> 8
        else:
            if t > 46340:
                t = 46340
            t >>= 1
            t = (t * t >> 12) * s[_PER_SPAN2] << 2
        m = s[_SQUARES + i]
        t -= m
        s[_SQUARES + i] = m + (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
        i += 1
    s[_TURN + 3] = s[_SPAN]


@micropython.viper
def _gain(array, error: int, wild: int) -> int:
    """The gain times dt, Q24: none at first, then high, then by what the gyro may err beside what
    accelerations do."""
    s = ptr32(array)
    t = s[_LEVEL]
    if wild == 0:
        x = s[_NOW] if s[_NOW] >= 0 else 0 - s[_NOW]
        y = s[_NOW + 1] if s[_NOW + 1] >= 0 else 0 - s[_NOW + 1]
        if x > 65000:
            x = 65000
        if y > 65000:
            y = 65000
        t = (int(hypot(x, y)) << 8) - t
        k = s[_RATE_K]
        n = s[_SEEN] + 1
        if n * k < 32768:
            s[_SEEN] = n
            t = t // n if n else t
        else:
            t = (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
        t += s[_LEVEL]
        s[_LEVEL] = t
    gain = 0
    if s[_AGE] >= s[_YOUNG]:
        k = error * s[_FASTER] // (197 + ((t >> 10) * 3932 >> 10))  # Q10
        f = 1024
        if k > 16384:
            f = 4096
        elif k > 1024:
            f = int(isqrt(k << 10))
        t = s[_K_MOTION]
        gain = (t >> 10) * f + ((t & 1023) * f >> 10)
        if gain > 4194303:
            gain = 4194303
        t = s[_RAMP] // s[_AGE]
        if gain < t:
            gain = t
        if s[_AT_REST] and gain < s[_K_REST]:
            gain = s[_K_REST]
    s[_GAIN] = gain
    t = gain
    k = 9
    while t >= 32768:
        t >>= 1
        k -= 1
    s[_K] = t
    s[_K_SHIFT] = k
    s[_K_HALF] = 1 << k >> 1
    return gain


@micropython.viper
def _limit(array, error: int, x: int, y: int):
    """What the gyro does not explain is an acceleration, unless it makes too much speed."""
    s = ptr32(array)
    s[_MOST_G] = 1073741823
    if s[_AT_REST] or s[_GAIN] == 0:
        return
    t = error * s[_MOST_SIGMAS]
    if t > 134217727:
        t = 134217727
    t = s[_MOST] + (t << 2)  # rad/s Q24
    if t > 536870911:
        t = 536870911
    g = s[_G]
    if g < 1:
        g = 1
    k = 4
    if t > 8388607:
        k = 10
    t = (t >> k) * s[_SPAN] // g
    i = 1073741823
    if t < 524288:
        t <<= k
        i = s[_OWN] if s[_OWN] >= 0 else 0 - s[_OWN]
        i = t + 3 * ((i >> 5) * s[_TILT] >> 6)
    s[_MOST_G] = i

    a = s[_PUSHED]
    b = s[_PUSHED + 1]
    if x > i or y > i:
        a += s[_NOW] >> 4
        b += s[_NOW + 1] >> 4
        i = a if a >= 0 else 0 - a
        j = b if b >= 0 else 0 - b
        if i > 65000 or j > 65000 or int(hypot(i, j)) > s[_TOP]:
            a = 0
            b = 0
            s[_EVENT] |= 8
    else:
        k = s[_TOP_K]
        a -= a * k + 16384 >> 15
        b -= b * k + 16384 >> 15
    s[_PUSHED] = a
    s[_PUSHED + 1] = b


@micropython.viper
def _bounds(array, x: int, y: int):
    """Whether to claim the tilt."""
    s = ptr32(array)
    x >>= 9
    y >>= 9
    if x > 23000:
        x = 23000
    if y > 23000:
        y = 23000
    k = s[_SHAKE_K]
    t = x * x + y * y - s[_SHAKE]
    t = s[_SHAKE] + (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
    s[_SHAKE] = t
    if s[_AT_REST]:
        s[_EXPLAINED] = 0
        s[_EXPLAINED + 1] = 0
    k = s[_EXPLAINED] + s[_EXPLAINED + 1]
    if k > 134217728:
        k = 134217728
    t = (k << 2) + (t >> 6) * 31
    if s[_AGE] < 2 * s[_YOUNG] or t > _DOUBTED:
        s[_UNCERTAIN] = 1
    elif t < _CLAIMED:
        s[_UNCERTAIN] = 0


@micropython.viper
def prepare(array):
    """Hand the view what it follows: rows of the rotation matrix. The sample after."""
    s = ptr32(array)
    s[_WORK] = 1
    w = s[_W] + 16384 >> 15
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    i = 0
    while i < 9:
        if i == 0:  # Q15
            t = x * y + w * z >> 14
        elif i == 1:
            t = w * w - x * x + y * y - z * z >> 15
        elif i == 2:
            t = y * z - w * x >> 14
        elif i == 3:
            t = 0 - (w * w + x * x - y * y - z * z) >> 15
        elif i == 4:
            t = w * z - x * y >> 14
        elif i == 5:
            t = 0 - (x * z + w * y) >> 14
        elif i == 6:
            t = x * z - w * y >> 14
        elif i == 7:
            t = y * z + w * x >> 14
        else:
            t = w * w - x * x - y * y + z * z >> 15
        if i > 5:
            s[_ROWS + i] = t >> 1
        elif s[_GAIN]:
            if s[_FRESH_ROWS]:
                s[_LAST_ROWS + i] = t
            s[_ROWS + i] = t + s[_LAST_ROWS + i] >> 2
            s[_LAST_ROWS + i] = t
        i += 1
    if s[_GAIN]:
        s[_FRESH_ROWS] = 0

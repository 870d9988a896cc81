# SPDX-License-Identifier: MIT
"""What the integer Attitude does once per block of samples, a dozen times a second.

Rest, the gyro's bias there, and whether the attitude is lost: attitude.Rest and attitude.Up in
integers. Pace follows one sample later. Places and formats: this folder's __init__. A block's
sums are not divided, so that the bias keeps a resolution of 1e-5 deg/s. One function, since calls
cost room.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.learn import work
from attitude.fixed.attitude.level import level, turn, zero_yaw

_ONE = const(32)
_N = const(33)
_MEAN_K = const(34)
_STILL_GYRO = const(35)
_STILL_ACCEL = const(36)
_SHAKEN = const(37)
_TILTED = const(38)
_NEAR = const(39)
_DRIFT = const(40)
_LIMIT = const(41)
_START_LIMIT = const(42)
_STEADY_MAX = const(43)
_REST = const(44)
_RESTED_MAX = const(45)
_KEEP = const(46)
_YOUNG = const(47)
_OLD = const(48)
_HALF_G = const(52)
_LOST = const(53)
_MG = const(54)
_MG_SHIFT = const(55)
_SUM_RAD = const(58)
_INC_RAD = const(59)
_W = const(76)
_X = const(77)
_Y = const(78)
_Z = const(79)
_BIAS = const(81)
_LEFT = const(181)
_COUNT = const(182)
_BEGIN = const(80)
_SUM = const(185)
_FORCE = const(161)
_AT_REST = const(164)
_MEAN = const(191)
_FIRST = const(197)
_BEFORE = const(96)
_NEXT = const(99)
_KEPT = const(200)
_UP = const(201)
_UP_SAMPLES = const(204)
_NOW = const(205)
_AGE = const(208)
_STILL = const(209)
_STEADY = const(210)
_RESTED = const(211)
_SINCE = const(102)
_LEARNED = const(103)
_MOVED = const(104)
_EVENT = const(221)
_YAW_VIEW = const(142)
_YAW_BLOCKS = const(139)
_HELD = const(140)
_WORK = const(222)
_TURN = const(227)
_SEEN = const(217)
_SIGMA = const(105)
_ROWS = const(230)
_WILD = const(42598)  # 1.3 rad, Q15


@micropython.viper
def slow(array):
    """Take the block's sums, start the next block."""
    s = ptr32(array)
    while s[_WORK]:  # a short block
        work(array)

    # as if it had had n samples, whatever the period; one at the beginning
    n = s[_N]
    begin = s[_BEGIN]
    new = 1 if begin and begin < 3 else 0
    k = 1 if new else n
    samples = s[_COUNT]
    if samples != k:
        i = _SUM
        while i < _SUM + 6:
            t = s[i]
            s[i] = t // samples * k + t % samples * k // samples
            i += 1
    samples = k
    t = s[_YAW_BLOCKS] + 1
    s[_YAW_BLOCKS] = t - (t >> 30)

    # steady: all near their half-second means, these where they were
    k = 32768 if new else s[_MEAN_K]
    d = n if new else 1
    steady = 1
    tilts = 0
    tilted = s[_TILTED]
    if s[_LEARNED] < 2:  # nothing tells a slow tilt from the bias yet
        tilted //= 3
    bound = s[_STILL_GYRO]
    i = 0
    while i < 6:
        if i == 3:
            bound = s[_STILL_ACCEL]
            d <<= 6
        t = s[_SUM + i] * d  # a sum
        if t >> 30 ^ t >> 31:  # which is no rest
            t = t >> 31 ^ 1073741823
        m = s[_MEAN + i]
        if new:
            m = t
        h = t - m
        t = m
        m += (h >> 15) * k + ((h & 0x7FFF) * k >> 15)
        s[_MEAN + i] = m
        h += t - m
        if (h ^ h >> 31) > bound:
            steady = 0
        if i > 2:
            if s[_STILL] == 0:
                s[_FIRST + i - 3] = t
            t = m - s[_FIRST + i - 3]
            if (t ^ t >> 31) > tilted:
                tilts = 1
            t = (s[_FORCE + i - 3] * n << 6) - m
            if (t ^ t >> 31) > s[_SHAKEN]:
                steady = 0
        i += 1
    learned = s[_LEARNED]
    since = s[_SINCE]
    if learned:
        since += 1
        since -= since >> 17
        s[_SINCE] = since
    k = s[_STEADY] + 1
    if k > s[_STEADY_MAX]:
        k = s[_STEADY_MAX]
    s[_STEADY] = k if steady > tilts else 0

    # the mean rate can be the bias: what is known of that bounds what is believed
    rested = s[_AT_REST]
    if steady:
        d = s[_NEAR] + (since * s[_DRIFT] >> 8)
        if d > s[_LIMIT] or k == s[_STEADY_MAX]:
            d = s[_LIMIT]
        bound = s[_START_LIMIT]
        i = 0
        while i < 3:
            m = s[_MEAN + i]
            k = s[_BEFORE + i]
            h = m - ((k >> 8) * n + ((k & 255) * n >> 8))
            k = s[_BIAS + i]
            t = m - ((k >> 8) * n + ((k & 255) * n >> 8))
            h ^= h >> 31
            t ^= t >> 31
            if learned:
                if rested or h < t:
                    t = h
            else:
                d = s[_NEAR] + ((s[_SIGMA + i] >> 15) * s[_SUM_RAD] >> 4)
            if t > d or (t ^ t >> 31) > bound or (m ^ m >> 31) > bound:
                steady = 0
            i += 1
    t = 0
    if steady > tilts:
        t = s[_STILL]
        if t < s[_REST] and new == 0:
            t += 1
    else:
        s[_MOVED] = 1
    s[_STILL] = t
    still = 1 if t == s[_REST] else 0
    s[_AT_REST] = still

    if still:  # the gyro reads its bias
        if learned == 0:
            s[_LEARNED] = 1
        s[_SINCE] = 0
        if s[_AGE] < s[_OLD]:
            s[_AGE] = s[_OLD]
        d = s[_RESTED] + 1
        k = s[_KEPT] + 1
        if rested == 0:
            s[_EVENT] |= 1
            s[_HELD] = s[_HELD + 1] = 0
            d = s[_REST] + 1
            k = 1
        if d >= s[_RESTED_MAX]:
            d = s[_RESTED_MAX]
            s[_LEARNED] = 2
        s[_RESTED] = d
        s[_KEPT] = k
        yaw = 0
        x = 4096  # what the block has turned about the vertical
        i = 0
        while i < 3:
            m = s[_BIAS + i]
            h = s[_SUM + i]
            t = h - (m >> 8) * n - ((m & 255) * n >> 8)
            if t >> 19 ^ t >> 31:
                t = t >> 31 ^ 524287
            x += (s[_ROWS + 6 + i] >> 5) * t
            if learned == 0:
                h = s[_MEAN + i]
            t = (h // n << 8) + ((h % n << 8) // n)
            if learned:
                t = m + (t - m) // d
            s[_BIAS + i] = t
            if rested == 0:
                s[_BEFORE + i] = t
                s[_NEXT + i] = t
                # yaw as if it had been known: the change, rad/s Q15, by its view, rad Q20
                m = ((t - m) >> 3) // (s[_INC_RAD] >> 18)
                h = s[_YAW_VIEW + i]
                s[_YAW_VIEW + i] = 0
                yaw += (h >> 15) * m + ((h & 0x7FFF) * m >> 15)
            elif k >= s[_KEEP]:
                s[_KEPT] = 0
                s[_BEFORE + i] = s[_NEXT + i]
                s[_NEXT + i] = t
            i += 1
        if rested:  # and that was no turn: its half, rad Q26
            x >>= 13
            if x >> 15 ^ x >> 31:
                x = x >> 31 ^ 32767
            if k >= s[_KEEP]:
                s[_HELD + 1] = s[_HELD]
                s[_HELD] = 0
            s[_HELD] += x
            h = s[_W] + 16384 >> 15
            k = s[_X] + 16384 >> 15
            m = s[_Y] + 16384 >> 15
            t = s[_Z] + 16384 >> 15
            s[_W] += x * t >> 11
            s[_X] += x * m >> 11
            s[_Y] -= x * k >> 11
            s[_Z] -= x * h >> 11
        if yaw:
            if yaw >> 21 ^ yaw >> 31:
                yaw = yaw >> 31 ^ 2097151
            turn(array, 268435456, 0, 0, 0 - (yaw << 7))
        if learned == 0 and s[_MOVED] == 0:  # stood still since power-on: again, with the bias
            s[_W] = s[_ONE]
            s[_X] = 0
            s[_Y] = 0
            s[_Z] = 0
            level(array, s[_MEAN + 3], s[_MEAN + 4], s[_MEAN + 5], 1)
            zero_yaw(array)
    elif rested:
        s[_EVENT] |= 2
        if steady == 0:
            s[_LEARNED] = 2
        elif learned == 1:  # the first rest, and it was a slow tilt: its gyro read that
            s[_LEARNED] = 0
            s[_EVENT] |= 256
        i = 0
        while i < 3:
            s[_BIAS + i] = s[_BEFORE + i]  # motion begins before it is seen
            i += 1
        turn(array, 268435456, 0, 0, s[_HELD] + s[_HELD + 1] << 2)

    # the turn; one that is too wild is no place to learn from, nor to level by its mean
    wild = 0
    i = 0
    while i < 3:
        t = s[_BIAS + i]
        t = s[_SUM + i] - (t >> 8) * n - ((t & 255) * n >> 8) >> 13
        if t >> 16 ^ t >> 31:
            t = t >> 31 ^ 65535
        s[_TURN + i] = t
        if (t ^ t >> 31) > _WILD:
            wild = 32
        i += 1
    s[_EVENT] |= wild

    # the rotation matrix, Q15, three elements a turn: on the diagonal and beside it
    h = s[_W] + 16384 >> 15
    i = 0
    while i < 3:
        k = 0 if i == 2 else i + 1
        m = 3 - i - k
        x = s[_X + i] + 16384 >> 15
        y = s[_X + k] + 16384 >> 15
        z = s[_X + m] + 16384 >> 15
        s[_ROWS + 4 * i] = h * h + x * x - y * y - z * z + 16384 >> 15
        x *= y
        z *= h
        s[_ROWS + 3 * i + k] = x - z + 8192 >> 14
        s[_ROWS + 3 * k + i] = x + z + 8192 >> 14
        i += 1
    # the block's acceleration in the earth frame; where it levels, in the axes of the block's end,
    # half of its turn further (later what a turn smears passes for acceleration)
    age = s[_AGE]
    young = 1 if age < s[_YOUNG] else 0
    x = s[_SUM + 3]
    y = s[_SUM + 4]
    z = s[_SUM + 5]
    if young and samples > 1:
        h = s[_TURN] >> 2
        m = s[_TURN + 1] >> 2
        d = s[_TURN + 2] >> 2
        i = x >> 7
        k = y >> 7
        t = z >> 7
        x += d * k - m * t >> 7
        y += h * t - d * i >> 7
        z += m * i - h * k >> 7
    k = s[_MG]
    i = 0
    while i < 3:
        h = s[_ROWS + 3 * i]
        m = s[_ROWS + 3 * i + 1]
        d = s[_ROWS + 3 * i + 2]
        t = h * (x & 127) + m * (y & 127) + d * (z & 127) >> 7
        t = h * (x >> 7) + m * (y >> 7) + d * (z >> 7) + t >> 8
        if wild:
            s[_NOW + i] = i >> 1 << 12
        else:
            s[_UP + i] += t
            if samples == 1:
                t *= n
            s[_NOW + i] = (t >> 15) * k + ((t & 0x7FFF) * k >> 15) >> s[_MG_SHIFT]
        i += 1
    k = s[_UP_SAMPLES]
    if wild == 0:
        k += samples
    s[_UP_SAMPLES] = k

    # at first the mean of all acceleration so far is up; later one that is more than 45 degrees
    # away over two seconds is no acceleration but a lost attitude: start again
    x = s[_UP]
    y = s[_UP + 1]
    z = s[_UP + 2]
    i = x >> 14
    h = y >> 14
    m = z >> 14
    t = 0
    if young or (k >= s[_LOST] and (z < 0 or i * i + h * h > m * m)):
        t = int(level(array, x, y, z, s[_HALF_G] * k))
    if young == 0:
        begin = 0
        age += 1
        if t:
            age = s[_YOUNG] + 1
            s[_EVENT] |= 12
        elif age > s[_OLD]:
            age = s[_OLD]
        t = 0
    elif t:
        if begin > 1:
            zero_yaw(array)
        begin = 0
        if samples > 1 or n == 1:
            age += 1
        if age == s[_YOUNG]:
            s[_EVENT] |= 64
    elif begin:  # no gravity has been seen yet
        begin = 3 if begin > 1 else 0
    s[_AGE] = age
    if young or k >= s[_LOST]:
        s[_UP] = s[_UP + 1] = 0
        s[_UP + 2] = t
        if t == 0:
            s[_UP_SAMPLES] = 0
    if samples == 1:
        s[_SEEN] = -1  # a sample counts for nothing
    s[_WORK] = 30

    i = _SUM
    while i < _SUM + 6:
        s[i] = 0
        i += 1
    s[_COUNT] = 0
    # what is over counts, or no block would ever be shorter; one that ended early has nothing over
    t = s[_LEFT]
    t = (n << 15) + t if t < 0 else n << 15
    s[_LEFT] = t if t > 0 else 1
    s[_BEGIN] = begin

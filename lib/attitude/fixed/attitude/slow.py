# SPDX-License-Identifier: MIT
"""What the integer Attitude does once per block of samples, a dozen times a second.

Rest, the gyro's bias there, and whether the attitude is lost: attitude.Rest and attitude.Up in
integers. Pace follows one sample later. Places and formats: this folder's __init__. A block's
sums are not divided, so that the bias keeps a resolution of 1e-5 deg/s.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.learn import work
from attitude.fixed.attitude.level import level, turn, without_yaw

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
_LEFT = const(178)
_COUNT = const(179)
_BEGIN = const(80)
_SUM = const(182)
_FORCE = const(158)
_AT_REST = const(161)
_MEAN = const(188)
_FIRST = const(194)
_BEFORE = const(96)
_NEXT = const(99)
_KEPT = const(197)
_UP = const(198)
_UP_SAMPLES = const(201)
_NOW = const(202)
_AGE = const(205)
_STILL = const(206)
_STEADY = const(207)
_RESTED = const(208)
_SINCE = const(102)
_LEARNED = const(103)
_MOVED = const(104)
_EVENT = const(218)
_YAW_VIEW = const(139)
_YAW_NOISE = const(138)
_WORK = const(219)
_TURN = const(224)
_SEEN = const(214)
_SIGMA = const(105)
_ROWS = const(227)
_WILD = const(42598)  # 1.3 rad, Q15


@micropython.viper
def slow(array):
    """Take the block's sums, start the next block."""
    s = ptr32(array)
    n = s[_N]
    begin = s[_BEGIN]
    while s[_WORK]:  # a short block
        work(array)

    # as if it had had n samples, whatever the period; one at the beginning
    samples = s[_COUNT]
    k = n
    if begin and begin < 3:
        k = 1
    if samples != k:
        i = _SUM
        while i < _SUM + 6:
            t = s[i]
            s[i] = t // samples * k + t % samples * k // samples
            i += 1
    samples = k
    still = int(_still(array))
    rested = s[_AT_REST]
    s[_AT_REST] = still
    if still:
        s[_EVENT] |= 1 - rested
        _rest(array, rested)
    elif rested:
        s[_EVENT] |= 2
        i = 0
        while i < 3:
            s[_BIAS + i] = s[_BEFORE + i]  # motion begins before it is seen
            i += 1

    # the turn; one that is too wild is no place to learn from, nor to level by its mean
    i = 0
    while i < 3:
        t = s[_BIAS + i]
        t = s[_SUM + i] - (t >> 8) * n - ((t & 255) * n >> 8) >> 13
        if t > 65535:
            t = 65535
        elif t < -65535:
            t = -65535
        s[_TURN + i] = t
        if t > _WILD or t < -_WILD:
            s[_EVENT] |= 32
        i += 1

    wild = s[_EVENT] & 32

    # the rotation matrix, and the block's acceleration in the earth frame
    w = s[_W] + 16384 >> 15
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    i = s[_SUM + 3]
    j = s[_SUM + 4]
    k = s[_SUM + 5]
    a = 0
    while a < 3:
        if a == 0:  # a row of the rotation matrix, Q15
            p = w * w + x * x - y * y - z * z + 16384 >> 15
            q = x * y - w * z + 8192 >> 14
            r = x * z + w * y + 8192 >> 14
        elif a == 1:
            p = x * y + w * z + 8192 >> 14
            q = w * w - x * x + y * y - z * z + 16384 >> 15
            r = y * z - w * x + 8192 >> 14
        else:
            p = x * z - w * y + 8192 >> 14
            q = y * z + w * x + 8192 >> 14
            r = w * w - x * x - y * y + z * z + 16384 >> 15
        s[_ROWS + 3 * a] = p
        s[_ROWS + 3 * a + 1] = q
        s[_ROWS + 3 * a + 2] = r
        t = p * (i & 127) + q * (j & 127) + r * (k & 127) >> 7
        t = p * (i >> 7) + q * (j >> 7) + r * (k >> 7) + t >> 8
        if wild:
            t = a >> 1 << 12
        else:
            s[_UP + a] += t
            if samples == 1:
                t *= n
            t = (t >> 15) * s[_MG] + ((t & 0x7FFF) * s[_MG] >> 15) >> s[_MG_SHIFT]
        s[_NOW + a] = t
        a += 1
    k = s[_UP_SAMPLES]
    if wild == 0:
        k += samples
    s[_UP_SAMPLES] = k

    # at first the mean of all acceleration so far is up; later one that is more than 45 degrees
    # away over two seconds is no acceleration but a lost attitude: start again
    age = s[_AGE]
    x = s[_UP]
    y = s[_UP + 1]
    z = s[_UP + 2]
    if age < s[_YOUNG]:
        t = int(level(array, x, y, z, s[_HALF_G] * k))
        if t:
            if begin > 1:
                without_yaw(array)
            begin = 0
            if samples > 1 or n == 1:
                age += 1
            if age == s[_YOUNG]:
                s[_EVENT] |= 64
        else:  # no gravity has been seen yet
            s[_UP_SAMPLES] = 0
            if begin:
                begin = 3 if begin > 1 else 0
        s[_UP] = 0
        s[_UP + 1] = 0
        s[_UP + 2] = t
    else:
        begin = 0
        age += 1
        if age > s[_OLD]:
            age = s[_OLD]
        if k >= s[_LOST]:
            i = x >> 14
            j = y >> 14
            t = z >> 14
            if (z < 0 or i * i + j * j > t * t) and int(level(array, x, y, z, s[_HALF_G] * k)):
                age = s[_YOUNG] + 1
                s[_EVENT] |= 12
            s[_UP] = 0
            s[_UP + 1] = 0
            s[_UP + 2] = 0
            s[_UP_SAMPLES] = 0
    s[_AGE] = age
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


@micropython.viper
def _still(array) -> int:
    """Whether it rests: all near their half-second means, these where they were, and the gyro
    near its bias for long enough."""
    s = ptr32(array)
    n = s[_N]
    k = s[_MEAN_K]
    d = 1
    new = 0
    if s[_BEGIN] and s[_BEGIN] < 3:
        k = 32768
        d = n
        new = 1
    steady = 1
    bound = s[_STILL_GYRO]
    i = 0
    while i < 6:
        if i == 3:
            bound = s[_STILL_ACCEL]
            d <<= 6
        t = s[_SUM + i] * d  # a sum
        if t > 1073741823:  # which is no rest
            t = 1073741823
        elif t < -1073741823:
            t = -1073741823
        m = s[_MEAN + i]
        if new:
            m = t
        if i > 2 and s[_STILL] == 0:
            s[_FIRST + i - 3] = m
        h = t - m
        m += (h >> 15) * k + ((h & 0x7FFF) * k >> 15)
        s[_MEAN + i] = m
        t -= m
        if t > bound or t < 0 - bound:
            steady = 0
        if i > 2:
            t = m - s[_FIRST + i - 3]
            if t > s[_TILTED] or t < 0 - s[_TILTED]:
                steady = 0
            t = (s[_FORCE + i - 3] * n << 6) - m
            if t > s[_SHAKEN] or t < 0 - s[_SHAKEN]:
                steady = 0
        i += 1
    if s[_LEARNED]:
        s[_SINCE] += 1
    if steady == 0:
        s[_STEADY] = 0
        s[_STILL] = 0
        s[_MOVED] = 1
        return 0
    if s[_STEADY] < s[_STEADY_MAX]:
        s[_STEADY] += 1

    # what is known of the bias bounds what is believed
    i = 0
    while i < 3:
        m = s[_MEAN + i]
        t = m - ((s[_BIAS + i] >> 8) * n + ((s[_BIAS + i] & 255) * n >> 8))
        t = t if t >= 0 else 0 - t
        if s[_LEARNED]:
            bound = s[_SINCE]
            if bound > 100000:
                bound = 100000
            bound = s[_NEAR] + (bound * s[_DRIFT] >> 8)
            if bound > s[_LIMIT] or s[_STEADY] == s[_STEADY_MAX]:
                bound = s[_LIMIT]
            k = m - ((s[_BEFORE + i] >> 8) * n + ((s[_BEFORE + i] & 255) * n >> 8))
            k = k if k >= 0 else 0 - k
            if s[_AT_REST] or k < t:
                t = k
        else:
            bound = (s[_SIGMA + i] >> 15) * s[_SUM_RAD] >> 4
            bound += s[_NEAR]
            if bound > s[_START_LIMIT]:
                bound = s[_START_LIMIT]
        k = s[_START_LIMIT]
        if t > bound or m > k or m < 0 - k:
            s[_STILL] = 0
            s[_MOVED] = 1
            return 0
        i += 1
    t = s[_STILL]
    if t < s[_REST] and new == 0:
        t += 1
        s[_STILL] = t
    return 1 if t == s[_REST] else 0


@micropython.viper
def _rest(array, rested: int):
    """The gyro reads its bias."""
    s = ptr32(array)
    n = s[_N]
    learned = s[_LEARNED]
    s[_LEARNED] = 1
    s[_SINCE] = 0
    if s[_AGE] < s[_OLD]:
        s[_AGE] = s[_OLD]
    d = s[_RESTED] + 1
    if not rested:
        d = s[_REST] + 1
        s[_KEPT] = 0
    if d > s[_RESTED_MAX]:
        d = s[_RESTED_MAX]
    s[_RESTED] = d
    s[_KEPT] += 1
    yaw = 0
    i = 0
    while i < 3:
        t = s[_BIAS + i]
        m = t
        if learned == 0:
            k = s[_MEAN + i]
            t = (k // n << 8) + ((k % n << 8) // n)
        k = s[_SUM + i]
        t += ((k // n << 8) + ((k % n << 8) // n) - t) // d
        s[_BIAS + i] = t
        if not rested:
            s[_BEFORE + i] = t
            s[_NEXT + i] = t
            # yaw as if it had been known: the change, rad/s Q15, by its view, rad Q29 (as half)
            m = ((t - m) >> 3) // (s[_INC_RAD] >> 18)
            k = s[_YAW_VIEW + i]
            s[_YAW_VIEW + i] = 0
            yaw += (k >> 15) * m + ((k & 0x7FFF) * m >> 15)
        elif s[_KEPT] >= s[_KEEP]:
            s[_BEFORE + i] = s[_NEXT + i]
            s[_NEXT + i] = t
        i += 1
    if s[_KEPT] >= s[_KEEP]:
        s[_KEPT] = 0
    if not rested:
        if yaw > 2097151:  # rad Q20
            yaw = 2097151
        elif yaw < -2097151:
            yaw = -2097151
        turn(array, 268435456, 0, 0, 0 - (yaw << 7))
    if learned == 0 and s[_MOVED] == 0:  # stood still since power-on: again, with the bias
        s[_W] = s[_ONE]
        s[_X] = 0
        s[_Y] = 0
        s[_Z] = 0
        level(array, s[_MEAN + 3], s[_MEAN + 4], s[_MEAN + 5], 1)
        without_yaw(array)
        i = 0
        while i < 12:
            s[_YAW_VIEW + i] = 0
            i += 1
        s[_YAW_NOISE] = 0

# SPDX-License-Identifier: MIT
"""What the integer Attitude does once per block of samples, about 50 times a second.

Rest, gyro bias at rest, gain, and whether the attitude is lost: the slow part of
attitude.Attitude and attitude.GyroBias in integers. Places and formats: this folder's __init__.
A block's sums are not divided, so that the bias keeps a resolution of 1e-5 deg/s.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.level import level, without_yaw

_ONE = const(32)
_K = const(74)
_K_SHIFT = const(75)
_K_HALF = const(76)
_COUNT = const(78)
_W = const(56)
_X = const(57)
_Y = const(58)
_Z = const(59)
_BIAS = const(64)
_VX = const(70)
_VY = const(71)
_PX = const(72)
_PY = const(73)
_LEFT = const(77)
_OVER = const(79)
_DUE = const(80)
_BEGIN = const(81)
_SUM = const(82)
_AT_REST = const(97)
_MEAN = const(98)
_HOME = const(104)
_HOME_BIAS = const(107)
_UP = const(110)
_UP_SAMPLES = const(113)
_AGE = const(114)
_STILL = const(115)
_RESTED = const(116)
_LEARNED = const(117)
_MOVED = const(118)
_SPEED = const(119)
_KNOWN = const(120)
_GAIN = const(121)
_TILT = const(122)
_VIEW_END = const(140)
_N = const(33)
_MEAN_K = const(34)
_STILL_GYRO = const(35)
_STILL_ACCEL = const(36)
_LIMIT = const(37)
_REST = const(41)
_RESTED_MAX = const(42)
_YOUNG = const(43)
_RAMP = const(44)
_K_MOTION = const(45)
_K_REST = const(46)
_HALF_G = const(47)
_KNOWN_MAX = const(49)
_LEARN_AGE = const(50)
_LOST = const(51)
_SPEED_K = const(52)
_FAST = const(53)
_FAST_SHIFT = const(54)


@micropython.viper
def slow(array):
    """Take the block's sums, start the next block."""
    s = ptr32(array)
    n = s[_N]
    begin = s[_BEGIN]
    learned = s[_LEARNED]
    rest = s[_REST]
    rested = s[_STILL] >= rest

    # as if it had had n samples, whatever the period; one at the beginning
    samples = s[_COUNT]
    k = 1 if begin else n
    if samples != k:
        i = _SUM
        while i < _SUM + 6:
            t = s[i]
            s[i] = t // samples * k + t % samples * k // samples
            i += 1
    samples = k

    # half-second means; still: all near their mean, gyro near its bias
    k = s[_MEAN_K]
    d = 1
    if begin:
        k = 32768
        d = n
    limit = s[_LIMIT + learned]
    far = s[_LIMIT] << 1  # no gyro has such a bias, and what follows stays inside 32 bits
    bound = s[_STILL_GYRO]
    still = 1
    i = _MEAN
    while i < _MEAN + 3:
        t = s[i - 16] * d  # a sum
        m = t - s[i + 6]  # its home
        if m > limit or m < 0 - limit or t > far or t < 0 - far:
            still = 0
        m = s[i]
        t -= m
        s[i] = m + (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
        t -= s[i] - m
        if t > bound or t < 0 - bound:
            still = 0
        i += 1
    bound = s[_STILL_ACCEL]
    d <<= 6
    while i < _MEAN + 6:
        m = s[i]
        t = s[i - 16] * d - m
        s[i] = m + (t >> 15) * k + ((t & 0x7FFF) * k >> 15)
        t -= s[i] - m
        if t > bound or t < 0 - bound:
            still = 0
        i += 1
    if still == 0:
        s[_MOVED] = 1
    elif begin:
        still = 0
    else:
        still = s[_STILL] + 1
        if still > rest:
            still = rest
    s[_STILL] = still
    s[_AT_REST] = 1 if still == rest else 0

    # at rest the gyro reads its bias; in motion it errs by parts of its rate
    if still == rest:
        d = s[_RESTED] + 1
        if d > s[_RESTED_MAX]:
            d = s[_RESTED_MAX]
        s[_RESTED] = d
        s[_KNOWN] = s[_KNOWN_MAX]
        i = 0
        while i < 3:
            m = s[_MEAN + i]
            s[_HOME + i] = m
            m = (m << 8) // n
            s[_HOME_BIAS + i] = m
            t = s[_BIAS + i]
            if learned == 0:
                t = m
            s[_BIAS + i] = t + ((s[_SUM + i] << 8) // n - t) // d
            i += 1
        if learned == 0:
            s[_LEARNED] = 1
            if s[_MOVED] == 0:  # stood still since power-on: again, without the bias
                s[_W] = s[_ONE]
                s[_X] = 0
                s[_Y] = 0
                s[_Z] = 0
                level(array, s[_MEAN + 3], s[_MEAN + 4], s[_MEAN + 5], 1)
                without_yaw(array)

    m = 0
    i = 0
    while i < 3:
        t = s[_SUM + i] - (s[_BIAS + i] >> 8) * n
        m += t if t >= 0 else 0 - t
        i += 1
    d = s[_SPEED]
    m -= d
    k = s[_SPEED_K]
    d += (m >> 15) * k + ((m & 0x7FFF) * k >> 15)
    s[_SPEED] = d
    k = s[_FAST]
    fast = (d >> 15) * k + ((d & 0x7FFF) * k >> 15) >> s[_FAST_SHIFT]

    # rotation matrix, Q15, and the block's acceleration in the earth frame
    w = s[_W] + 16384 >> 15
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    r00 = w * w + x * x - y * y - z * z + 16384 >> 15
    r01 = x * y - w * z + 8192 >> 14
    r02 = x * z + w * y + 8192 >> 14
    r10 = x * y + w * z + 8192 >> 14
    r11 = w * w - x * x + y * y - z * z + 16384 >> 15
    r12 = y * z - w * x + 8192 >> 14
    r20 = x * z - w * y + 8192 >> 14
    r21 = y * z + w * x + 8192 >> 14
    r22 = w * w - x * x - y * y + z * z + 16384 >> 15
    x = s[_SUM + 3]
    y = s[_SUM + 4]
    z = s[_SUM + 5]
    i = x & 127
    j = y & 127
    k = z & 127
    x >>= 7
    y >>= 7
    z >>= 7
    s[_UP] += r00 * x + r01 * y + r02 * z + (r00 * i + r01 * j + r02 * k >> 7) >> 8
    s[_UP + 1] += r10 * x + r11 * y + r12 * z + (r10 * i + r11 * j + r12 * k >> 7) >> 8
    s[_UP + 2] += r20 * x + r21 * y + r22 * z + (r20 * i + r21 * j + r22 * k >> 7) >> 8
    i = _SUM
    while i < _SUM + 6:
        s[i] = 0
        i += 1
    k = s[_UP_SAMPLES] + samples
    s[_UP_SAMPLES] = k
    s[_COUNT] = 0
    # what is over counts, or no block would ever be shorter; one that ended early has nothing over
    t = s[_LEFT]
    t = (n << 15) + t if t < 0 else n << 15
    s[_LEFT] = t if t > 0 else 1
    s[_BEGIN] = 0
    s[_DUE] = 1

    # at first the mean of all acceleration so far is up; later one that is more than 45 degrees
    # away over two seconds is no acceleration but a lost attitude: start again
    forget = 0
    age = s[_AGE]
    x = s[_UP]
    y = s[_UP + 1]
    z = s[_UP + 2]
    if age < s[_YOUNG]:
        t = int(level(array, x, y, z, s[_HALF_G] * k))
        if t:
            if begin == 2:
                without_yaw(array)
            s[_UP] = 0
            s[_UP + 1] = 0
            s[_UP + 2] = t
    elif k >= s[_LOST]:
        i = x >> 14
        j = y >> 14
        t = z >> 14
        if (z < 0 or i * i + j * j > t * t) and int(level(array, x, y, z, s[_HALF_G] * k)):
            age = 0
            forget = 1
        s[_UP] = 0
        s[_UP + 1] = 0
        s[_UP + 2] = 0
        s[_UP_SAMPLES] = 0

    # gain: none while the mean levels, then high, then that of motion or rest
    if s[_OVER]:  # the gyro's range was left: as unsure as just after the start
        s[_OVER] = 0
        if age > s[_YOUNG]:
            age = s[_YOUNG]
    if not begin:
        age += 1
        if age > s[_LEARN_AGE]:
            age = s[_LEARN_AGE] + 1
    s[_AGE] = age
    gain = 0
    if age >= s[_YOUNG]:
        gain = s[_RAMP] // age
        fast += s[_K_MOTION]
        if gain < fast:
            gain = fast
        if still == rest and gain < s[_K_REST]:
            gain = s[_K_REST]
    now = gain
    k = 9
    while gain >= 32768:
        gain >>= 1
        k -= 1
    s[_K] = gain
    s[_K_SHIFT] = k
    s[_K_HALF] = 1 << k >> 1

    # at rest there is no velocity; one that ends the rest goes on, in the scale of the new gain
    t = s[_GAIN]
    s[_GAIN] = now
    k = -1
    if still == rest:
        if not rested:
            k = 0
    elif rested:
        k = (now << 8) // (t >> 7) if t else 0
    if forget:
        k = 0
    if k >= 0:
        i = s[_VX]
        j = s[_VY]
        s[_VX] = (i >> 15) * k + ((i & 0x7FFF) * k >> 15)
        s[_VY] = (j >> 15) * k + ((j & 0x7FFF) * k >> 15)
        k = k * k >> 15
        i = s[_PX]
        j = s[_PY]
        s[_PX] = (i >> 15) * k + ((i & 0x7FFF) * k >> 15)
        s[_PY] = (j >> 15) * k + ((j & 0x7FFF) * k >> 15)
        i = _TILT
        while i < _VIEW_END:
            s[i] = 0
            i += 1

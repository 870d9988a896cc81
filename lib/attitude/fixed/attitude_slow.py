# SPDX-License-Identifier: MIT
"""What the integer Attitude does once per block of samples, about 50 times a second.

Rest, gyro bias, gain, and whether the attitude is lost: attitude.Attitude._slow in integers.
A block's sums are not divided: "sum" is inc (see attitude_step) times samples, so the bias keeps
a resolution of 1e-5 deg/s. Spans of time are counts of blocks.
"""

import micropython
from micropython import const

from attitude.fixed.intmath import isqrt

_K = const(30)  # gain * dt = K / 2^(15 + SHIFT), see attitude_step
_K_SHIFT = const(31)
_K_HALF = const(32)
_W = const(34)
_X = const(35)
_Y = const(36)
_Z = const(37)
_TRIM = const(38)
_VX = const(48)
_VY = const(49)
_PX = const(50)
_PY = const(51)
_LEFT = const(52)
_OVER = const(53)
# 42-44 bias inc Q8; 54-59 sums; 64-69 their half-second means, accelerometer Q6;
# 70-72 bias as last seen at rest, sum; 73-75 the same, inc Q8; 76-78 up, counts
_UP_LEFT = const(79)  # blocks until the lost check
_AGE = const(80)
_STILL = const(81)
_RESTING = const(82)
_LEARNED = const(83)
_MOVED = const(84)
_HAS_MEAN = const(85)

_N = const(88)  # samples in a block
_MEAN_K = const(89)  # Q15
_STILL_GYRO = const(90)  # sum
_STILL_ACCEL = const(91)  # counts * samples, Q6
_LIMIT = const(92)  # sum: bias that is believed, before and after the first rest
_LIMIT_BIAS = const(94)  # the same two, inc Q8
_REST_BLOCKS = const(96)
_RESTING_MAX = const(97)
_OVER_AGE = const(98)
_RAMP = const(99)  # gain * dt Q24 at start is RAMP / (16 age + RAMP_AGE)
_RAMP_AGE = const(100)
_K_MOTION = const(101)  # gain * dt, Q24
_K_REST = const(102)
_LEARN = const(103)  # g Q15 -> inc Q8 per block: times LEARN >> LEARN_SHIFT
_LEARN_SHIFT = const(104)
_LOST_BLOCKS = const(105)
_LOST_MIN = const(106)  # half a g in counts, times LOST_BLOCKS


@micropython.viper
def level(array, x: int, y: int, z: int):
    """Turn q the short way so that the earth vector (x, y, z) points up; forget v and p.

    Any scale up to 2^29; the zero vector does nothing. The rotation is (|u| + z, y, -x, 0) / norm,
    exact to 6e-5 rad but for 0.1 degree near upside down.
    """
    s = ptr32(array)
    # the largest component to 13 or 14 bits
    t = (x if x >= 0 else 0 - x) | (y if y >= 0 else 0 - y) | (z if z >= 0 else 0 - z)
    if t == 0:
        return
    while t >= 16384:
        t >>= 1
        x >>= 1
        y >>= 1
        z >>= 1
    while t < 8192:
        t <<= 1
        x <<= 1
        y <<= 1
        z <<= 1
    n = int(isqrt(x * x + y * y + z * z))
    if z < 0:
        w = (x * x + y * y) // (n - z)  # n + z without its cancellation
    else:
        w = n + z
    if w == 0:
        x = 0
        y = 1
    n = int(isqrt((w * w >> 2) + (x * x >> 2) + (y * y >> 2))) << 1
    if n == 0:
        n = 1
    # factors in two parts of 15 bits
    a = (w << 15) // n
    b = (y << 15) // n
    c = (0 - (x << 15)) // n
    w = (((w << 15) % n) << 15) // n
    y = (((y << 15) % n) << 15) // n
    x = (((0 - (x << 15)) % n) << 15) // n
    h = s[_W] + 16384 >> 15
    i = s[_X] + 16384 >> 15
    j = s[_Y] + 16384 >> 15
    k = s[_Z] + 16384 >> 15
    s[_W] = a * h - b * i - c * j + (w * h - y * i - x * j >> 15)
    s[_X] = a * i + b * h + c * k + (w * i + y * h + x * k >> 15)
    s[_Y] = a * j + c * h - b * k + (w * j + x * h - y * k >> 15)
    s[_Z] = a * k + b * j - c * i + (w * k + y * j - x * i >> 15)
    s[_TRIM] = 0
    s[_VX] = 0
    s[_VY] = 0
    s[_PX] = 0
    s[_PY] = 0


@micropython.viper
def slow(array):
    """Take the block's sums, start the next block."""
    s = ptr32(array)
    n = s[_N]
    s[_LEFT] = n

    # half-second means; still: all near their mean, gyro near its bias
    learned = s[_LEARNED]
    k = s[_MEAN_K] if s[_HAS_MEAN] else 32768
    s[_HAS_MEAN] = 1
    limit = s[_LIMIT + learned]
    far = s[_LIMIT] << 1  # no gyro has such a bias, and it keeps what follows inside 32 bits
    bound = s[_STILL_GYRO]
    still = 1
    i = 0
    while i < 6:
        t = s[54 + i]
        if i == 3:
            bound = s[_STILL_ACCEL]
        if i >= 3:
            t <<= 6
        else:
            d = t - s[70 + i]
            if d > limit or d < 0 - limit or t > far or t < 0 - far:
                still = 0
        m = s[64 + i]
        d = t - m
        m += (d >> 15) * k + ((d & 0x7FFF) * k >> 15)
        s[64 + i] = m
        d = t - m
        if d > bound or d < 0 - bound:
            still = 0
        i += 1
    if still:
        still = s[_STILL] + 1
        if still > s[_REST_BLOCKS]:
            still = s[_REST_BLOCKS]
    else:
        s[_MOVED] = 1
    s[_STILL] = still

    # gain: high at start and after the gyro's over-range, then that of motion or rest
    age = s[_AGE] + 1
    if s[_OVER]:
        s[_OVER] = 0
        if age > s[_OVER_AGE]:
            age = s[_OVER_AGE]
    gain = s[_RAMP] // ((age << 4) + s[_RAMP_AGE])
    m = s[_K_MOTION]
    if gain > 4194303:  # k = 0.25: more would not be stable
        gain = 4194303
    if gain < m:
        gain = m
        age -= 1  # old enough
    s[_AGE] = age

    # rotation matrix, Q15
    w = s[_W] + 16384 >> 15
    x = s[_X] + 16384 >> 15
    y = s[_Y] + 16384 >> 15
    z = s[_Z] + 16384 >> 15
    r00 = w * w + x * x - y * y - z * z >> 15
    r01 = x * y - w * z >> 14
    r02 = x * z + w * y >> 14
    r10 = x * y + w * z >> 14
    r11 = w * w - x * x + y * y - z * z >> 15
    r12 = y * z - w * x >> 14
    r20 = x * z - w * y >> 14
    r21 = y * z + w * x >> 14
    r22 = w * w - x * x - y * y + z * z >> 15

    if still == s[_REST_BLOCKS]:
        if gain < s[_K_REST]:
            gain = s[_K_REST]
        resting = s[_RESTING] + 1
        if resting > s[_RESTING_MAX]:
            resting = s[_RESTING_MAX]
        s[_RESTING] = resting
        i = 0
        while i < 3:
            m = s[64 + i]
            s[70 + i] = m
            m = (m << 8) // n
            s[73 + i] = m
            t = s[42 + i]
            if learned == 0:
                t = m
            s[42 + i] = t + ((s[54 + i] << 8) // n - t) // resting
            i += 1
        if learned == 0:
            s[_LEARNED] = 1
            if s[_MOVED] == 0:  # has stood still since power-on: start again without the bias
                s[_W] = s[29]
                s[_X] = 0
                s[_Y] = 0
                s[_Z] = 0
                level(array, s[67], s[68], s[69])
    elif gain == m:
        # what has to be corrected again and again is bias: (py, -px, 0) as the sensor sees it
        t = s[_PY] >> 9
        d = 0 - (s[_PX] >> 9)
        if t > 32767:
            t = 32767
        elif t < -32767:
            t = -32767
        if d > 32767:
            d = 32767
        elif d < -32767:
            d = -32767
        limit = s[_LIMIT_BIAS + learned]
        i = 0
        while i < 3:
            if i == 0:
                x = r00 * t + r10 * d
            elif i == 1:
                x = r01 * t + r11 * d
            else:
                x = r02 * t + r12 * d
            x = s[42 + i] - ((x + 16384 >> 15) * s[_LEARN] >> s[_LEARN_SHIFT])
            home = s[73 + i]
            if x > home + limit:
                x = home + limit
            elif x < home - limit:
                x = home - limit
            s[42 + i] = x
            i += 1

    # K of 15 bits and its shift
    m = 9
    while gain >= 32768:
        gain >>= 1
        m -= 1
    s[_K] = gain
    s[_K_SHIFT] = m
    s[_K_HALF] = 1 << m >> 1

    # the mean acceleration of two seconds, earth frame: more than 45 degrees wrong is lost
    x = s[57] // n >> 2
    y = s[58] // n >> 2
    z = s[59] // n >> 2
    s[76] += r00 * x + r01 * y + r02 * z >> 13
    s[77] += r10 * x + r11 * y + r12 * z >> 13
    s[78] += r20 * x + r21 * y + r22 * z >> 13
    i = 54
    while i < 60:
        s[i] = 0
        i += 1
    t = s[_UP_LEFT] - 1
    s[_UP_LEFT] = t
    if t == 0:
        s[_UP_LEFT] = s[_LOST_BLOCKS]
        x = s[76]
        y = s[77]
        z = s[78]
        s[76] = 0
        s[77] = 0
        s[78] = 0
        a = x >> 10
        b = y >> 10
        c = z >> 10
        d = s[_LOST_MIN] >> 10
        t = a * a + b * b
        if t + c * c > d * d and (z < 0 or t > c * c):
            level(array, x, y, z)
            s[_AGE] = 0

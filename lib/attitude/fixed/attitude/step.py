# SPDX-License-Identifier: MIT
"""The step of the integer Attitude: one viper function, since a call costs as much as a filter.

Places and formats: this folder's __init__. The sum of two "inc" is the trapezoid's half angle.
No intermediate result leaves 32 bits for any counts; the bounds it rests on, all the same for any
range, rate (folding.check_rate) and calibration (folding):

    calibrated accelerometer   65000 counts: 2^16, so times a Q15 matrix element below 2^31
    STEP                       at most 1.05 * 2^15; so is K times STEP by 2^15
    half angle of a sample     0.42 rad: 2^28.8; its square Q30 below 2^28
    |q|                        1 within 0.25 %, as the trim follows each turn by one sample
    level acceleration e       55 g * 2^24 = 2^29.8; velocity clamped to 64 g, position to 15.5 g,
                               so e - 2 p and v - 2 p are below 2^30.7
    correction of a sample     clamped to 0.05 rad of half angle
    lag_s * rate               1.2 rad Q15 (coefficients cuts lag_s)
    a block's sum of inc       2^30.4 for N samples; a longer block ends at 2^30, or at 4 N

The tests run it under the checked viper with inputs made to break these.
"""

import micropython
from micropython import const

from attitude.fixed.attitude.learn import work
from attitude.fixed.attitude.slow import slow

_GYRO_SHIFT = const(24)
_STEP = const(25)
_RATE = const(26)
_RATE_SHIFT = const(27)
_E_SHIFT = const(28)
_LAG_PRE = const(29)
_LAG = const(30)
_LAG_POST = const(31)
_ONE = const(32)
_N = const(33)
_SEQ = const(75)
_W = const(76)
_X = const(77)
_Y = const(78)
_Z = const(79)
_TRIM = const(166)
_LAST = const(167)
_BIAS = const(81)
_FRACTION = const(170)
_VX = const(173)
_VY = const(174)
_PX = const(175)
_PY = const(176)
_K = const(177)
_K_SHIFT = const(178)
_K_HALF = const(179)
_LEFT = const(181)
_COUNT = const(182)
_OVER = const(183)
_STUCK = const(184)
_MOST_G = const(180)
_USED = const(84)
_WORK = const(222)
_SUM = const(185)
_ROLL = const(155)
_YAW = const(157)
_RATES = const(158)
_FORCE = const(161)


@micropython.viper
def step(self, counts: ptr16):
    """One sample: counts as the sensor gives them, ax ay az temp gx gy gz (int16)."""
    s = ptr32(self._s)
    far = ptr32(int(s) + 4 * _ROLL)  # places near its beginning cost half
    x = (int(counts[0]) ^ 0x8000) - 0x8000
    y = (int(counts[1]) ^ 0x8000) - 0x8000
    z = (int(counts[2]) ^ 0x8000) - 0x8000
    ax = (s[0] * x + s[1] * y + s[2] * z + s[9]) >> 14
    ay = (s[3] * x + s[4] * y + s[5] * z + s[10]) >> 14
    az = (s[6] * x + s[7] * y + s[8] * z + s[11]) >> 14
    # within 16 counts of full scale (x ^ x >> 31 is |x|, or one less): saturated
    t = (x ^ x >> 31) + 16 | (y ^ y >> 31) + 16 | (z ^ z >> 31) + 16
    stuck = t >> 15
    far[_STUCK - _ROLL] |= stuck
    x = (int(counts[4]) ^ 0x8000) - 0x8000
    y = (int(counts[5]) ^ 0x8000) - 0x8000
    z = (int(counts[6]) ^ 0x8000) - 0x8000
    t = (x ^ x >> 31) + 16 | (y ^ y >> 31) + 16 | (z ^ z >> 31) + 16
    if t >> 15:
        far[_OVER - _ROLL] = 1
    t = s[_USED] * x + s[_USED + 1] * y + s[_USED + 2] * z
    gx = (t + s[_USED + 9]) >> s[_GYRO_SHIFT]
    t = s[_USED + 3] * x + s[_USED + 4] * y + s[_USED + 5] * z
    gy = (t + s[_USED + 10]) >> s[_GYRO_SHIFT]
    t = s[_USED + 6] * x + s[_USED + 7] * y + s[_USED + 8] * z
    gz = (t + s[_USED + 11]) >> s[_GYRO_SHIFT]
    far[_SUM - _ROLL] += gx
    far[_SUM - _ROLL + 1] += gy
    far[_SUM - _ROLL + 2] += gz
    far[_SUM - _ROLL + 3] += ax
    far[_SUM - _ROLL + 4] += ay
    far[_SUM - _ROLL + 5] += az

    far[_FORCE - _ROLL] = ax
    far[_FORCE - _ROLL + 1] = ay
    far[_FORCE - _ROLL + 2] = az

    # rates less bias; half angle of this sample by the trapezoid rule, Q30
    t = s[_BIAS] + far[_FRACTION - _ROLL]
    gx -= t >> 8
    far[_FRACTION - _ROLL] = t & 255
    t = s[_BIAS + 1] + far[_FRACTION - _ROLL + 1]
    gy -= t >> 8
    far[_FRACTION - _ROLL + 1] = t & 255
    t = s[_BIAS + 2] + far[_FRACTION - _ROLL + 2]
    gz -= t >> 8
    far[_FRACTION - _ROLL + 2] = t & 255
    m = s[_STEP]
    t = gx + far[_LAST - _ROLL]
    x = (t >> 15) * m + ((t & 0x7FFF) * m >> 15)
    t = gy + far[_LAST - _ROLL + 1]
    y = (t >> 15) * m + ((t & 0x7FFF) * m >> 15)
    t = gz + far[_LAST - _ROLL + 2]
    z = (t >> 15) * m + ((t & 0x7FFF) * m >> 15)
    far[_LAST - _ROLL] = gx
    far[_LAST - _ROLL + 1] = gy
    far[_LAST - _ROLL + 2] = gz
    m = s[_RATE]
    n = s[_RATE_SHIFT]
    far[_RATES - _ROLL] = (gx >> 15) * m + ((gx & 0x7FFF) * m >> 15) >> n
    far[_RATES - _ROLL + 1] = (gy >> 15) * m + ((gy & 0x7FFF) * m >> 15) >> n
    far[_RATES - _ROLL + 2] = (gz >> 15) * m + ((gz & 0x7FFF) * m >> 15) >> n

    # sin|x| / |x| = 1 - f, f Q20; 1 - cos|x| and the trim of |q| are g, Q18
    xh = (x + 16384) >> 15
    yh = (y + 16384) >> 15
    zh = (z + 16384) >> 15
    t = xh * xh + yh * yh + zh * zh
    g = t >> 15
    g = g * g >> 12
    f = ((t >> 10) * 10923 >> 16) - (g * 546 >> 16)
    g = (t >> 13) - (g * 683 >> 16) + far[_TRIM - _ROLL]
    x -= xh * f >> 5
    y -= yh * f >> 5
    z -= zh * f >> 5

    # q times (1, x, y, z): factors in two parts of 15 bits, v = vh 2^15 + vl, |vl| <= 2^14
    xh = (x + 16384) >> 15
    yh = (y + 16384) >> 15
    zh = (z + 16384) >> 15
    x -= xh << 15
    y -= yh << 15
    z -= zh << 15
    qw = s[_W]
    qx = s[_X]
    qy = s[_Y]
    qz = s[_Z]
    wh = (qw + 16384) >> 15
    ih = (qx + 16384) >> 15
    jh = (qy + 16384) >> 15
    kh = (qz + 16384) >> 15
    w = qw - (wh << 15)
    i = qx - (ih << 15)
    j = qy - (jh << 15)
    k = qz - (kh << 15)
    t = ih * x + jh * y + kh * z + i * xh + j * yh + k * zh
    qw -= (wh * g >> 3) + ih * xh + jh * yh + kh * zh + ((t + 16384) >> 15)
    t = wh * x + jh * z - kh * y + w * xh + j * zh - k * yh
    qx += wh * xh + jh * zh - kh * yh + ((t + 16384) >> 15) - (ih * g >> 3)
    t = wh * y + kh * x - ih * z + w * yh + k * xh - i * zh
    qy += wh * yh + kh * xh - ih * zh + ((t + 16384) >> 15) - (jh * g >> 3)
    t = wh * z + ih * y - jh * x + w * zh + i * yh - j * xh
    qz += wh * zh + ih * yh - jh * xh + ((t + 16384) >> 15) - (kh * g >> 3)

    # two rows of the rotation matrix, Q15
    wh = (qw + 16384) >> 15
    ih = (qx + 16384) >> 15
    jh = (qy + 16384) >> 15
    kh = (qz + 16384) >> 15
    w = wh * wh - kh * kh + 16384
    t = ih * ih - jh * jh
    r00 = (w + t) >> 15
    r11 = (w - t) >> 15
    t = ih * jh + 8192
    w = wh * kh
    r01 = (t - w) >> 14
    r10 = (t + w) >> 14
    r02 = (ih * kh + wh * jh + 8192) >> 14
    r12 = (jh * kh - wh * ih + 8192) >> 14

    # level part of the acceleration, twice integrated with a leak, all in g * 2^24
    m = far[_K - _ROLL] * s[_STEP] >> 15
    n = far[_K_SHIFT - _ROLL]
    half = far[_K_HALF - _ROLL]
    px = far[_PX - _ROLL]
    py = far[_PY - _ROLL]
    if stuck:
        x = 0
        y = 0
        i = 0
        j = 0
    else:
        x = ((r00 * ax >> 2) + (r01 * ay >> 2) + (r02 * az >> 2)) >> s[_E_SHIFT]
        y = ((r10 * ax >> 2) + (r11 * ay >> 2) + (r12 * az >> 2)) >> s[_E_SHIFT]
        i = far[_VX - _ROLL]
        j = far[_VY - _ROLL]
    t = x - (px << 1)
    i += ((t >> 15) * m + ((t & 0x7FFF) * m >> 15) + half) >> n
    t = y - (py << 1)
    j += ((t >> 15) * m + ((t & 0x7FFF) * m >> 15) + half) >> n
    if i >> 30 ^ i >> 31:
        i = i >> 31 ^ 1073741823
    if j >> 30 ^ j >> 31:
        j = j >> 31 ^ 1073741823
    far[_VX - _ROLL] = i
    far[_VY - _ROLL] = j
    t = i - (px << 1)
    px += ((t >> 15) * m + ((t & 0x7FFF) * m >> 15) + half) >> n
    t = j - (py << 1)
    py += ((t >> 15) * m + ((t & 0x7FFF) * m >> 15) + half) >> n
    if (px ^ px >> 31) > 260000000:
        px = px >> 31 ^ 260000000
    if (py ^ py >> 31) > 260000000:
        py = py >> 31 ^ 260000000
    far[_PX - _ROLL] = px
    far[_PY - _ROLL] = py

    # turn q in the earth frame by the half angles x = k py / 2, y = -k px / 2, Q30, no faster than
    # the gyro may err
    t = far[_MOST_G - _ROLL]
    if (px ^ px >> 31) > t:
        px = t ^ px >> 31
    if (py ^ py >> 31) > t:
        py = t ^ py >> 31
    n -= 2
    t = py << 3
    x = ((t >> 15) * m + ((t & 0x7FFF) * m >> 15)) >> n
    t = 0 - (px << 3)
    y = ((t >> 15) * m + ((t & 0x7FFF) * m >> 15)) >> n
    if (x ^ x >> 31) > 53687091:
        x = x >> 31 ^ 53687091
    if (y ^ y >> 31) > 53687091:
        y = y >> 31 ^ 53687091
    xh = x >> 15
    yh = y >> 15
    i = x & 0x7FFF
    j = y & 0x7FFF
    s[_W] = qw - xh * ih - yh * jh - ((i * ih + j * jh + 16384) >> 15)
    s[_X] = qx + xh * wh + yh * kh + ((i * wh + j * kh + 16384) >> 15)
    s[_Y] = qy + yh * wh - xh * kh + ((j * wh - i * kh + 16384) >> 15)
    s[_Z] = qz + xh * jh - yh * ih + ((i * jh - j * ih + 16384) >> 15)

    s[_SEQ] = (s[_SEQ] + 1) & 0x3FFFFFFF
    k = far[_COUNT - _ROLL] + 1
    far[_COUNT - _ROLL] = k
    t = far[_LEFT - _ROLL] - s[_STEP]
    far[_LEFT - _ROLL] = t
    if t > 0 and k > s[_N]:  # a loop faster than the filter: not until a sum is full
        x = far[_SUM - _ROLL]
        y = far[_SUM - _ROLL + 1]
        z = far[_SUM - _ROLL + 2]
        if ((x ^ x >> 31) | (y ^ y >> 31) | (z ^ z >> 31)) >> 30 or k > s[_N] << 2:
            t = 0
    if t <= 0:
        slow(self._s)
    elif far[_WORK - _ROLL]:  # the other samples of a block share its work
        work(self._s)

    # rotation matrix, Q15, its last row in (i, j, k), and how far |q| is off
    wh = (s[_W] + 16384) >> 15
    ih = (s[_X] + 16384) >> 15
    jh = (s[_Y] + 16384) >> 15
    kh = (s[_Z] + 16384) >> 15
    w = wh * wh
    i = ih * ih
    j = jh * jh
    k = kh * kh
    far[_TRIM - _ROLL] = (w + i + j + k - s[_ONE]) >> 13
    t = w - k + 16384
    r00 = (t + i - j) >> 15
    r11 = (t - i + j) >> 15
    k = (w + k - i - j + 16384) >> 15
    t = ih * jh + 8192
    w = wh * kh
    r01 = (t - w) >> 14
    r10 = (t + w) >> 14
    t = ih * kh + 8192
    w = wh * jh
    r02 = (t + w) >> 14
    i = (t - w) >> 14
    t = jh * kh + 8192
    w = wh * ih
    r12 = (t - w) >> 14
    j = (t + w) >> 14

    # lag: turned on by (a, b, c) = rate * lag_s, Q15, to the second order
    t = s[_LAG]
    m = s[_LAG_PRE]
    n = s[_LAG_POST]
    a = (gx >> m) * t >> n
    b = (gy >> m) * t >> n
    c = (gz >> m) * t >> n
    x = j * c - k * b + 16384 >> 15
    y = k * a - i * c + 16384 >> 15
    z = i * b - j * a + 16384 >> 15
    i += x + (y * c - z * b >> 16)
    j += y + (z * a - x * c >> 16)
    k += z + (x * b - y * a >> 16)
    x = 32768 - (b * b + c * c >> 16)
    y = c + (a * b >> 16)
    z = (a * c >> 16) - b
    gy = r10 * x + r11 * y + r12 * z >> 15
    gx = r00 * x + r01 * y + r02 * z >> 15

    # roll = atan2(j, k), pitch = atan2(-i, |j, k|), yaw = atan2(gy, gx): attitude.fixed.intmath
    y = j
    x = k
    n = _ROLL
    while True:
        a = (y ^ y >> 31) - (y >> 31)
        b = (x ^ x >> 31) - (x >> 31)
        steep = a > b
        if steep:
            t = b
            b = a
            a = t
        m = 0
        u = 0
        if b:
            t = ((a << 15) + (b >> 1)) // b
            u = t * t >> 15
            f = 4777 * u >> 15
            f = (f - 19516) * u >> 15
            f = (f + 41289) * u >> 15
            f = (f - 75700) * u + 16384 >> 15
            m = t * 57288 + (t * f >> 2) + 16384 >> 15
            if steep:
                m = 90000 - m
            if x < 0:
                m = 180000 - m
            if y < 0:
                m = 0 - m
        s[n] = m
        if n == _YAW:
            break
        if n == _ROLL:
            f = 726 * u >> 15
            f = (3039 - f) * u >> 15
            f = (f - 7911) * u >> 15
            f = (f + 32744) * u + 16384 >> 15
            x = b + (b * f + 32768 >> 16)
            y = 0 - i
        else:
            y = gy
            x = gx
        n += 1

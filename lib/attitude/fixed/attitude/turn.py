# SPDX-License-Identifier: MIT
"""The integer attitude over a gap without samples: turned on with what the gyro said around it.

Without the accelerometer, from where keep() was called, so that a gap may be bridged again and
again while it grows and once more when its end is known. Places and formats: this folder's
__init__. Nothing is allocated; the cost grows with the angle, by a step for each 14 degrees.
"""

import micropython
from micropython import const

from attitude.fixed.intmath import atan2_mdeg, hypot

_GYRO_SHIFT = const(24)
_LAG_PRE = const(29)
_LAG = const(30)
_LAG_POST = const(31)
_ONE = const(32)
_YOUNG = const(47)
_W = const(76)
_X = const(77)
_Y = const(78)
_Z = const(79)
_TRIM = const(166)
_LAST = const(167)
_BIAS = const(81)
_ROLL = const(155)
_USED = const(84)
_YAW = const(157)
_COUNT = const(182)
_SUM = const(185)
_AGE = const(208)
_EVENT = const(221)
_HIDDEN = const(363)
_SEEN_US = const(20000)  # over which a straight line is as good as samples
_MOST_HIDDEN = const(8579)  # 15 degrees, Q15
_STEPS = const(128)  # at most: a second at 2000 deg/s, 16 degrees each


@micropython.viper
def keep(self):
    """Remember the attitude: the next turn() begins here."""
    s = ptr32(self._s)
    kept = ptr32(self._kept)
    kept[0] = s[_W]
    kept[1] = s[_X]
    kept[2] = s[_Y]
    kept[3] = s[_Z]


@micropython.viper
def turn(self, before: ptr16, after: ptr16, dt_us: int):
    """Turn on from keep() by dt_us (1 to 1000000), the rate going from that of the counts
    `before` to that of `after` in a straight line. The angles are those of then.
    """
    s = ptr32(self._s)
    kept = ptr32(self._kept)
    clock = ptr32(self._clock)
    period16 = clock[0]  # inc is for a sample at the nominal rate
    s[_W] = kept[0]
    s[_X] = kept[1]
    s[_Y] = kept[2]
    s[_Z] = kept[3]
    # inc before to 4-6, their way to inc after to 7-9; the largest of all six
    most = 0
    change = 0
    row = 0
    while row < 3:
        at = _USED + 3 * row
        bias = s[_BIAS + row] >> 8
        x = (int(before[4]) ^ 0x8000) - 0x8000
        y = (int(before[5]) ^ 0x8000) - 0x8000
        z = (int(before[6]) ^ 0x8000) - 0x8000
        first = s[at] * x + s[at + 1] * y + s[at + 2] * z + s[_USED + 9 + row]
        first = (first >> s[_GYRO_SHIFT]) - bias
        x = (int(after[4]) ^ 0x8000) - 0x8000
        y = (int(after[5]) ^ 0x8000) - 0x8000
        z = (int(after[6]) ^ 0x8000) - 0x8000
        last = s[at] * x + s[at + 1] * y + s[at + 2] * z + s[_USED + 9 + row]
        last = (last >> s[_GYRO_SHIFT]) - bias
        kept[4 + row] = first
        kept[7 + row] = last - first
        s[_LAST + row] = last
        x = last - first
        x ^= x >> 31
        if x > change:
            change = x
        first ^= first >> 31
        last ^= last >> 31
        if first > most:
            most = first
        if last > most:
            most = last
        row += 1
    # steps of at most 1/8 rad of half angle; r: periods in a step, Q10
    t = (dt_us << 8) // period16
    n = 1 + ((most >> 14) * t >> 16)
    s[_EVENT] |= 32  # what nobody has seen teaches nothing
    if dt_us > _SEEN_US:  # and may hide some of its turn, more of one that changes
        s[_EVENT] |= 128
        f = (dt_us << 4) // period16
        k = ((most >> 14) * f >> 5) + ((change >> 14) * f >> 3)
        s[_HIDDEN] = k if k < _MOST_HIDDEN else _MOST_HIDDEN
        if s[_AGE] < s[_YOUNG]:  # the mean levels: nothing of before the gap is in it
            s[_COUNT] = 0
            row = _SUM
            while row < _SUM + 6:
                s[row] = 0
                row += 1
    if n > _STEPS:
        n = _STEPS
    r = ((dt_us << 4) // n << 6) // (period16 >> 4)
    k = 0
    while k < n:
        f = (2 * k + 1 << 13) // n  # where the step's middle is, Q14
        row = 4
        while row < 7:
            x = kept[3 + row]
            x = kept[row] + (x >> 14) * f + ((x & 0x3FFF) * f >> 14)
            kept[6 + row] = ((x >> 10) * r << 1) + ((x & 0x3FF) * r >> 9) + 16384 >> 15
            row += 1
        # Q15 from here: sin|v| / |v| and cos|v| of the half angle v, to the fifth order
        x = kept[10]
        y = kept[11]
        z = kept[12]
        t = x * x + y * y + z * z >> 15
        u = t * t >> 15
        f = 32768 - t // 6 + u // 120
        c = 32768 - (t >> 1) + u // 24
        x = x * f >> 15
        y = y * f >> 15
        z = z * f >> 15
        wh = s[_W] + 16384 >> 15
        ih = s[_X] + 16384 >> 15
        jh = s[_Y] + 16384 >> 15
        kh = s[_Z] + 16384 >> 15
        c -= 32768  # q itself keeps all of its bits
        s[_W] += wh * c - ih * x - jh * y - kh * z
        s[_X] += wh * x + ih * c + jh * z - kh * y
        s[_Y] += wh * y + jh * c + kh * x - ih * z
        s[_Z] += wh * z + kh * c + ih * y - jh * x
        k += 1
    wh = s[_W] + 16384 >> 15
    ih = s[_X] + 16384 >> 15
    jh = s[_Y] + 16384 >> 15
    kh = s[_Z] + 16384 >> 15
    s[_TRIM] = (wh * wh + ih * ih + jh * jh + kh * kh - s[_ONE]) >> 13
    # the angles are for then and lag_s more: half of that turn, Q15
    t = s[_LAG]
    m = s[_LAG_PRE]
    n = s[_LAG_POST] + 1
    x = (s[_LAST] >> m) * t >> n
    y = (s[_LAST + 1] >> m) * t >> n
    z = (s[_LAST + 2] >> m) * t >> n
    u = wh - (ih * x + jh * y + kh * z >> 15)
    r = ih + (wh * x + jh * z - kh * y >> 15)
    c = jh + (wh * y + kh * x - ih * z >> 15)
    f = kh + (wh * z + ih * y - jh * x >> 15)
    x = (r * f >> 15) - (u * c >> 15)  # half of the vertical in the sensor's frame, Q15
    y = (c * f >> 15) + (u * r >> 15)
    z = (u * u - r * r - c * c + f * f) >> 16
    s[_ROLL] = int(atan2_mdeg(y, z))
    s[_ROLL + 1] = int(atan2_mdeg(0 - x, int(hypot(y, z))))
    y = (r * c >> 15) + (u * f >> 15)
    x = (u * u + r * r - c * c - f * f) >> 16
    s[_YAW] = int(atan2_mdeg(y, x))

# SPDX-License-Identifier: MIT
"""KalmanTilt2 in an interrupt: its step, one viper function, since a call costs a quarter of the
filter; and its way over a gap.

Places in the working array; those up to 27 are base's. Angles are in "units" of 1/2048
millidegree: 180 degrees are 2^28.5 and the difference of two angles fits. Rates are units per
sample at the nominal rate, biases 1/64 of that.
"""

import micropython
from micropython import const

_GYRO_SHIFT = const(24)
_STEP = const(25)
_RATE = const(26)
_RATE_SHIFT = const(27)
_K0_SHIFT = const(28)
_K1_SHIFT = const(29)
_BIAS_LIMIT = const(30)
_DISTRUST = const(31)  # Q15 weight lost for every 1/256 count that |a| is off 1 g
_ONE_G = const(32)
_SEQ = const(33)
_STARTED = const(34)
_ROLL = const(35)
_ROLL_BIAS = const(36)
_PITCH = const(37)
_YAW_BIAS = const(39)  # as taken over from another filter: not learned here
_ROLL_MEASURED = const(40)
_PITCH_MEASURED = const(41)
_OUT = const(42)
_RATES = const(45)
_FORCE = const(48)
_LEFT = const(52)  # the place in the gain table: samples left in this row
_ROW = const(53)
_K0 = const(54)  # gains times 2^(30 + shift), and their change per sample
_K1 = const(55)
_D0 = const(56)
_D1 = const(57)


@micropython.viper
def step(self, counts: ptr16):
    """One sample: counts as the sensor gives them, ax ay az temp gx gy gz (int16)."""
    s = ptr32(self._s)
    ax = (int(counts[0]) ^ 0x8000) - 0x8000
    ay = (int(counts[1]) ^ 0x8000) - 0x8000
    az = (int(counts[2]) ^ 0x8000) - 0x8000
    forward = (s[0] * ax + s[1] * ay + s[2] * az + s[9]) >> 14
    y = (s[3] * ax + s[4] * ay + s[5] * az + s[10]) >> 14
    x = (s[6] * ax + s[7] * ay + s[8] * az + s[11]) >> 14
    s[_FORCE] = forward
    s[_FORCE + 1] = y
    s[_FORCE + 2] = x

    # roll = atan2(ay, az), pitch = atan2(-ax, |ay, az|), |a|: attitude.fixed.intmath
    at = _ROLL_MEASURED
    while True:
        a = y if y >= 0 else 0 - y
        b = x if x >= 0 else 0 - x
        steep = a > b
        if steep:
            t = b
            b = a
            a = t
        m = 0
        if b:
            t = ((a << 15) + (b >> 1)) // b
            u = (t * t) >> 15
            r = 4777 * u >> 15
            r = (r - 19516) * u >> 15
            r = (r + 41289) * u >> 15
            r = (r - 75700) * u + 16384 >> 15
            m = t * 57288 + (t * r >> 2) >> 4
            if steep:
                m = 184320000 - m
            if x < 0:
                m = 368640000 - m
            if y < 0:
                m = 0 - m
            r = 726 * u >> 15
            r = (3039 - r) * u >> 15
            r = (r - 7911) * u >> 15
            r = (r + 32744) * u + 16384 >> 15
            b += (b * r + 32768) >> 16
        s[at] = m
        if at == _PITCH_MEASURED:
            break
        at = _PITCH_MEASURED
        y = 0 - forward
        x = b

    # gains of this sample
    k0 = s[_K0]
    k1 = s[_K1]
    left = s[_LEFT]
    if left:
        s[_K0] = k0 + s[_D0]
        s[_K1] = k1 + s[_D1]
        left -= 1
        if left == 0:
            row = s[_ROW] + 3
            s[_ROW] = row
            left = s[row]
            s[_D0] = s[row + 1]
            s[_D1] = s[row + 2]
        s[_LEFT] = left
    period = s[_STEP]
    k0 = (k0 >> 15) * period >> 15
    k1 = (k1 >> 15) * period >> 15
    if b == 0:  # free fall, or no sensor: a vector without direction corrects nothing
        k0 = 0
        k1 = 0
    elif s[_DISTRUST]:
        b -= s[_ONE_G]
        if b < 0:
            b = 0 - b
        b = 32768 - (b * s[_DISTRUST] >> 8)
        if b < 0:
            b = 0
        k0 = k0 * b >> 15
        k1 = k1 * b >> 15

    ax = (int(counts[4]) ^ 0x8000) - 0x8000
    ay = (int(counts[5]) ^ 0x8000) - 0x8000
    az = (int(counts[6]) ^ 0x8000) - 0x8000
    left = s[_GYRO_SHIFT]
    y = (s[12] * ax + s[13] * ay + s[14] * az + s[21]) >> left
    x = (s[15] * ax + s[16] * ay + s[17] * az + s[22]) >> left
    t = ((s[18] * ax + s[19] * ay + s[20] * az + s[23]) >> left) - (s[_YAW_BIAS] >> 6)
    row = s[_RATE]
    left = s[_RATE_SHIFT]
    s[_RATES + 2] = (t >> 15) * row + ((t & 0x7FFF) * row >> 15) >> left
    if s[_STARTED] == 0:
        s[_STARTED] = 1
        s[_ROLL] = s[_ROLL_MEASURED]
        s[_PITCH] = s[_PITCH_MEASURED]
    at = _ROLL
    rate = _RATES
    m = s[_ROLL_MEASURED]
    while True:
        u = s[at + 1]
        t = y - (u >> 6)
        r = t & 0x7FFF
        t >>= 15
        s[rate] = t * row + (r * row >> 15) >> left
        a = s[at] + t * period + (r * period >> 15)
        t = m - a
        if t > 368640000:
            t -= 737280000
        elif t < -368640000:
            t += 737280000
        r = t & 0x7FFF
        t >>= 15
        a += (t * k0 + (r * k0 >> 15)) >> s[_K0_SHIFT]
        if a > 368640000:
            a -= 737280000
        elif a < -368640000:
            a += 737280000
        s[at] = a
        u += (t * k1 + (r * k1 >> 15)) >> s[_K1_SHIFT]
        if u > s[_BIAS_LIMIT]:
            u = s[_BIAS_LIMIT]
        elif u < 0 - s[_BIAS_LIMIT]:
            u = 0 - s[_BIAS_LIMIT]
        s[at + 1] = u
        if at == _PITCH:
            break
        at = _PITCH
        rate += 1
        m = s[_PITCH_MEASURED]
        y = x
    s[_OUT] = (s[_ROLL] + 1024) >> 11
    s[_OUT + 1] = (a + 1024) >> 11
    s[_SEQ] = (s[_SEQ] + 1) & 0x3FFFFFFF


@micropython.viper
def keep(self):
    """Remember the angles: the next turn() begins here."""
    s = ptr32(self._s)
    kept = ptr32(self._kept)
    kept[0] = s[_ROLL]
    kept[1] = s[_PITCH]


@micropython.viper
def turn(self, before: ptr16, after: ptr16, dt_us: int):
    """Turn on from keep() by dt_us (1 to 1000000), without the accelerometer, with the mean
    of the rates of the counts `before` and `after`."""
    s = ptr32(self._s)
    kept = ptr32(self._kept)
    clock = ptr32(self._clock)
    r = (dt_us << 8) // clock[0]  # in sixteenths of a sample at the nominal rate
    axis = 0
    while axis < 2:
        at = 12 + 3 * axis
        rate = 0 - (s[_ROLL_BIAS + 2 * axis] >> 6)
        half = 0
        i = 0
        while i < 3:
            half += s[at + i] * (
                ((int(before[4 + i]) ^ 0x8000) + (int(after[4 + i]) ^ 0x8000) >> 1) - 0x8000
            )
            i += 1
        rate += (half + s[21 + axis]) >> s[_GYRO_SHIFT]
        part = (rate >> 10) * r + ((rate & 0x3FF) * r >> 10)  # a 64th of the way
        angle = kept[axis]
        i = 64
        while i:
            angle += part
            if angle > 368640000:
                angle -= 737280000
            elif angle < -368640000:
                angle += 737280000
            i -= 1
        s[_ROLL + 2 * axis] = angle
        s[_OUT + axis] = (angle + 1024) >> 11
        axis += 1

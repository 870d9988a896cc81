# SPDX-License-Identifier: MIT
"""KalmanTilt for roll and pitch in one viper call, from raw counts, without allocation."""

import micropython
from micropython import const

from attitude.fixed.base import Fixed
from attitude.fixed.folding import check_rate
from attitude.fixed.gains import gain_rows

# Places in the working array; 0 to 11 are the accelerometer's coefficients, 12 to 19 the gyro's
# of x and y. Angles are in "units" of 1/2048 millidegree: 180 degrees are 2^28.5 and the
# difference of two angles fits. Biases are in 1/64 unit per sample.
_GYRO_SHIFT = const(20)
_K0_SHIFT = const(21)
_K1_SHIFT = const(22)
_BIAS_LIMIT = const(23)
_DISTRUST = const(24)  # Q15 weight lost for every 1/256 count that |a| is off 1 g
_ONE_G = const(25)
_ROLL_MEASURED = const(26)
_PITCH_MEASURED = const(27)
_STATE = const(28)  # from here on what samples change
_LEFT = const(28)  # samples left in this row of the gain table
_ROW = const(29)
_K0 = const(30)  # gains times 2^(30 + shift), and their change per sample
_K1 = const(31)
_D0 = const(32)
_D1 = const(33)
_STARTED = const(34)
_ROLL = const(35)
_ROLL_BIAS = const(36)
_PITCH = const(37)
_PITCH_BIAS = const(38)
_ROLL_MDEG = const(39)  # the angles in whole millidegrees
_PITCH_MDEG = const(40)
_TABLE = const(41)


class KalmanTilt2(Fixed):
    """Roll and pitch in millidegrees; the integer twin of two KalmanTilt on one sensor.

    rate_hz: any real rate; gyro_dps, accel_g: the ranges that the counts come in.
    q_angle (deg^2/s), q_bias ((deg/s)^2/s), r_measure (deg^2): paper 000, eqs. 16-27. The
    covariance does not depend on the data, so the gains are made at construction.
    trust_g: the accelerometer's weight falls linearly from 1 at |a| = 1 g to 0 at 1 g +-
    trust_g, a measurement noise that adapts to pushes and knocks; None: always 1. Against motors
    it makes things worse: put a LowPass or AdaptiveNotch ahead (figures: tools/vibration.py).
    It starts on the first sample's accelerometer angle. Motion about one axis at a time.
    """

    _gyro_rows = 2
    _unit_per_deg = 2048000.0
    _shift_at = _GYRO_SHIFT
    _state_at = _STATE
    _state_end = _TABLE
    _angles_at = _ROLL_MDEG

    def __init__(
        self,
        rate_hz=250,
        gyro_dps=500,
        accel_g=8,
        q_angle=0.001,
        q_bias=0.003,
        r_measure=0.03,
        trust_g=None,
    ):
        check_rate(rate_hz, gyro_dps)
        rows, shift0, shift1 = gain_rows(rate_hz, q_angle, q_bias, r_measure)
        super().__init__(rate_hz, gyro_dps, accel_g, _TABLE + len(rows))
        s = self._s
        for i, value in enumerate(rows):
            s[_TABLE + i] = value
        s[_K0_SHIFT] = shift0
        s[_K1_SHIFT] = shift1
        s[_BIAS_LIMIT] = 1073000000  # 8186 millidegrees a sample: the number range, no judgement
        s[_ONE_G] = self._accel_lsb
        if trust_g is not None:
            s[_DISTRUST] = max(1, int(32768.0 * 256.0 / (trust_g * self._accel_lsb)))
        self.reset()

    def reset(self):
        """Start anew on the next sample, with bias 0."""
        s = self._s
        for i in range(_STATE, _TABLE):
            s[i] = 0
        s[_K0], s[_K1], s[_LEFT], s[_D0], s[_D1] = s[_TABLE : _TABLE + 5]
        s[_ROW] = _TABLE + 2

    def relevel(self):
        """Start at the accelerometer's angles of the next sample; the bias stays."""
        self._s[_STARTED] = 0

    def go_on_from(self, other):
        """Continue from the angles and biases of another one, with own gains from their start."""
        for i in range(_STARTED, _TABLE):
            self._s[i] = other._s[i]

    @micropython.viper
    def update(self, counts: ptr16):
        """One sample: counts as the sensor gives them, ax ay az temp gx gy gz (int16)."""
        s = ptr32(self._s)
        ax = (int(counts[0]) ^ 0x8000) - 0x8000
        ay = (int(counts[1]) ^ 0x8000) - 0x8000
        az = (int(counts[2]) ^ 0x8000) - 0x8000
        forward = (s[0] * ax + s[1] * ay + s[2] * az + s[9]) >> 14
        y = (s[3] * ax + s[4] * ay + s[5] * az + s[10]) >> 14
        x = (s[6] * ax + s[7] * ay + s[8] * az + s[11]) >> 14

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
        k0 >>= 15
        k1 >>= 15
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
        y = (s[12] * ax + s[13] * ay + s[14] * az + s[18]) >> s[_GYRO_SHIFT]
        x = (s[15] * ax + s[16] * ay + s[17] * az + s[19]) >> s[_GYRO_SHIFT]
        if s[_STARTED] == 0:
            s[_STARTED] = 1
            s[_ROLL] = s[_ROLL_MEASURED]
            s[_PITCH] = s[_PITCH_MEASURED]
        at = _ROLL
        m = s[_ROLL_MEASURED]
        while True:
            u = s[at + 1]
            a = s[at] + y - (u >> 6)
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
            m = s[_PITCH_MEASURED]
            y = x
        s[_ROLL_MDEG] = (s[_ROLL] + 1024) >> 11
        s[_PITCH_MDEG] = (a + 1024) >> 11

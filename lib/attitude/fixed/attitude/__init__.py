# SPDX-License-Identifier: MIT
"""The integer twin of attitude.Attitude: one viper call from raw counts to millidegrees."""

from math import sqrt

from micropython import const

from attitude.fixed.attitude.coefficients import set_up
from attitude.fixed.attitude.step import step
from attitude.fixed.base import Fixed

# places and formats: step and slow
_GYRO_SHIFT = const(24)
_LAG_PRE = const(26)
_LAG = const(27)
_LAG_POST = const(28)
_STATE = const(30)
_W = const(34)
_LAST = const(39)
_BIAS = const(42)
_ROLL = const(60)
_YAW = const(62)
_STILL = const(80)
_STATE_END = const(105)
_REST = const(113)
_SIZE = const(128)
# what a gap leaves: the quaternion, the bias, the bias as seen at rest, and what is known of it
_KEPT = ((34, 38), (42, 45), (69, 75), (81, 84), (85, 86))


class Attitude(Fixed):
    """Roll, pitch and relative yaw in millidegrees for free motion, from raw counts.

    rate_hz: any real rate, 80 to 1000; gyro_dps, accel_g: the ranges that the counts come in.
    Further settings by name, as for the float Attitude: tau_s, fast_dps, rest_tau_s, bias_tau_s,
    rest_bias_s, rest_s, rest_gyro_dps, rest_accel_g, bias_limit_dps, start_bias_dps, lag_s.
    The algorithm is described there. The angles are ready when update() returns.
    """

    _gyro_rows = 3
    _unit_per_deg = 4685077.9  # 2^30 / 4 in radians
    _shift_at = _GYRO_SHIFT
    _state_at = _STATE
    _state_end = _STATE_END
    _angles_at = _ROLL
    _least_hz = 40  # so that a block of samples is no longer than 25 ms

    def __init__(self, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
        super().__init__(rate_hz, gyro_dps, accel_g, _SIZE)
        set_up(self._s, rate_hz, gyro_dps, accel_g, **settings)
        self._start = self.state()

    update = step

    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        self.set_state(self._start)

    def relevel(self):
        """After a gap: the next samples level anew; yaw and what is known of the bias stay."""
        s = self._s
        kept = tuple(s)
        self.reset()
        for first, end in _KEPT:
            for i in range(first, end):
                s[i] = kept[i]

    @property
    def yaw_mdeg(self):
        """Rotation about the vertical since the start, millidegrees, -180000 to 180000."""
        return self._s[_YAW]

    @property
    def at_rest(self):
        """True when it has stood still for rest_s."""
        return self._s[_STILL] >= self._s[_REST]

    @property
    def bias_dps(self):
        """Gyro bias as estimated on top of the calibration, deg/s (makes floats)."""
        scale = self.rate_hz / (self._unit_per_deg * 256.0)
        return tuple([b * scale for b in self._s[_BIAS : _BIAS + 3]])

    def quaternion(self):
        """(w, x, y, z), sensor to earth, for now: turned on by lag_s at the last rate (floats)."""
        s = self._s
        w, x, y, z = [v / 1073741824.0 for v in s[_W : _W + 4]]
        half = s[_LAG] / (1 << s[_LAG_PRE]) / (1 << s[_LAG_POST]) / 65536.0
        a, b, c = [v * half for v in s[_LAST : _LAST + 3]]
        w, x, y, z = (
            w - x * a - y * b - z * c,
            x + w * a + y * c - z * b,
            y + w * b + z * a - x * c,
            z + w * c + x * b - y * a,
        )
        n = sqrt(w * w + x * x + y * y + z * z)
        return (w / n, x / n, y / n, z / n)

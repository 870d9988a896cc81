# SPDX-License-Identifier: MIT
"""Six-axis attitude for free motion in any orientation.

The gyro is integrated strap-down (trapezoid rule). What the accelerometer reads, turned into the
earth frame, must be gravity plus the derivative of a bounded velocity, itself the derivative of a
bounded position. So the level part of it is integrated twice with a leak, and the position that
should not be there turns the attitude: a third-order low-pass in the nearly inertial frame that
never needs to throw a sample away, because an impact that is caught is also an impact that ends.
Only saturation breaks that balance, and then the velocity is forgotten.

The anchor to compare with is VQF (Laidig and Seel, Information Fusion 91, 2023): same frame,
second order, accelerometer corrected at once, bias by a Kalman filter where this has fixed gains.
"""

from math import atan2, cos, degrees, radians, sin, sqrt

from .quaternion import levelling, product, rotate, rotate_back, unit

_LEAK = 2.0  # of position and velocity: the Butterworth polynomial s^3 + 2 s^2 + 2 s + 1
_RAMP = 2.0  # gain times age at start: an error halves whenever the age does not quite double
_RAMP_START_S = 0.1
_OVER_RANGE_AGE_S = 1.0  # a saturated gyro makes the filter this young again
_LOST_S = 2.0
_MIN_G = 0.5  # less is free fall or no sensor: it has no direction


class Attitude:
    """Roll, pitch and relative yaw in degrees from gyro (deg/s) and accelerometer (g).

    rate_hz         nominal sample rate (the true dt is given with each sample)
    tau_s           time constant of the accelerometer's correction, in motion
    rest_tau_s      the same while resting
    bias_tau_s      time constant of the gyro bias learned in motion
    rest_bias_s     averaging time of the gyro bias at rest
    rest_s          how long it must be still before it counts as rest
    rest_gyro_dps, rest_accel_g   largest deviation from the half-second mean that is still
    bias_limit_dps  bias change that is believed; a steady rate beyond it is motion, not bias
    start_bias_dps  the same before the first rest (datasheet: +-20 deg/s from the factory)
    lag_s           delay of the samples: the angles are for now, not for then. 4.8 ms is the
                    MPU6050 at dlpf_hz=44 (PS-MPU-6000A table of DLPF_CFG)
    gyro_range_dps, accel_range_g   where the sensor saturates
    """

    def __init__(self, rate_hz=250.0, tau_s=1.4, rest_tau_s=0.5, bias_tau_s=60.0, rest_bias_s=6.0,
                 rest_s=1.5, rest_gyro_dps=1.0, rest_accel_g=0.04, bias_limit_dps=2.0,
                 start_bias_dps=20.0, lag_s=0.0048, gyro_range_dps=2000.0, accel_range_g=16.0):
        if rate_hz <= 0 or tau_s <= 0 or rest_tau_s <= 0 or bias_tau_s <= 0 or rest_bias_s <= 0:
            raise ValueError("rate_hz and the time constants must be positive")
        # settings
        self.rate_hz = rate_hz
        self.tau_s = tau_s
        self.rest_tau_s = rest_tau_s
        self.bias_tau_s = bias_tau_s
        self.rest_bias_s = rest_bias_s
        self.rest_s = rest_s
        self.rest_gyro_dps = rest_gyro_dps
        self.rest_accel_g = rest_accel_g
        self.bias_limit_dps = bias_limit_dps
        self.start_bias_dps = start_bias_dps
        self.lag_s = lag_s
        self.gyro_range_dps = gyro_range_dps
        self.accel_range_g = accel_range_g
        # coefficients
        self._block_n = max(1, int(rate_hz * 0.02 + 0.5))  # the slow part runs at about 50 Hz
        self._mean_s = 0.5
        self._accel_stop_g = accel_range_g * 0.9995
        self._gyro_stop_dps = gyro_range_dps * 0.9995
        self.reset()

    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        self._q = (1.0, 0.0, 0.0, 0.0)  # sensor to earth
        self._rate = (0.0, 0.0, 0.0)  # deg/s of the last sample, bias removed
        self._accel = (0.0, 0.0, 1.0)
        self._vx = self._vy = 0.0  # velocity and position that should not be there, both scaled
        self._px = self._py = 0.0  # to g by powers of the gain
        self._gain = 1.0 / _RAMP_START_S * _RAMP  # rad/s
        self._levelled = False
        self._age_s = 0.0
        self._bias = [0.0, 0.0, 0.0]
        self._home = [0.0, 0.0, 0.0]  # the bias as last seen at rest
        self._learned = False  # has been at rest once
        self._moved = False
        self._still_s = self._resting_s = 0.0
        self._n = 0
        self._sum = [0.0] * 6  # of the block: gyro, accelerometer
        self._block_s = 0.0
        self._mean = None  # of the last half second: gyro, accelerometer
        self._up = [0.0, 0.0, 0.0]  # accelerometer in the earth frame, summed for the lost check
        self._up_s = 0.0

    def update(self, gx_dps, gy_dps, gz_dps, ax_g, ay_g, az_g, dt_s=None):
        """Take one sample; dt_s is the time since the one before (default 1 / rate_hz)."""
        if dt_s is None:
            dt_s = 1.0 / self.rate_hz
        self._accel = (ax_g, ay_g, az_g)
        total = self._sum
        total[0] += gx_dps
        total[1] += gy_dps
        total[2] += gz_dps
        total[3] += ax_g
        total[4] += ay_g
        total[5] += az_g
        self._turn(gx_dps, gy_dps, gz_dps, dt_s)
        if not self._levelled:
            if ax_g * ax_g + ay_g * ay_g + az_g * az_g > _MIN_G * _MIN_G:
                self._level(rotate(self._q, ax_g, ay_g, az_g))
                self._levelled = True
        self._correct(ax_g, ay_g, az_g, dt_s)
        self._block_s += dt_s
        self._n += 1
        if self._n >= self._block_n:
            self._slow()

    def _turn(self, gx, gy, gz, dt_s):
        """Strap-down integration, trapezoid rule."""
        stop = self._gyro_stop_dps
        if abs(gx) >= stop or abs(gy) >= stop or abs(gz) >= stop:
            self._age_s = min(self._age_s, _OVER_RANGE_AGE_S)
            self._gain = max(self._gain, _RAMP / (self._age_s + _RAMP_START_S))
        bx, by, bz = self._bias
        gx -= bx
        gy -= by
        gz -= bz
        lx, ly, lz = self._rate if self._mean else (gx, gy, gz)
        self._rate = (gx, gy, gz)
        half = radians(0.25 * dt_s)
        x = (gx + lx) * half
        y = (gy + ly) * half
        z = (gz + lz) * half
        angle = sqrt(x * x + y * y + z * z)
        if angle > 1e-9:
            s = sin(angle) / angle
            self._q = product(self._q, (cos(angle), x * s, y * s, z * s))

    def _correct(self, ax, ay, az, dt_s):
        """Turn the attitude so that the level acceleration integrates to no position."""
        k = min(self._gain * dt_s, 0.25)  # more would not be stable
        stop = self._accel_stop_g
        if abs(ax) >= stop or abs(ay) >= stop or abs(az) >= stop:
            ex = ey = self._vx = self._vy = 0.0
        else:
            ex, ey, _ = rotate(self._q, ax, ay, az)
        self._vx += k * (ex - _LEAK * self._px)
        self._vy += k * (ey - _LEAK * self._py)
        self._px += k * (self._vx - _LEAK * self._px)
        self._py += k * (self._vy - _LEAK * self._py)
        q = product((1.0, 0.5 * k * self._py, -0.5 * k * self._px, 0.0), self._q)
        self._q = unit(q)

    def _slow(self):
        """Once per block: rest, bias, gain, and whether the attitude is lost."""
        now = [x / self._n for x in self._sum]
        span = self._block_s
        self._sum = [0.0] * 6
        self._n = 0
        self._block_s = 0.0
        self._age_s += span
        if self._is_still(now, span):
            self._still_s += span
        else:
            self._still_s = 0.0
            self._moved = True
        in_motion = 1.0 / self.tau_s
        gain = max(in_motion, _RAMP / (self._age_s + _RAMP_START_S))
        if self.at_rest:
            self._learn_at_rest(now, span)
            gain = max(gain, 1.0 / self.rest_tau_s)
        elif gain == in_motion:
            self._learn_in_motion(span)
        self._gain = gain
        self._check_lost(now, span)

    def _is_still(self, now, span):
        """Whether gyro and accelerometer stay at their mean, and the gyro near its bias."""
        if self._mean is None:
            self._mean = list(now)
        mean = self._mean
        k = min(1.0, span / self._mean_s)
        limit = self.bias_limit_dps if self._learned else self.start_bias_dps
        still = True
        for i in range(6):
            mean[i] += k * (now[i] - mean[i])
            if abs(now[i] - mean[i]) > (self.rest_gyro_dps if i < 3 else self.rest_accel_g):
                still = False
            if i < 3 and abs(now[i] - self._home[i]) > limit:
                still = False
        return still

    def _learn_at_rest(self, now, span):
        self._home = self._mean[:3]
        self._resting_s = min(self._resting_s + span, self.rest_bias_s)
        if not self._learned:
            self._learned = True
            self._bias = self._mean[:3]
            if not self._moved:  # has stood still since power-on: start again without the bias
                self._q = (1.0, 0.0, 0.0, 0.0)
                self._level(self._mean[3:])
        k = min(1.0, span / self._resting_s)
        for i in range(3):
            self._bias[i] += k * (now[i] - self._bias[i])

    def _learn_in_motion(self, span):
        """What has to be corrected again and again is bias: the correction, seen by the sensor."""
        limit = self.bias_limit_dps if self._learned else self.start_bias_dps
        k = degrees(span / (self.tau_s * self.bias_tau_s))
        seen = rotate_back(self._q, self._py, -self._px, 0.0)
        for i in range(3):
            home = self._home[i]
            bias = self._bias[i] - k * seen[i]
            self._bias[i] = max(home - limit, min(home + limit, bias))

    def _check_lost(self, now, span):
        """More than 45 degrees wrong over seconds is no acceleration: level anew."""
        up = self._up
        x, y, z = rotate(self._q, now[3], now[4], now[5])
        up[0] += x * span
        up[1] += y * span
        up[2] += z * span
        self._up_s += span
        if self._up_s >= _LOST_S:
            level = up[0] * up[0] + up[1] * up[1]
            enough = _MIN_G * self._up_s
            if level + up[2] * up[2] > enough * enough and (up[2] < 0 or level > up[2] * up[2]):
                self._level(up)
                self._age_s = 0.0
            self._up = [0.0, 0.0, 0.0]
            self._up_s = 0.0

    def _level(self, up):
        """Turn the attitude the short way so that this earth vector points up."""
        self._q = unit(product(levelling(*up), self._q))
        self._vx = self._vy = self._px = self._py = 0.0

    @property
    def at_rest(self):
        """True when it has stood still for rest_s."""
        return self._still_s >= self.rest_s

    @property
    def bias_dps(self):
        """Gyro bias as estimated, deg/s."""
        return tuple(self._bias)

    def quaternion(self):
        """(w, x, y, z), sensor to earth, for now: turned on by lag_s at the last rate."""
        half = radians(0.5 * self.lag_s)
        x, y, z = self._rate
        return unit(product(self._q, (1.0, x * half, y * half, z * half)))

    def gravity(self):
        """Unit vector in sensor axes that points up: what it reads at rest in this attitude, g."""
        return rotate_back(self.quaternion(), 0.0, 0.0, 1.0)

    def linear_accel_g(self):
        """Acceleration without gravity in sensor axes, g, at the instant of the last sample."""
        x, y, z = rotate_back(self._q, 0.0, 0.0, 1.0)
        ax, ay, az = self._accel
        return (ax - x, ay - y, az - z)

    @property
    def roll_deg(self):
        """Rotation about x, -180 to 180 degrees."""
        _, y, z = self.gravity()
        return degrees(atan2(y, z))

    @property
    def pitch_deg(self):
        """Rotation about y, -90 to 90 degrees."""
        x, y, z = self.gravity()
        return degrees(atan2(-x, sqrt(y * y + z * z)))

    @property
    def yaw_deg(self):
        """Rotation about the vertical since the start, -180 to 180 degrees."""
        w, x, y, z = self.quaternion()
        return degrees(atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))

    def state(self):
        """All that changes from sample to sample, for set_state()."""
        return (self._q, self._rate, self._accel, self._vx, self._vy, self._px, self._py,
                self._gain, self._levelled, self._age_s, tuple(self._bias), tuple(self._home),
                self._learned, self._moved, self._still_s, self._resting_s, self._n,
                tuple(self._sum), self._block_s, self._mean and tuple(self._mean),
                tuple(self._up), self._up_s)

    def set_state(self, state):
        """Go on from a state() of a filter with the same settings."""
        (self._q, self._rate, self._accel, self._vx, self._vy, self._px, self._py,
         self._gain, self._levelled, self._age_s, bias, home,
         self._learned, self._moved, self._still_s, self._resting_s, self._n,
         total, self._block_s, mean, up, self._up_s) = state
        self._bias = list(bias)
        self._home = list(home)
        self._sum = list(total)
        self._mean = mean and list(mean)
        self._up = list(up)

# SPDX-License-Identifier: MIT
"""Six-axis attitude for free motion in any orientation.

The gyro is integrated strap-down. What the accelerometer reads, turned into the earth frame, is
gravity plus the derivative of a velocity that is bounded, itself the derivative of a position
that is bounded. So its level part is integrated twice, with a leak, and the position that should
not be there turns the attitude: a third-order low-pass in the nearly inertial frame. No sample is
thrown away for being large: what an impact adds, the same impact takes back. Only a saturated
sample breaks that balance, and then the velocity is forgotten.

The anchor to compare with is VQF (Laidig and Seel, Information Fusion 91, 2023): it low-passes in
the same frame with second order and learns the bias with a Kalman filter; this has fixed gains.
"""

from math import cos, degrees, radians, sin, sqrt

from .bias_view import BiasView
from .gyro_bias import GyroBias
from .level_loop import LevelLoop
from .quaternion import Orientation, levelling, product, rotate, rotate_back, unit, without_yaw

_BLOCK_S, _SPEED_S, _LOST_S = 0.02, 3.0, 2.0  # of the slow part
_MIN_G = 0.5  # less is free fall or no sensor: it has no direction
_STOP = 0.9995  # of full scale: saturated
_MAX_STEP = 0.25  # gain times dt beyond which the loop would not be stable
_STATE = ("_q", "_gyro", "_accel", "_gain", "_speed", "_age_s", "_n", "_block_s", "_up", "_up_s",
          "_blank")  # fmt: skip


class Attitude(Orientation):
    """Roll, pitch and relative yaw in degrees from gyro (deg/s) and accelerometer (g).

    rate_hz         nominal sample rate
    tau_s           time constant of the accelerometer's correction, and length of the start
    fast_dps        sum of the three axes' |rate| that halves it: a gyro errs by parts of its rate
    rest_tau_s      time constant while resting
    lag_s           age of a sample when it is read: the angles are for now, not for then. 4.8 ms
                    is the MPU6050's gyro delay at dlpf_hz=44 (PS-MPU-6000A, table of DLPF_CFG)
    gyro_range_dps, accel_range_g   where the sensor saturates
    and by name the settings of GyroBias
    """

    def __init__(self, rate_hz=250.0, tau_s=1.8, fast_dps=1500.0, rest_tau_s=0.5,
                 lag_s=0.0048, gyro_range_dps=2000, accel_range_g=16, **bias):
        if min(rate_hz, tau_s, fast_dps, rest_tau_s) <= 0:
            raise ValueError("rate_hz, fast_dps and the time constants must be positive")
        # settings
        self.rate_hz = rate_hz
        self.tau_s = tau_s
        self.fast_dps = fast_dps
        self.rest_tau_s = rest_tau_s
        self.lag_s = lag_s
        # coefficients
        self._block_n = max(1, int(rate_hz * _BLOCK_S + 0.5))
        self._gyro_stop_dps = gyro_range_dps * _STOP
        self._accel_stop_g = accel_range_g * _STOP
        # state
        self._bias = GyroBias(**bias)
        self._loop = LevelLoop()
        self._view = BiasView()
        self.reset()

    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        self._bias.reset()
        self._q = (1.0, 0.0, 0.0, 0.0)  # sensor to earth
        self._gyro = None  # the last sample, deg/s
        self._accel = (0.0, 0.0, 0.0)  # and g
        self._blank = True  # not levelled yet: then yaw is 0
        self._level_anew()

    def relevel(self):
        """After a gap: the next samples level anew; yaw, bias and what is known of it stay."""
        self._bias.relevel()
        self._level_anew()

    def _level_anew(self):
        self._loop.clear()
        self._view.clear()
        self._gain = 0.0  # rad/s
        self._speed = 0.0  # sum of |rate|, deg/s, over some seconds
        self._age_s = 0.0
        self._sum = [0.0] * 6  # of the block: gyro, accelerometer
        self._n = self._block_n - 1  # the first block is the first sample: it levels
        self._block_s = 0.0
        self._up, self._up_s = (0.0, 0.0, 0.0), 0.0  # accelerometer in the earth frame, summed

    def update(self, gx_dps, gy_dps, gz_dps, ax_g, ay_g, az_g, dt_s=None):
        """Take one sample; dt_s is the time since the one before (default 1 / rate_hz).

        A gyro or accelerometer reading that is not a finite number is taken as the last one.
        """
        dt_s = 1.0 / self.rate_hz if dt_s is None else dt_s
        if not (gx_dps + gy_dps + gz_dps) * 0.0 == 0.0:
            gx_dps, gy_dps, gz_dps = self._gyro or (0.0, 0.0, 0.0)
        if not (ax_g + ay_g + az_g) * 0.0 == 0.0:
            ax_g, ay_g, az_g = self._accel
        self._accel = (ax_g, ay_g, az_g)
        for i, value in enumerate((gx_dps, gy_dps, gz_dps, ax_g, ay_g, az_g)):
            self._sum[i] += value * dt_s
        self._turn(gx_dps, gy_dps, gz_dps, dt_s)
        self._correct(ax_g, ay_g, az_g, dt_s)
        self._block_s += dt_s
        self._n += 1
        if self._n >= self._block_n and self._block_s > 0.0:
            self._slow()

    def _turn(self, gx, gy, gz, dt_s):
        """Strap-down integration by the trapezoid rule."""
        stop = self._gyro_stop_dps
        if (abs(gx) >= stop or abs(gy) >= stop or abs(gz) >= stop) and self._age_s > self.tau_s:
            self._age_s = self.tau_s  # as unsure as just after the start
            self._gain = self._gain_now()
        lx, ly, lz = self._gyro or (gx, gy, gz)
        self._gyro = (gx, gy, gz)
        bx, by, bz = self._bias.bias_dps
        half = radians(0.5 * dt_s)
        x = (0.5 * (gx + lx) - bx) * half
        y = (0.5 * (gy + ly) - by) * half
        z = (0.5 * (gz + lz) - bz) * half
        angle = sqrt(x * x + y * y + z * z)
        s = sin(angle) / angle if angle > 1e-6 else 1.0
        self._q = product(self._q, (cos(angle), x * s, y * s, z * s))

    def _correct(self, ax, ay, az, dt_s):
        """Turn the attitude so that the level acceleration integrates to no position."""
        loop = self._loop
        k = min(self._gain * dt_s, _MAX_STEP)
        stop = self._accel_stop_g
        if abs(ax) >= stop or abs(ay) >= stop or abs(az) >= stop:
            loop.forget_velocity()
            ex = ey = 0.0
        else:
            ex, ey, _ = rotate(self._q, ax, ay, az)
        loop.update(k, ex, ey)
        self._q = unit(product((1.0, 0.5 * k * loop.py, -0.5 * k * loop.px, 0.0), self._q))

    def _slow(self):
        """Once per block: rest, bias, gain, and whether the attitude is lost."""
        span = self._block_s
        now = [x / span for x in self._sum]
        self._sum = [0.0] * 6
        self._n, self._block_s = 0, 0.0
        bias = self._bias
        rested, learned = bias.at_rest, bias.learned
        bias.update(now, span)
        if bias.learned and not learned and not bias.moved:  # still since power-on: start again
            self._q = without_yaw(levelling(*bias.mean[3:]))
        self._watch_up(now, span)
        self._age_s += span
        speed = sum([abs(now[i] - bias.bias_dps[i]) for i in range(3)])
        self._speed += min(1.0, span / _SPEED_S) * (speed - self._speed)
        last, self._gain = self._gain, self._gain_now()
        if bias.at_rest != rested:  # at rest there is no velocity; one that ends it goes on
            self._loop.rescale(0.0 if bias.at_rest or not last else self._gain / last)
            self._view.clear()
        self._view.update(self._gain * span, self._q)
        if not bias.at_rest and self._age_s > 4.0 * self.tau_s:
            change = self._view.project(*self._loop.position())  # what is corrected for ever
            bias.learn([degrees(self._gain) * rate for rate in change], span)

    def _gain_now(self):
        """In rad/s. None at first (the mean levels), then high until the age is 2 tau_s."""
        if self._age_s < self.tau_s:
            return 0.0
        gain = max((1.0 + self._speed / self.fast_dps) / self.tau_s, 2.0 / self._age_s)
        return max(gain, 1.0 / self.rest_tau_s) if self._bias.at_rest else gain

    def _watch_up(self, now, span):
        """At first the mean acceleration so far is up; later, one more than 45 degrees away over
        seconds is no acceleration but a lost attitude: start again."""
        more = rotate(self._q, now[3], now[4], now[5])
        up = self._up = tuple([u + part * span for u, part in zip(self._up, more)])
        self._up_s += span
        level = up[0] * up[0] + up[1] * up[1]
        total = level + up[2] * up[2]
        enough = _MIN_G * self._up_s
        if self._age_s < self.tau_s:
            if total > enough * enough:
                self._level(up)
                if self._blank:
                    self._q, self._blank = without_yaw(self._q), False
                self._up = (0.0, 0.0, sqrt(total))
        elif self._up_s >= _LOST_S:
            if total > enough * enough and (up[2] < 0.0 or level > up[2] * up[2]):
                self._level(up)
                self._loop.clear()
                self._view.clear()
                self._age_s = 0.0
            self._up, self._up_s = (0.0, 0.0, 0.0), 0.0

    def _level(self, up):
        """Turn the attitude the short way so that this earth vector points up."""
        self._q = unit(product(levelling(*up), self._q))

    @property
    def at_rest(self):
        """True when it has stood still for a while."""
        return self._bias.at_rest

    @property
    def bias_dps(self):
        """Gyro bias as estimated: x, y, z in deg/s."""
        return tuple(self._bias.bias_dps)

    def rates_dps(self):
        """The last sample's rates less the bias, sensor axes, deg/s."""
        bias = self._bias.bias_dps
        return tuple([rate - b for rate, b in zip(self._gyro or bias, bias)])

    def quaternion(self):
        """(w, x, y, z), sensor to earth, for now: turned on by lag_s at the last rate."""
        half = radians(0.5 * self.lag_s)
        turn = [rate * half for rate in self.rates_dps()]
        return unit(product(self._q, [1.0] + turn))

    def linear_accel_g(self):
        """Acceleration without gravity in sensor axes, g, at the instant of the last sample."""
        gravity = rotate_back(self._q, 0.0, 0.0, 1.0)
        return tuple([a - g for a, g in zip(self._accel, gravity)])

    def state(self):
        """All that changes from sample to sample, for set_state()."""
        parts = (tuple(self._sum), self._loop.state(), self._view.state(), self._bias.state())
        return tuple([getattr(self, name) for name in _STATE]) + parts

    def set_state(self, state):
        """Go on from a state() of a filter with the same settings."""
        for name, value in zip(_STATE, state):
            setattr(self, name, value)
        self._sum = list(state[-4])
        self._loop.set_state(state[-3])
        self._view.set_state(state[-2])
        self._bias.set_state(state[-1])

    # ---- for attitude.standing

    def standing(self):
        """Where it stands."""
        if self._blank:
            return None
        return self._q, self.rates_dps(), self.bias_dps, self._bias.home_dps

    def place(self, q):
        """The same with another attitude."""
        self._q = q

    def begin_at(self, q, rates_dps, bias_dps, home_dps):
        """Begin there, past the time of levelling."""
        self.reset()
        self._bias.begin_at(bias_dps, home_dps)
        self._q, self._blank = q, False
        self._gyro = tuple([rate + b for rate, b in zip(rates_dps, bias_dps)])
        # a filter that has not told its bias at rest may not know all of it
        self._age_s = (4.0 if home_dps else 1.0) * self.tau_s
        self._gain = self._gain_now()

# SPDX-License-Identifier: MIT
"""Six-axis attitude for free motion in any orientation, by a gyro that calibrates itself.

The gyro is integrated strap-down. What the accelerometer reads, turned into the earth frame, is
gravity plus the derivative of a velocity that is bounded, itself the derivative of a position
that is bounded. So its level part is integrated twice, with a leak, and the position that should
not be there turns the attitude: a third-order low-pass in the nearly inertial frame. No sample is
thrown away for being large: what an impact adds, the same impact takes back. Only a saturated
sample breaks that balance, and then the velocity is forgotten.

That position also tells what the gyro does wrong: its bias, scale and cross-axis are learned while
the sensor moves (GyroView, GyroLearning). How well they are known says how fast the loop has to be
(a gyro that errs needs a faster one), how fast it may correct (what pushes harder is no error of
the gyro but an acceleration: LevelLoop), and how far the truth may be away (Bounds).

The anchor to compare with is VQF (Laidig and Seel, Information Fusion 91, 2023): it low-passes in
the same frame with second order and learns the bias with a Kalman filter.
"""

from math import cos, degrees, radians, sin, sqrt

from .level_loop import LevelLoop
from .quaternion import Orientation, product, rotate, rotate_back, unit
from .slow import Slow

_BLOCK_S = 0.08  # of the slow part
_STOP = 0.9995  # of full scale: saturated
_MAX_STEP = 0.25  # gain times dt beyond which the loop would not be stable
_STATE = ("_q", "_gyro", "_rates", "_accel", "_n", "_block_s")


class Attitude(Orientation):
    """Roll, pitch and relative yaw in degrees from gyro (deg/s) and accelerometer (g).

    rate_hz         nominal sample rate
    tau_s           time constant of the accelerometer's correction
    rest_tau_s      time constant while resting
    most_dps, most_sigmas   in motion the correction is no faster than the first and the second
                    times what the gyro may err by
    top_speed_m_s   the body is never faster: see LevelLoop
    lag_s           age of a sample when it is read: the angles are for now, not for then. 4.8 ms
                    is the MPU6050's gyro delay at dlpf_hz=44 (PS-MPU-6000A, table of DLPF_CFG)
    gyro_range_dps, accel_range_g   where the sensor saturates
    and by name the settings of Rest and GyroLearning. profiles.PROFILES has sets of settings.
    """

    def __init__(self, rate_hz=250.0, tau_s=2.3, rest_tau_s=0.5, most_dps=0.2, most_sigmas=2.0,
                 top_speed_m_s=25.0, lag_s=0.0048, gyro_range_dps=2000, accel_range_g=16,
                 **settings):
        if min(rate_hz, tau_s, rest_tau_s, top_speed_m_s) <= 0:
            raise ValueError("rate_hz, top_speed_m_s and the time constants must be positive")
        # settings
        self.rate_hz = rate_hz
        self.lag_s = lag_s
        # coefficients
        self._block_n = n = max(1, int(rate_hz * _BLOCK_S + 1e-6))
        self._told_n = 11 + max(1, (n - 1) // 6)  # samples from a look on, in the integer twin
        self._gyro_stop_dps = gyro_range_dps * _STOP
        self._accel_stop_g = accel_range_g * _STOP
        # state
        self._loop = LevelLoop(top_speed_m_s)
        self._slow = Slow(self._loop, tau_s, rest_tau_s, most_dps, most_sigmas, **settings)
        self.reset()

    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        self._slow.reset()
        self._q = (1.0, 0.0, 0.0, 0.0)  # sensor to earth
        self._gyro = (0.0, 0.0, 0.0)  # the last sample, deg/s
        self._rates = None  # the same, as learned to be true
        self._accel = (0.0, 0.0, 0.0)  # and g
        self._begin_blocks()

    def known(self, settings):
        """What a calibration tells of the gyro (attitude.counts), before the first sample."""
        self._slow.known(settings)

    def relevel(self):
        """After a gap: the next samples level anew; yaw, bias and what is known of it stay."""
        self._slow.relevel()
        self._begin_blocks()

    def _begin_blocks(self):
        self._loop.clear()
        self._sum = [0.0] * 6  # of the block: the matrix' rates, accelerometer
        self._n = self._block_n - 1  # the first block is the first sample: it levels
        self._block_s = 0.0

    def update(self, gx_dps, gy_dps, gz_dps, ax_g, ay_g, az_g, dt_s=None):
        """Take one sample; dt_s is the time since the one before (default 1 / rate_hz).

        A gyro or accelerometer reading that is not a finite number is taken as the last one.
        """
        dt_s = 1.0 / self.rate_hz if dt_s is None else dt_s
        if not (gx_dps + gy_dps + gz_dps) * 0.0 == 0.0:
            gx_dps, gy_dps, gz_dps = self._gyro
        if not (ax_g + ay_g + az_g) * 0.0 == 0.0:
            ax_g, ay_g, az_g = self._accel
        self._gyro = (gx_dps, gy_dps, gz_dps)
        self._accel = (ax_g, ay_g, az_g)
        stop = self._gyro_stop_dps
        if abs(gx_dps) >= stop or abs(gy_dps) >= stop or abs(gz_dps) >= stop:
            self._slow.over_range()
        m = self._slow.learning.matrix
        x = m[0] * gx_dps + m[1] * gy_dps + m[2] * gz_dps
        y = m[3] * gx_dps + m[4] * gy_dps + m[5] * gz_dps
        z = m[6] * gx_dps + m[7] * gy_dps + m[8] * gz_dps
        for i, value in enumerate((x, y, z, ax_g, ay_g, az_g)):
            self._sum[i] += value * dt_s
        self._turn(x, y, z, dt_s)
        self._correct(ax_g, ay_g, az_g, dt_s)
        self._block_s += dt_s
        self._n += 1
        if self._n >= self._block_n and self._block_s > 0.0:
            span = self._block_s
            now = [value / span for value in self._sum]
            self._sum = [0.0] * 6
            self._n, self._block_s = 0, 0.0
            self._q = self._slow.update(self._q, now, span, self._accel)
        elif self._n == self._told_n:
            self._q = self._slow.made_good(self._q)

    def _turn(self, x, y, z, dt_s):
        """Strap-down integration by the trapezoid rule."""
        bx, by, bz = self.bias_dps
        rates = x - bx, y - by, z - bz
        lx, ly, lz = self._rates or rates
        self._rates = rates
        half = radians(0.5 * dt_s)
        x, y, z = [0.5 * (a + b) * half for a, b in zip(rates, (lx, ly, lz))]
        angle = sqrt(x * x + y * y + z * z)
        s = sin(angle) / angle if angle > 1e-6 else 1.0
        self._q = product(self._q, (cos(angle), x * s, y * s, z * s))

    def _correct(self, ax, ay, az, dt_s):
        """Turn the attitude so that the level acceleration integrates to no position."""
        loop = self._loop
        k = min(self._slow.gain * dt_s, _MAX_STEP)
        stop = self._accel_stop_g
        if abs(ax) >= stop or abs(ay) >= stop or abs(az) >= stop:
            loop.forget_velocity()
            self._slow.view.forget_velocity()
            ex = ey = 0.0
        else:
            ex, ey, _ = rotate(self._q, ax, ay, az)
        loop.update(k, ex, ey)
        px, py = loop.correction()
        self._q = unit(product((1.0, 0.5 * k * py, -0.5 * k * px, 0.0), self._q))

    @property
    def at_rest(self):
        """True when it has stood still for a while."""
        return self._slow.rest.at_rest

    @property
    def bias_dps(self):
        """Gyro bias as estimated: x, y, z in deg/s."""
        return tuple([degrees(b) for b in self._slow.learning.bias])

    def calibration_learned(self):
        """The nine elements that a true rate is made of by one calibrated before, row by row."""
        return tuple(self._slow.learning.matrix)

    def learned(self):
        """(scale, its sigma, bias_dps, its sigma), three numbers each: what each axis reads too
        much, as a part of the rate and in deg/s."""
        learning = self._slow.learning
        scale = [1.0 - learning.matrix[n] for n in (0, 4, 8)]
        scale_sigma = [learning.sigma[n] for n in (3, 7, 11)]
        return tuple(scale), tuple(scale_sigma), self.bias_dps, self.bias_sigma_dps

    @property
    def bias_sigma_dps(self):
        """One sigma of each of them, deg/s."""
        return tuple([degrees(self._slow.learning.sigma[n]) for n in (0, 1, 2)])

    @property
    def uncertain(self):
        """Not 0 while the tilt is not known well enough to be claimed: see Bounds."""
        return self._slow.bounds.uncertain

    @property
    def tilt_sigma_deg(self):
        """One sigma of each level axis, degrees; see Bounds."""
        return self._slow.bounds.tilt_sigma_deg(self._slow.view, self._slow.learning)

    @property
    def yaw_sigma_deg(self):
        """One sigma of the rotation about the vertical since the start or forget_yaw(), degrees.
        """
        return self._slow.bounds.yaw_sigma_deg(self._slow.view, self._slow.learning)

    def rates_dps(self):
        """The last sample's rates as learned to be true, sensor axes, deg/s."""
        return self._rates or (0.0, 0.0, 0.0)

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
        own = tuple([getattr(self, name) for name in _STATE])
        return own + (tuple(self._sum), self._loop.state(), self._slow.state())

    def set_state(self, state):
        """Go on from a state() of a filter with the same settings."""
        for name, value in zip(_STATE, state):
            setattr(self, name, value)
        self._sum = list(state[-3])
        self._loop.set_state(state[-2])
        self._slow.set_state(state[-1])

    # ---- for attitude.standing

    def standing(self):
        """Where it stands."""
        if self._slow.blank:
            return None
        return self._q, self.rates_dps(), self.bias_dps, self._slow.rest.home_dps

    def place(self, q):
        """The same with another attitude."""
        self._q = q

    def bridged(self):
        """A gap has been bridged by place(): while the mean levels, nothing of before it is in
        it."""
        if self._slow.young:
            self._sum = [0.0] * 6
            self._block_s = 0.0

    def forget_yaw(self):
        """Yaw counts from here: what it was off by is no more."""
        self._slow.forget_yaw()

    def begin_at(self, q, rates_dps, bias_dps, home_dps):
        """Begin there, past the time of levelling; with no rate at all: where a rest was."""
        self.reset()
        self._slow.begin_at(bias_dps, home_dps, not any(rates_dps))
        self._q, self._rates = q, tuple(rates_dps)

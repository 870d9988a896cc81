# SPDX-License-Identifier: MIT
"""The float Attitude fed with counts, with the integer one's interface: millidegrees out.

FloatAttitude(rate_hz, gyro_dps, accel_g, and Attitude's settings by name)

It is given the measured time with each sample.
"""

from attitude.attitude import Attitude
from attitude.counts import known
from attitude.float_base import FromCounts

_SEEN_US = 20000  # over which a straight line is as good as samples


class FloatAttitude(FromCounts):
    """The float Attitude: free motion."""

    knows_yaw = True

    def __init__(self, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
        super().__init__(rate_hz, gyro_dps, accel_g, settings)

    def _make(self, settings):
        settings = settings.copy()
        settings["gyro_range_dps"], settings["accel_range_g"] = self.gyro_dps, self.accel_g
        return (Attitude(self.rate_hz, **settings),)

    def prepare(self, calibration=None, period_us=None, settings=None):
        """See FromCounts; before the first sample, a calibration also tells what is known."""
        super().prepare(calibration, period_us, settings)
        if calibration is not None:
            own = self.pending[3]
            told = [pair for pair in known(calibration).items() if pair[0] not in own]
            self.cores[0].known(dict(told))

    def _update(self, gyro, accel, dt_s):
        x, y, z = gyro
        ax, ay, az = accel
        self.cores[0].update(x, y, z, ax, ay, az, dt_s)
        self._show()

    def _show(self):
        core = self.cores[0]
        self._tell((core.roll_deg, core.pitch_deg, core.yaw_deg), core.rates_dps())
        self.out[9] = core.at_rest

    @property
    def at_rest(self):
        """True when it has stood still for a while."""
        return self.cores[0].at_rest

    @property
    def bias_dps(self):
        """Gyro bias as estimated on top of the calibration, deg/s."""
        return self.cores[0].bias_dps

    @property
    def bias_sigma_dps(self):
        """One sigma of each of them, deg/s."""
        return self.cores[0].bias_sigma_dps

    @property
    def uncertain(self):
        """Not 0 while the tilt is not known well enough to be claimed: see Bounds."""
        return self.cores[0].uncertain

    @property
    def tilt_sigma_deg(self):
        """One sigma of each level axis, degrees."""
        return self.cores[0].tilt_sigma_deg

    @property
    def yaw_sigma_deg(self):
        """One sigma of the rotation about the vertical since the start or zero_yaw(), degrees."""
        return self.cores[0].yaw_sigma_deg

    def learned(self):
        """(scale, its sigma, bias_dps, its sigma): see Attitude."""
        return self.cores[0].learned()

    def quaternion(self):
        """(w, x, y, z), sensor to earth, for now."""
        return self.cores[0].quaternion()

    def linear_accel_g(self):
        """Acceleration without gravity in the robot's frame, g, of the last sample."""
        return self.cores[0].linear_accel_g()

    def reset(self):
        """Forget everything; the next sample starts anew with yaw 0."""
        self.cores[0].reset()

    def relevel(self):
        """After a gap: the next samples level anew; yaw, bias and what is known of it stay."""
        self.cores[0].relevel()

    def turn(self, before, after, dt_us):
        """See FromCounts."""
        super().turn(before, after, dt_us)
        if dt_us > _SEEN_US:
            self.cores[0].bridged()

    def zero_yaw(self):
        """The direction it looks in now is yaw 0."""
        super().zero_yaw()
        self.cores[0].forget_yaw()

    def state(self):
        """What set_state() takes to continue here."""
        return self.cores[0].state()

    def set_state(self, state):
        """Continue from a state() of the same kind."""
        self.cores[0].set_state(state)
        self._show()

    # ---- for attitude.standing

    def standing(self):
        """Where it stands."""
        return self.cores[0].standing()

    def alike(self, other):
        """Whether the other's state() is understood here."""
        return isinstance(other, FloatAttitude)

    def place(self, q):
        """The same with another attitude."""
        self.cores[0].place(q)
        self._show()

    def begin_at(self, there):
        """Begin there, past the time of levelling."""
        self.cores[0].begin_at(*there)
        self.place(there[0])

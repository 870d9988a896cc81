# SPDX-License-Identifier: MIT
"""Two one-axis float filters fed with counts, with the integer ones' interface: millidegrees out.

FloatTilt(KalmanTilt, rate_hz, gyro_dps, accel_g, and its settings by name); or Complementary

They are given the measured time with each sample.
"""

from attitude.float_base import FromCounts, go_on_with
from attitude.standing import angles_deg, of_angles
from attitude.tilt import accel_tilt_deg


class FloatTilt(FromCounts):
    """Two one-axis filters, for roll and pitch; yaw stays 0.

    What bias they cannot tell (that about z; all of Complementary's) is what go_on_from() brought.
    """

    def __init__(self, kind, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
        self._kind = kind
        self._brought = (0.0, 0.0, 0.0)  # deg/s
        self._home = None  # the bias at rest that was handed over
        self._last = None  # rates of the last sample, deg/s
        self._started = self._seen = False
        super().__init__(rate_hz, gyro_dps, accel_g, settings)

    def _make(self, settings):
        return self._kind(**settings), self._kind(**settings)

    def _update(self, gyro, accel, dt_s):
        angles = accel_tilt_deg(*accel)
        if not self._started:
            self._started = self._seen = True
            self._set_angles(angles)
        gyro = [g - b for g, b in zip(gyro, self._brought)]
        # by the trapezoid rule, which counts in a loop with long gaps
        mean = [0.5 * (g + last) for g, last in zip(gyro, self._last or gyro)]
        self._last = tuple(gyro)
        for i, core in enumerate(self.cores):
            core.update(angles[i], mean[i], dt_s)
        self._show()

    def _show(self):
        roll, pitch = self.cores
        gyro = self._last or (0.0, 0.0, 0.0)
        rates = [g - getattr(core, "bias_dps", 0.0) for g, core in zip(gyro, self.cores)]
        self._tell((roll.angle_deg, pitch.angle_deg, 0.0), (rates[0], rates[1], gyro[2]))

    def _set_angles(self, angles_deg):
        for core, angle in zip(self.cores, angles_deg):
            core.angle_deg = angle

    @property
    def bias_dps(self):
        """Gyro bias on top of the calibration, deg/s."""
        own = [getattr(core, "bias_dps", 0.0) for core in self.cores] + [0.0]
        return tuple([a + b for a, b in zip(own, self._brought)])

    def reset(self):
        """Start anew on the next sample, with bias 0."""
        self._started = self._seen = False
        self._brought, self._last, self._home = (0.0, 0.0, 0.0), None, None
        for core in self.cores:
            core.reset()

    def relevel(self):
        """Start at the accelerometer's angles of the next sample; the bias stays."""
        self._started, self._last = False, None

    def state(self):
        """What set_state() takes to continue here."""
        own = (self._started, self._seen, self._brought, self._last, self._home)
        return own + tuple([core.state() for core in self.cores])

    def set_state(self, state):
        """Continue from a state() of the same kind."""
        self._started, self._seen, self._brought, self._last, self._home = state[:5]
        for core, own in zip(self.cores, state[5:]):
            go_on_with(core, own)
        self._show()

    # ---- for attitude.standing

    def standing(self):
        """Where it stands: yaw 0, and of its bias at rest it knows what was handed over."""
        if not self._seen:
            return None
        roll, pitch = self.cores
        rates = [rate / 1000.0 for rate in self.rates_mdps]
        return of_angles(roll.angle_deg, pitch.angle_deg, 0.0), rates, self.bias_dps, self._home

    def alike(self, other):
        """Whether the other's state() is understood here."""
        return isinstance(other, FloatTilt) and other._kind is self._kind

    def place(self, q):
        """The same with another attitude, but for its yaw."""
        self._set_angles(angles_deg(q))
        self._show()

    def begin_at(self, there):
        """Begin there."""
        q, rates, bias, home = there
        self.reset()
        self._home = home
        self._started = self._seen = True
        self._brought = tuple(bias)
        if hasattr(self.cores[0], "bias_dps"):
            for core, own in zip(self.cores, bias):
                core.bias_dps = own
            self._brought = (0.0, 0.0, bias[2])
        own = [getattr(core, "bias_dps", 0.0) for core in self.cores] + [0.0]
        self._last = tuple([rate + b for rate, b in zip(rates, own)])
        self.place(q)

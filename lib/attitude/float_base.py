# SPDX-License-Identifier: MIT
"""What the float filters fed with counts share: calibration, coefficients apart from state,
live results. They allocate, so the collector runs now and then.
"""

from array import array

from attitude.counts import (
    ACCEL_LSB_PER_G,
    GYRO_LSB_PER_DPS,
    Ideal,
    lsb,
    period16,
    row_of,
    set_known,
)
from attitude.standing import go_on, turned, with_yaw

_LONGEST_US = 1000000  # after a longer gap the filter levels anew


class FromCounts:
    """`out`, angles_mdeg, rates_mdps: as attitude.fixed.base's, made once.

    A subclass gives _make(settings) -> the filters, _update(gyro, accel, dt_s), and what
    attitude.standing asks for.
    """

    timed = True  # update() needs the measured time
    at_rest, uncertain = False, 0  # of filters that do not watch for it
    knows_yaw = False  # of filters of roll and pitch only
    _made = False

    def __init__(self, rate_hz, gyro_dps, accel_g, settings):
        self.rate_hz = rate_hz
        self.gyro_dps, self.accel_g = gyro_dps, accel_g
        self._gyro_lsb = lsb(GYRO_LSB_PER_DPS, gyro_dps, "gyro_dps")
        self._accel_lsb = lsb(ACCEL_LSB_PER_G, accel_g, "accel_g")
        self._nominal16 = self._period16 = int(16e6 / rate_hz + 0.5)
        self.out = array("i", [0] * 10)
        self.angles_mdeg = memoryview(self.out)[0:3]
        self.rates_mdps = memoryview(self.out)[3:6]
        self._settings = settings
        self.cores = self._make(settings)
        self._kept = None
        self.pending = [None, self._period16, None, settings]  # rows, period, filters, settings
        self.calibrate(Ideal)
        self._made = True

    __setattr__ = set_known

    def relevel(self):
        """After a gap: level anew; yaw and bias stay."""
        raise NotImplementedError

    @property
    def bias_dps(self):
        """Gyro bias on top of the calibration, deg/s."""
        raise NotImplementedError

    def standing(self):
        """Where it stands."""
        raise NotImplementedError

    def place(self, q):
        """The same with another attitude."""
        raise NotImplementedError

    def _make(self, settings):
        raise NotImplementedError

    def _update(self, gyro, accel, dt_s):
        raise NotImplementedError

    # ---- coefficients

    def prepare(self, calibration=None, period_us=None, settings=None):
        """Make the coefficients that the next swap() takes over; what is not given stays.

        settings: a dict of some of the constructor's own, by name. ValueError leaves all as it
        was and names what is wrong.
        """
        rows, period, cores, merged = self.pending
        if period_us is not None:
            period = period16(period_us, self._nominal16)
        if settings is not None:
            merged = merged.copy()
            merged.update(settings)
            try:
                cores = self._make(merged)
            except TypeError as error:  # a name that is no setting, or no number
                raise ValueError(str(error)) from None
        if calibration is not None:
            gyro_bias = [b * self._gyro_lsb for b in calibration.gyro_bias_dps]
            accel_bias = [b * self._accel_lsb for b in calibration.accel_bias_g]
            rows = [row_of(calibration.gyro_matrix, i, gyro_bias) for i in range(3)]
            rows += [row_of(calibration.accel_matrix, i, accel_bias) for i in range(3)]
        self.pending = [rows, period, cores, merged]

    def swap(self):
        """Take over the prepared coefficients; angle, bias and all other state stay."""
        self._rows, self._period16, cores, self._settings = self.pending
        if cores:
            self.pending[2] = None
            for core, old in zip(cores, self.cores):
                go_on_with(core, old.state())
            self.cores = cores

    def calibrate(self, calibration):
        """Correct the samples by this Calibration from now on."""
        self.prepare(calibration)
        self.swap()

    @property
    def period_us(self):
        """Time between samples, microseconds, for update() without one; ValueError for one that
        is more than 5 % off 1e6 / rate_hz.
        """
        return self._period16 / 16

    @period_us.setter
    def period_us(self, value):
        self.prepare(None, value)
        self.swap()

    # ---- samples

    def update(self, counts, dt_us=0):
        """One sample, dt_us after the last; 0: after the filter's own period. After more than a
        second it levels anew.
        """
        x, y, z = counts[4], counts[5], counts[6]
        gyro = [a * x + b * y + c * z + d for a, b, c, d in self._rows[:3]]
        x, y, z = counts[0], counts[1], counts[2]
        accel = [a * x + b * y + c * z + d for a, b, c, d in self._rows[3:]]
        out, lsb_dps, lsb_g = self.out, self._gyro_lsb, self._accel_lsb
        out[6], out[7], out[8] = [round(value) for value in accel]
        if dt_us > _LONGEST_US:
            self.relevel()
            dt_us = 0
        dt_us = dt_us if dt_us > 0 else self._period16 / 16
        self._update([g / lsb_dps for g in gyro], [a / lsb_g for a in accel], dt_us * 1e-6)

    def _tell(self, angles_deg, rates_dps):
        out = self.out
        for i in range(3):
            out[i] = round(1000.0 * angles_deg[i])
            out[3 + i] = round(1000.0 * rates_dps[i])

    @property
    def roll_mdeg(self):
        """Roll in millidegrees."""
        return self.out[0]

    @property
    def pitch_mdeg(self):
        """Pitch in millidegrees."""
        return self.out[1]

    @property
    def yaw_mdeg(self):
        """Yaw in millidegrees; 0 of filters that know roll and pitch only."""
        return self.out[2]

    # ---- gaps

    def keep(self):
        """Remember the attitude: the next turn() begins here."""
        stands = self.standing()
        self._kept = stands and stands[0]

    def turn(self, before, after, dt_us):
        """Turn on from keep() by dt_us, without the accelerometer, with the mean of the rates of
        the counts `before` and `after`."""
        if self._kept:
            mean = [(before[i] + after[i]) / 2 for i in (4, 5, 6)]
            rates = [
                (a * mean[0] + b * mean[1] + c * mean[2] + d) / self._gyro_lsb - bias
                for (a, b, c, d), bias in zip(self._rows[:3], self.bias_dps)
            ]
            self.place(turned(self._kept, rates, dt_us * 1e-6))

    def zero_yaw(self):
        """The direction it looks in now is yaw 0."""
        stands = self.standing()
        if stands:
            self.place(with_yaw(stands[0], 0.0))

    def take_state(self, other):
        """Continue where another one with the same settings is now."""
        self.set_state(other.state())  # type: ignore[attr-defined]  # each kind has its own

    def go_on_from(self, other, dt_us=0, yaw_deg=None):
        """Start where any other filter stands, float or integer: its tilt, yaw and bias, turned
        on by its rates for dt_us. A filter of roll and pitch only stands at yaw 0; yaw_deg gives
        another.
        """
        go_on(self, other, dt_us, yaw_deg)


def go_on_with(core, state):
    """Let one of the filters continue from a state() of its kind."""
    if hasattr(core, "set_state"):
        core.set_state(state)
    elif isinstance(state, tuple):
        core.reset(*state)
    else:
        core.reset(state)

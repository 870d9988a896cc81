# SPDX-License-Identifier: MIT
"""What the integer filters share: coefficients apart from state, the period, gaps, live results.

A filter's numbers stand in one array of 32-bit integers: first the coefficients, which only
swap() changes, then the state. Rates in it are per sample at the nominal rate, whatever the true
period; one coefficient, STEP, is the true period by the nominal one.
"""

from array import array

from micropython import const

from attitude.counts import (
    ACCEL_LSB_PER_G,
    GYRO_LSB_PER_DPS,
    Ideal,
    lsb,
    period16,
    set_known,
)
from attitude.fixed.folding import check_rate, fold_accel, fold_gyro, mantissa
from attitude.fixed.intmath import ratio

# the first coefficients of every filter
_ACCEL = const(0)  # 9 coefficients and 3 offsets, Q14, see fold_accel
_GYRO = const(12)  # 9 coefficients and 3 offsets, see fold_gyro
_GYRO_SHIFT = const(24)
_STEP = const(25)  # the period by the nominal one, Q15
_RATE = const(26)  # rate to millidegrees per second: times RATE / 2^15 >> RATE_SHIFT
_RATE_SHIFT = const(27)

_OUT = const(10)  # words of the results


def _zeros(n):
    """An array without a list of as many beside it: a used heap has few pieces of a kilobyte."""
    made = array("i", range(n))
    for i in range(n):
        made[i] = 0
    return made


class Fixed:
    """A filter of raw counts at a fixed rate.

    out: a live array 'i' of ten, ready when update() returns: [0:3] roll, pitch, yaw in
    millidegrees; [3:6] rates in the robot's frame in millidegrees per second, calibrated, less
    the learned bias; [6:9] calibrated accelerometer in the robot's frame in counts of the
    sensor's scale; [9] 1 at rest. angles_mdeg, rates_mdps: the first two as arrays of their own.
    They allocate nothing and cost a tenth of a property.

    step(counts): one sample, counts as the sensor gives them, ax ay az temp gx gy gz (int16), at
    the filter's own period: for an interrupt. update(counts, dt_us=0): the same for all others;
    dt_us: microseconds since the sample before, for a loop with gaps of its own (see gap).

    A subclass gives these two, swap(), relevel(), reset(); _unit_per_deg (of its rates); the
    places _seq_at (of a count of steps), _out_at, _state_at and _state_end; and
    _set_up(settings by name), which fills `pending` from 28 on. The last number of `pending` says
    what swap() takes over: 0 the period, 1 all coefficients, more what the subclass says.
    """

    _unit_per_deg: float
    _seq_at: int
    _out_at: int
    _state_at: int
    _state_end: int
    _least_hz = 10
    _spare = 1.0  # by how much the gyro's coefficients may grow while it runs

    at_rest, uncertain = False, 0  # of filters that do not watch for it
    knows_yaw = False  # of filters of roll and pitch only
    _made = False
    timed = False  # update() needs no dt: the period is fixed

    def __init__(self, rate_hz, gyro_dps, accel_g, size, pending, settings):
        self.rate_hz = rate_hz
        self.gyro_dps, self.accel_g = gyro_dps, accel_g
        self._gyro_lsb = lsb(GYRO_LSB_PER_DPS, gyro_dps, "gyro_dps")
        self._accel_lsb = lsb(ACCEL_LSB_PER_G, accel_g, "accel_g")
        check_rate(rate_hz, gyro_dps, self._least_hz)
        self._s = _zeros(size)
        self.pending = _zeros(pending)
        self.out = memoryview(self._s)[self._out_at : self._out_at + _OUT]
        self.angles_mdeg = self.out[0:3]
        self.rates_mdps = self.out[3:6]
        # for update() with a time: the sample before, one on the way from there; and in 1/16 us
        # the nominal period and the true one, and the step after which the sample before is known
        self._last = array("h", [0] * 7)
        self._between = array("h", [0] * 7)
        nominal = int(16e6 / rate_hz + 0.5)
        self._clock = array("i", [nominal, nominal, -1])
        self.pending[_STEP] = 32768
        per_sample = 1000.0 * rate_hz / self._unit_per_deg
        self.pending[_RATE], self.pending[_RATE_SHIFT] = mantissa(32768.0 * per_sample)
        self._kept = array("i", [0] * 13)  # of keep() and turn(): where a gap began
        self._settings = {}
        self.prepare(Ideal, None, settings)
        self.swap()
        self.reset()
        self._made = True

    __setattr__ = set_known

    # ---- what the subclass knows

    def reset(self):
        """Forget everything."""
        raise NotImplementedError

    def swap(self):
        """Take over the prepared coefficients."""
        raise NotImplementedError

    def _set_up(self, **settings):
        raise NotImplementedError

    # ---- coefficients

    def prepare(self, calibration=None, period_us=None, settings=None):
        """Make the coefficients that the next swap() takes over; what is not given stays.

        settings: a dict of some of the constructor's own, by name. For a loop that runs in an
        interrupt: this in the foreground, swap() between two ticks. ValueError, which leaves all
        as it was, names what is wrong. With nothing but a whole period_us it allocates nothing.
        """
        if period_us is not None:
            period_us = period16(period_us, self._clock[0])
        if calibration is not None or settings is not None:
            kept = array("i", self.pending)
            try:
                if calibration is not None:
                    self._fold(calibration)
                if settings is not None:
                    merged = self._settings.copy()
                    merged.update(settings)
                    self._set_up(**merged)
                    self._settings = merged
                self.pending[-1] |= 1
            except Exception as error:
                for i, value in enumerate(kept):
                    self.pending[i] = value
                if isinstance(error, TypeError):  # a name that is no setting, or no number
                    raise ValueError(str(error)) from None
                raise
        if period_us is not None:
            self._clock[1] = period_us
            self.pending[_STEP] = ratio(period_us, self._clock[0])

    def _fold(self, cal):
        unit = self._unit_per_deg / (self._gyro_lsb * self.rate_hz)
        fold_accel(self.pending, _ACCEL, cal, self._accel_lsb)
        shift = fold_gyro(self.pending, _GYRO, cal, self._gyro_lsb, unit, self._spare)
        self.pending[_GYRO_SHIFT] = shift

    def calibrate(self, calibration):
        """Fold a Calibration (bias, matrices, mounting) into the step, at no cost.

        Not while an interrupt runs the filter: prepare() and swap() then.
        """
        self.prepare(calibration)
        self.swap()

    @property
    def period_us(self):
        """Time between samples in microseconds. Set it to the measured mean when that differs
        from 1e6 / rate_hz; ValueError when it is more than 5 % off. A whole number allocates
        nothing. Not while an interrupt runs the filter: prepare() and swap() then.
        """
        return self._clock[1] / 16

    @period_us.setter
    def period_us(self, value):
        self.prepare(None, value)
        self.swap()

    # ---- results and state

    @property
    def roll_mdeg(self):
        """Roll in millidegrees, -180000 to 180000."""
        return self.out[0]

    @property
    def pitch_mdeg(self):
        """Pitch in millidegrees."""
        return self.out[1]

    @property
    def yaw_mdeg(self):
        """Rotation about the vertical since the start, millidegrees, -180000 to 180000; 0 of
        filters that know roll and pitch only."""
        return self.out[2]

    def state(self):
        """What set_state() takes to continue here: a tuple of integers, all of one instant."""
        return self.whole(tuple)

    def whole(self, read):
        """What read(state) makes of the state, all of one instant, without a copy: `state` is a
        view that the next tick may change, and then it is read again."""
        s = self._s
        state = memoryview(s)[self._state_at : self._state_end]
        while True:
            step = s[self._seq_at]
            got = read(state)
            if s[self._seq_at] == step:  # else an interrupt came in between
                return got

    def set_state(self, state):
        """Continue from a state() of a filter with the same settings."""
        size = self._state_end - self._state_at
        if len(state) != size:
            raise ValueError("state of %d numbers, not %d" % (len(state), size))
        for i, value in enumerate(state):
            self._s[self._state_at + i] = value

    def take_state(self, other):
        """Continue where another one with the same settings is now, of one instant; a board whose
        memory is nearly full has no room for a state()."""
        mine, its = self._s, other._s
        while True:
            step = its[self._seq_at]
            for i in range(self._state_at, self._state_end):
                mine[i] = its[i]
            if its[self._seq_at] == step:  # else an interrupt came in between
                return

    def go_on_from(self, other, dt_us=0, yaw_deg=None):
        """Start where any other filter stands, float or integer: its tilt, yaw and bias, turned
        on by its rates for dt_us. From one of the same kind, rate and ranges the whole state.

        A filter of roll and pitch only stands at yaw 0; yaw_deg gives another. The other one may
        be running in an interrupt, this one not.
        """
        from attitude.standing import go_on

        go_on(self, other, dt_us, yaw_deg)

    def alike(self, other):
        """Whether the other's state() is understood here."""
        return type(other) is type(self) and (other.rate_hz, other.gyro_dps, other.accel_g) == (
            self.rate_hz,
            self.gyro_dps,
            self.accel_g,
        )

# SPDX-License-Identifier: MIT
"""What the integer filters share: ranges, calibration, period, state."""

from array import array

import micropython
from micropython import const

from attitude.fixed.folding import (
    ACCEL_LSB_PER_G,
    GYRO_LSB_PER_DPS,
    Ideal,
    check_rate,
    fold_accel,
    fold_gyro,
    lsb,
)

_ACCEL = const(0)  # in every filter's array: 9 coefficients and 3 offsets, Q14, see fold_accel
_GYRO = const(12)  # 3 coefficients a row, then the offsets, see fold_gyro
_PERIOD_SPAN = const(3276)  # 5 % in 1/65536: a clock further off is a fault, not a clock


@micropython.viper
def _scale(target: ptr32, at: int, source: ptr32, n: int, change: int):
    """target[at + i] = source[i] (1 + change / 2^16), in steps that 32 bits hold."""
    i = 0
    while i < n:
        value = source[i]
        more = (value >> 15) * change + ((value & 0x7FFF) * change >> 15)
        target[at + i] = value + (more >> 1)
        i += 1


class Fixed:
    """A filter of raw counts at a fixed rate, its numbers in one array of 32-bit integers.

    A subclass gives _gyro_rows (axes used), _unit_per_deg (of its angles), and the places
    _shift_at (the gyro's shift), _state_at to _state_end (what samples change), _angles_at.

    angles_mdeg[0], [1] and, where there is one, [2] are roll, pitch and yaw: the same as
    .roll_mdeg and so on, at a fifth of a property's cost on the board (5 us against 20).
    """

    _gyro_rows: int
    _unit_per_deg: float
    _shift_at: int
    _state_at: int
    _state_end: int
    _angles_at: int
    _least_hz = 10

    yaw_mdeg = 0  # of filters that know roll and pitch only
    at_rest = False  # and of those that do not watch for it
    timed = False  # update() takes no dt: the period is fixed

    def __init__(self, rate_hz, gyro_dps, accel_g, size):
        self.rate_hz = rate_hz
        self._gyro_lsb = lsb(GYRO_LSB_PER_DPS, gyro_dps, "gyro_dps")
        self._accel_lsb = lsb(ACCEL_LSB_PER_G, accel_g, "accel_g")
        check_rate(rate_hz, gyro_dps, self._least_hz)
        self._s = array("i", [0] * size)
        # roll, pitch (and yaw) as a live array 'i': for what reads them each tick, since a
        # property costs 30 us
        end = self._angles_at + self._gyro_rows
        self.angles_mdeg = memoryview(self._s)[self._angles_at : end]
        self._gyro_base = array("i", [0] * (4 * self._gyro_rows))
        self._period16 = self._nominal16 = int(16e6 / rate_hz + 0.5)
        self.calibrate(Ideal)

    def calibrate(self, cal):
        """Fold a Calibration (bias, matrices, mounting) into the step, at no cost."""
        base = self._gyro_base
        unit = self._unit_per_deg / (self._gyro_lsb * self.rate_hz)
        shift = fold_gyro(base, 0, self._gyro_rows, cal, self._gyro_lsb, unit)
        fold_accel(self._s, _ACCEL, cal, self._accel_lsb)
        self._s[self._shift_at] = shift
        self._apply_period()

    @property
    def roll_mdeg(self):
        """Roll in millidegrees, -180000 to 180000."""
        return self._s[self._angles_at]

    @property
    def pitch_mdeg(self):
        """Pitch in millidegrees."""
        return self._s[self._angles_at + 1]

    @property
    def period_us(self):
        """Time between samples in microseconds. Set it to the measured mean when that differs
        from 1e6 / rate_hz; it is held within 5 % of it. Setting a whole number allocates nothing.
        """
        return self._period16 / 16

    @period_us.setter
    def period_us(self, value):
        self._period16 = int(value * 16)
        self._apply_period()

    def _apply_period(self):
        nominal = self._nominal16
        change = ((self._period16 - nominal) << 12) // (nominal >> 4)
        if not -_PERIOD_SPAN <= change <= _PERIOD_SPAN:
            change = _PERIOD_SPAN if change > 0 else -_PERIOD_SPAN
            self._period16 = nominal + nominal * change // 65536
        _scale(self._s, _GYRO, self._gyro_base, 4 * self._gyro_rows, change)

    def state(self):
        """What set_state() takes to continue here: a tuple of integers."""
        return tuple(self._s[self._state_at : self._state_end])

    def go_on_from(self, other):
        """Continue where another one of the same kind is, with own settings."""
        self.set_state(other.state())

    def set_state(self, state):
        """Continue from a state() of a filter with the same settings."""
        size = self._state_end - self._state_at
        if len(state) != size:
            raise ValueError("state of %d numbers, not %d" % (len(state), size))
        for i, value in enumerate(state):
            self._s[self._state_at + i] = value

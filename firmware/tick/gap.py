# SPDX-License-Identifier: MIT
"""The estimate over ticks without a sample, and over ticks that never came.

Meanwhile the angle is predicted with the last good rate. When samples come again, the rotation
that was missed is what the mean of the rates before and after makes of the time; the part that
was not predicted yet is made up for at once. After too long a gap nobody knows the rotation: then
the filter levels anew.
"""

from array import array
from math import pi

from micropython import const

_PREDICT_US = const(250000)  # longer than that the last rate says nothing
_AT_ONCE = const(8)  # updates in one tick at most, about 1 ms
_HALF_SCALE = const(16384)
_MOST = const(32000)  # short of what a filter takes for saturated


class Bridge:
    """The estimator `filter`, with a bridge over each gap; period_us is the loop's.

    update: of the filter; `timed`: whether it takes the time as well as the counts.
    """

    def __init__(self, period_us, gyro_lsb_per_dps):
        self.period_us = period_us
        self._made = 0  # updates since the last good sample
        self._counts = array("h", [0] * 7)  # the last burst before the gap, turned on since
        self._parts = array("i", [0] * 3)
        # counts of the gyro to the angle of a period, rad * 2^29
        self._turn = round(period_us * 1e-6 / gyro_lsb_per_dps * pi / 180 * (1 << 29))

    def use(self, filter):
        """Work with this filter from now on; what was predicted is in its state, or forgotten."""
        self._made = 0
        self.filter, self.update, self.timed = filter, filter.update, filter.timed
        self.pace(self.period_us)

    def pace(self, period_us):
        """From now on a tick comes every period_us."""
        self.period_us = period_us
        if not self.timed:
            self.filter.period_us = period_us

    def remember(self, counts):
        """A gap begins; `counts` is still the last good burst. Within a gap this does nothing."""
        if not self._made:
            for i in range(7):
                self._counts[i] = counts[i]

    def predict(self, counts, dt_us, age_us):
        """A tick without a sample: turn on with the last good one, `counts`."""
        if age_us > _PREDICT_US:
            return
        self.remember(counts)
        held = self._counts
        period_us = self.period_us
        left_us = dt_us + (period_us >> 1)
        while left_us >= period_us:
            left_us -= period_us
            self._made += 1
            self._turn_force(held)
            self._update(held)

    def _turn_force(self, held):
        """The force stays where it is in the earth: turn it against the sensor's rotation."""
        turn = self._turn
        x, y, z = held[0], held[1], held[2]
        a, b, c = held[4] * turn >> 14, held[5] * turn >> 14, held[6] * turn >> 14
        held[0] = _counts(x + (y * c - z * b >> 15))
        held[1] = _counts(y + (z * a - x * c >> 15))
        held[2] = _counts(z + (x * b - y * a >> 15))

    def close(self, counts, gap_us):
        """A good sample gap_us after the last good one; the caller updates with it afterwards."""
        made, self._made = self._made, 0
        if gap_us > _PREDICT_US:
            self.filter.relevel()
            return
        missing = (gap_us + (self.period_us >> 1)) // self.period_us - 1
        if not made and missing < 1:
            return
        extra = self._counts
        for axis in range(4, 7):
            rate = extra[axis]
            self._parts[axis - 4] = ((rate + counts[axis]) * missing >> 1) - rate * made
        most = max(max(self._parts), -min(self._parts))
        times = min(most // _HALF_SCALE + 1, _AT_ONCE)
        for i in range(3):
            extra[i] = counts[i]
            extra[4 + i] = _counts(self._parts[i] // times)
        for _ in range(times):
            self._update(extra)

    def _update(self, counts):
        if self.timed:
            self.update(counts, self.period_us)
        else:
            self.update(counts)


def _counts(value):
    return min(max(value, -_MOST), _MOST)

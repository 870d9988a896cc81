# SPDX-License-Identifier: MIT
"""The filter over ticks without a sample, and over ticks that never came.

Meanwhile the angle is turned on with the last good rate, each time from where the last good
sample left it. The sample that ends the gap brings the mean of the rates before and after: the
filter goes back to where the gap began and takes that. After too long a gap nobody knows the tilt
nor, if it turned, the yaw: the filter levels anew, and what is not known is said.
"""

from array import array

import micropython
from micropython import const

# places: firmware.tick.words
_FROM_US = const(15)
_UNSURE_US = const(16)
_YAW_LOST = const(17)

_PREDICT_US = const(250000)  # longer than that the last rate says nothing
_YAW_US = const(1000000)  # so long the mean of two rates is the best guess of the yaw
_LEVEL_US = const(1500000)  # after a levelling: the accelerometer may have been pushed
_TURNING_MDPS = const(3000)


@micropython.viper
def _copy(held: ptr16, memory: ptr16):
    i = 0
    while i < 7:
        held[i] = memory[i]
        i += 1


@micropython.viper
def turning(out: ptr32) -> int:
    """1 when a filter's `out` has a rate that is more than a rest's."""
    i = 3
    while i < 6:
        if out[i] > _TURNING_MDPS or out[i] < 0 - _TURNING_MDPS:
            return 1
        i += 1
    return 0


class Gap:
    """The bridge over one gap at a time; `words` are firmware.tick.words'."""

    def __init__(self, words):
        self._words = words
        self._held = array("h", [0] * 7)  # the last good burst before the gap
        self._turned = 0  # it turned when the gap began

    def rescale(self, was_lsb, is_lsb):
        """The gyro's range has changed: counts per deg/s before and now."""
        held = self._held
        for i in range(4, 7):
            held[i] = max(-32767, min(32767, round(held[i] * is_lsb / was_lsb)))

    @micropython.native
    def open(self, filter, memory):
        """A gap may begin: keep where the filter is; `memory` begins with the last good burst."""
        _copy(self._held, memory)
        self._turned = turning(filter.out)
        self._words[_FROM_US] = 0
        filter.keep()

    @micropython.native
    def predict(self, filter, age_us):
        """A tick without a sample, age_us after the last good one."""
        if age_us <= _PREDICT_US:
            filter.turn(self._held, self._held, age_us - self._words[_FROM_US])

    @micropython.native
    def close(self, filter, counts, gap_us, period_us):
        """A good sample gap_us after the last one; the caller updates with it afterwards.

        True when the gap was too long to be bridged.
        """
        missing_us = gap_us - self._words[_FROM_US] - period_us
        if missing_us > period_us >> 1 and gap_us <= _YAW_US:
            filter.turn(self._held, counts, missing_us)
        if gap_us <= _PREDICT_US:
            return False
        filter.relevel()
        return True

    @micropython.native
    def levelled(self, filter):
        """After the first update that followed such a gap: say what is not known."""
        words = self._words
        if self._turned or turning(filter.out):
            words[_YAW_LOST] = 1
            words[_UNSURE_US] = _LEVEL_US

# SPDX-License-Identifier: MIT
"""The filter over ticks without a sample, and over ticks that never came.

Meanwhile the angle is turned on with the last good rate, each time from where the last good
sample left it. The sample that ends the gap brings the mean of the rates before and after: the
filter goes back to where the gap began and takes that. After too long a gap, or one that hid a
rate beyond its range for long, nobody knows the tilt: the filter levels anew. How far the yaw may
be off adds up (YAW_DOUBT); where that is much, it is said to be lost.
"""

from array import array

import micropython
from micropython import const

# places: firmware.tick.words
_CAUSE = const(1)
_AGE_US = const(3)
_RING_US = const(7)
_FROM_US = const(15)
_UNSURE_US = const(16)
_YAW_LOST = const(17)
_YAW_DOUBT = const(28)

_JUMP = const(5)  # a cause of firmware.faults.policy
_REJECTED = const(8)  # a place of firmware.tick.judge's memory
_PREDICT_US = const(250000)  # longer than that the last rate says nothing
_YAW_US = const(1000000)  # so long the mean of two rates is the best guess of the yaw
_LEVEL_US = const(1500000)  # after a levelling: the accelerometer may have been pushed
_TURNING_MDPS = const(3000)
_LOST_MDEG = const(15000)  # from here on the yaw is not claimed any more
_OVER = const(4)  # a place of a Gap's rates: mdeg that a rate beyond its range may have hidden


@micropython.viper
def _copy(held: ptr16, memory: ptr16):
    value = 0
    i = 0  # the fourth local: an older one is in a register, where 1.26 would change it
    while i < 7:
        value = memory[i]
        held[i] = value
        i += 1


@micropython.viper
def _clipped(held: ptr16, memory: ptr16):
    """Rates at the end of their range, of the burst that was rejected last, are held instead."""
    value = 0
    i = 4
    while i < 7:
        value = memory[_REJECTED + i]
        if (value + 0x8200 & 0xFFFF) < 0x400:
            held[i] = value
        i += 1


@micropython.viper
def _doubt(out: ptr32, before: ptr32, gap_us: int) -> int:
    """How far the yaw may be off after a gap, mdeg: a quarter of what the change of the rate
    would make of the time (half, had it come at once at one end), and a sixteenth of the turn
    itself; all of it after too long a gap.
    """
    most = 0
    change = 0
    i = 0
    while i < 3:
        now = out[3 + i]
        then = before[i]
        t = now - then
        if t < 0:
            t = 0 - t
        if t > change:
            change = t
        if now < 0:
            now = 0 - now
        if then < 0:
            then = 0 - then
        if then > now:
            now = then
        if now > most:
            most = now
        i += 1
    if most < _TURNING_MDPS:
        return 0
    ms = gap_us // 1000
    if gap_us > _YAW_US:
        if ms > 10000:
            ms = 10000
        most = (most // 1000) * ms
    else:
        most = ((change >> 2) + (most >> 4)) // 16 * ms // 64
    if most > 180000:
        return 180000
    return most


def _scaled(count, was_lsb, is_lsb):
    return max(-32767, min(32767, round(count * is_lsb / was_lsb)))


class Gap:
    """The bridge over one gap at a time; `words` are firmware.tick.words'."""

    def __init__(self, words):
        self._words = words
        self._held = array("h", [0] * 7)  # the last good burst before the gap
        # and the filter's rates, mdeg/s; 1: at rest; not 0: a rate was beyond its range since then
        self._rates = array("i", [0] * 5)

    def rescale(self, memory, was_lsb, is_lsb, wider):
        """The ranges have changed: the gyro's counts per deg/s before and now, and by how much the
        accelerometer's is wider. `memory` is firmware.tick.judge's: what is a leap from the last
        good burst still is one."""
        held = self._held
        for i in (0, 1, 2, 4, 5, 6):
            was, now = (was_lsb, is_lsb) if i > 3 else (wider, 1)
            held[i] = _scaled(held[i], was, now)
            memory[i] = _scaled((memory[i] ^ 0x8000) - 0x8000, was, now) & 0xFFFF

    @micropython.native
    def open(self, filter, memory):
        """A gap may begin: keep where the filter is; `memory` begins with the last good burst."""
        _copy(self._held, memory)
        rates, out = self._rates, filter.out
        rates[0] = out[3]
        rates[1] = out[4]
        rates[2] = out[5]
        rates[3] = out[9]
        rates[_OVER] = 0
        self._words[_FROM_US] = 0
        filter.keep()

    @micropython.native
    def beyond(self, memory):
        """A rate is beyond its range: of all that is known the range's end is nearest to it."""
        self._rates[_OVER] = 1
        _clipped(self._held, memory)

    @micropython.native
    def predict(self, filter, age_us):
        """A tick without a sample, age_us after the last good one."""
        if age_us <= _PREDICT_US:
            filter.turn(self._held, self._held, age_us - self._words[_FROM_US])

    @micropython.native
    def zero_yaw(self, filter):
        """Where the filter looks now is yaw 0; a gap that is open goes on from there."""
        words = self._words
        age_us = words[_AGE_US]
        if age_us > words[_FROM_US]:
            self.predict(filter, age_us)
        filter.zero_yaw()
        filter.keep()
        words[_FROM_US] = age_us

    @micropython.native
    def close(self, filter, counts, gap_us, period_us):
        """A good sample gap_us after the last one; the caller updates with it afterwards, for the
        time that is returned."""
        left_us = gap_us - self._words[_FROM_US]
        missing_us = left_us - period_us
        if missing_us > period_us >> 1 and gap_us <= _YAW_US:
            filter.turn(self._held, counts, missing_us)
            left_us = period_us
        if self._rates[_OVER] and gap_us < _YAW_US:  # how much faster it turned, who knows
            self._rates[_OVER] = filter.gyro_dps * (gap_us // 1000)
        if gap_us > _PREDICT_US or self._rates[_OVER] > _LOST_MDEG:
            filter.relevel()
        return left_us

    @micropython.native
    def closed(self, filter, gap_us):
        """After the first update that followed a gap: say what is not known."""
        words = self._words
        over = self._rates[_OVER]
        if words[_CAUSE] == _JUMP and words[_UNSURE_US] < words[_RING_US]:
            words[_UNSURE_US] = words[_RING_US]  # a leap may be the low-pass of a saturation
        words[_CAUSE] = 0
        doubt = over + words[_YAW_DOUBT] + _doubt(filter.out, self._rates, gap_us)
        if gap_us > _YAW_US and not self._rates[3]:  # it may have turned there and back
            doubt = 180000
        words[_YAW_DOUBT] = doubt if doubt < 180000 else 180000
        if doubt > _LOST_MDEG and filter.knows_yaw:
            words[_YAW_LOST] = 1
        if gap_us > _PREDICT_US and doubt:
            over = 1
        if over and words[_UNSURE_US] < _LEVEL_US:
            words[_UNSURE_US] = _LEVEL_US

# SPDX-License-Identifier: MIT
"""A sample some time after the one before, for loops with gaps of their own.

The time is bridged in steps no longer than the period, so that no number leaves its range: each
with counts on the straight line between the two samples, and with the coefficient STEP for its
own length. Rates are then integrated by the trapezoid rule over the whole gap. A loop more than
four times as fast as the filter's rate makes Attitude's spans of rest and start shorter.
"""

import micropython
from micropython import const

from attitude.fixed.intmath import ratio

_STEP = const(25)  # of every filter's array: see base
_LONGEST_US = const(1000000)  # after a longer gap the filter levels anew


@micropython.viper
def bridge(self, counts: ptr16, dt_us: int):
    """One sample, dt_us after the one before; see Fixed.update."""
    s = ptr32(self._s)
    clock = ptr32(self._clock)
    last = ptr16(self._last)
    between = ptr16(self._between)
    at = int(self._seq_at)
    if clock[2] != s[at]:  # stepped without a time, or nothing so far
        i = 0
        while i < 7:
            last[i] = counts[i]
            i += 1
    nominal = clock[0]
    own = s[_STEP]
    if dt_us > _LONGEST_US:
        self.relevel()
        dt_us = nominal >> 4
    n = (dt_us << 4) // (nominal + nominal // 20) + 1
    s[_STEP] = int(ratio((dt_us << 4) // n, nominal))
    k = 1
    while k <= n:
        i = 0
        while i < 7:
            a = (int(last[i]) ^ 0x8000) - 0x8000
            b = (int(counts[i]) ^ 0x8000) - 0x8000
            between[i] = (a + (b - a) * k // n) & 0xFFFF
            i += 1
        self.step(self._between)
        k += 1
    i = 0
    while i < 7:
        last[i] = counts[i]
        i += 1
    s[_STEP] = own
    clock[2] = s[at]

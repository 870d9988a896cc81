# SPDX-License-Identifier: MIT
"""The integer twin of Kalman1D."""

from array import array

import micropython
from micropython import const

from attitude.fixed.gains import rows

_VALUE = const(0)  # times 2^11
_LEFT = const(1)  # samples left in this row of the gain table
_ROW = const(2)
_K = const(3)  # gain times 2^(30 + SHIFT), and its change per sample
_D = const(4)
_SHIFT = const(5)
_TABLE = const(6)


class Kalman1D:
    """One noisy value, an integer within +-180000 (millidegrees, counts); see the float twin.

    q, r, p are variances in that unit squared; with q = 0 the gain stops falling at 1/4000. It
    does not depend on the data and is made at construction, so a step costs no division. Within
    2 units and 1/4000 of a jump of the float twin.
    """

    def __init__(self, q=0.125, r=10.0, p=1.0):
        if q < 0.0 or r <= 0.0 or p < 0.0:
            raise ValueError("q and p: not below 0; r: above 0")
        table, shift, _ = rows(_knots(q, r, p))
        self._s = array("i", [0] * _TABLE + table)
        self._s[_SHIFT] = shift
        self.reset()

    def reset(self, value=0):
        """Continue from this value with the constructor's variance."""
        s = self._s
        s[_VALUE] = value * 2048
        s[_K] = s[_TABLE]
        s[_LEFT] = s[_TABLE + 2]
        s[_D] = s[_TABLE + 3]
        s[_ROW] = _TABLE + 2

    def state(self):
        """What set_state() takes to continue here: a tuple of integers."""
        return tuple(self._s[:_SHIFT])

    def set_state(self, state):
        """Continue from a state() of a filter with the same settings."""
        for i, value in enumerate(state):
            self._s[i] = value

    @micropython.viper
    def update(self, measurement: int, increment: int) -> int:
        """One measurement -> estimate; increment is what a gyro says the value has changed by.

        Both in the value's unit; give 0 as increment when nothing but the measurement is known.
        """
        s = ptr32(self._s)
        value = s[_VALUE] + (increment << 11)
        if value > 368640000:
            value = 368640000
        elif value < -368640000:
            value = -368640000
        k = s[_K]
        if s[_LEFT]:
            s[_K] = k + s[_D]
            s[_LEFT] -= 1
            if s[_LEFT] == 0:
                row = s[_ROW] + 3
                s[_ROW] = row
                s[_LEFT] = s[row]
                s[_D] = s[row + 1]
        # a gain that falls for long needs all of its 30 bits
        t = (measurement << 11) - value
        row = (t >> 15) * (k & 0x7FFF) + (t & 0x7FFF) * (k >> 15) >> 15
        value += ((t >> 15) * (k >> 15) + row) >> s[_SHIFT]
        s[_VALUE] = value
        return (value + 1024) >> 11


def _knots(q, r, p):
    """(sample, gain, 0) from paper 000, eqs. 2-4 and 15, until the gain stays."""
    knots = []
    n = due = 0
    while True:
        p += q
        gain = p / (p + r)
        p *= 1.0 - gain
        if n == due:
            knots.append((n, min(gain, 0.99996), 0.0))
            if n > 4000 or (len(knots) > 6 and abs(gain - knots[-2][1]) <= 1e-4 * gain):
                return knots
            due = n + 1 + n // 12
        n += 1

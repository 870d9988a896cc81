# SPDX-License-Identifier: MIT
"""The integer twin of MovingAverage."""

from array import array

import micropython
from micropython import const

_N = const(0)
_COUNT = const(1)
_INDEX = const(2)
_SUM = const(3)
_VALUES = const(4)


class MovingAverage:
    """Mean of the last n integers, of all of them until there are n; exact but for its rounding.

    n up to 4096, values within +-2^31 / n. An integer sum collects no rounding errors.
    """

    def __init__(self, n=50):
        if not 1 <= n <= 4096:
            raise ValueError("n %s: must be 1 to 4096" % n)
        self._s = array("i", [n, 0, 0, 0] + [0] * n)

    def reset(self):
        """Forget everything; the next value is the mean."""
        self._s[_COUNT] = self._s[_INDEX] = self._s[_SUM] = 0
        for i in range(_VALUES, len(self._s)):
            self._s[i] = 0

    def state(self):
        """What set_state() takes to continue here: a tuple of integers."""
        return tuple(self._s[_COUNT:])

    def set_state(self, state):
        """Continue from a state() of a filter with the same n."""
        for i, value in enumerate(state):
            self._s[_COUNT + i] = value

    @micropython.viper
    def update(self, value: int) -> int:
        """One value -> mean of the last n, rounded to the nearest."""
        s = ptr32(self._s)
        index = s[_INDEX]
        total = s[_SUM] + value - s[_VALUES + index]
        s[_SUM] = total
        s[_VALUES + index] = value
        n = s[_N]
        index += 1
        s[_INDEX] = 0 if index == n else index
        if s[_COUNT] < n:
            n = s[_COUNT] + 1
            s[_COUNT] = n
        return (total + (n >> 1)) // n

# SPDX-License-Identifier: MIT
"""Where up is on the average: levels at the start, and finds a lost attitude."""

from math import sqrt

from .quaternion import levelling, product, rotate, unit

_LOST_S = 2.0
_MIN_G = 0.5  # less is free fall or no sensor: it has no direction


class Up:
    """Sums the acceleration in the earth frame; `.level_g` is its level part of late."""

    def __init__(self):
        self.clear()

    def clear(self):
        """Nothing has been seen."""
        self._sum, self._sum_s = (0.0, 0.0, 0.0), 0.0
        self._seen_s = 0.0
        self.level_g = 0.0
        self.now = (0.0, 0.0, 0.0)  # the last block's mean acceleration in the earth frame, g

    def update(self, q, accel, span_s):
        """Take a block's mean acceleration, sensor axes; None if it has none."""
        if accel is None:
            self.now = (0.0, 0.0, 1.0)
            return
        x, y, z = self.now = rotate(q, *accel)
        a, b, c = self._sum
        self._sum = a + x * span_s, b + y * span_s, c + z * span_s
        self._sum_s += span_s
        self._seen_s += span_s
        k = max(span_s / min(self._seen_s, 3.0), 0.0)
        self.level_g += min(1.0, k) * (sqrt(x * x + y * y) - self.level_g)

    def levelled(self, q):
        """At the start: q turned the short way so that the mean so far points up; None if there
        is no gravity."""
        x, y, z = self._sum
        total = sqrt(x * x + y * y + z * z)
        if total <= _MIN_G * self._sum_s:
            self._sum, self._sum_s = (0.0, 0.0, 0.0), 0.0
            return None
        q = unit(product(levelling(x, y, z), q))
        self._sum = 0.0, 0.0, total
        return q

    def found(self, q):
        """Later: None, or q levelled anew if up has been more than 45 degrees away for seconds,
        which is no acceleration."""
        if self._sum_s < _LOST_S:
            return None
        x, y, z = self._sum
        level = x * x + y * y
        enough = _MIN_G * self._sum_s
        self._sum, self._sum_s = (0.0, 0.0, 0.0), 0.0
        if level + z * z > enough * enough and (z < 0.0 or level > z * z):
            return unit(product(levelling(x, y, z), q))
        return None

    def state(self):
        """All that changes, for set_state()."""
        return self._sum, self._sum_s, self._seen_s, self.level_g, self.now

    def set_state(self, state):
        """Go on from a state()."""
        self._sum, self._sum_s, self._seen_s, self.level_g, self.now = state

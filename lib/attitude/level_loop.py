# SPDX-License-Identifier: MIT
"""The position that should not be there: level acceleration integrated twice, with a leak."""

_LEAK = 2.0  # makes it the Butterworth polynomial s^3 + 2 s^2 + 2 s + 1
_TOP_LEAK_S = 10.0


class LevelLoop:
    """Velocity `.vx .vy` and position `.px .py`, in g by the gain (rad/s) and its square.

    The correction goes by the position, but no faster than the gyro may err: what pushes harder
    is an acceleration (a car brakes, a robot turns), unless it would add up to a speed beyond
    top_speed_m_s; then it is a wrong attitude.
    """

    def __init__(self, top_speed_m_s=25.0):
        self.top_speed_m_s = top_speed_m_s
        self.clear()

    def clear(self):
        """No velocity, no position, no limit."""
        self.vx = self.vy = self.px = self.py = 0.0
        self.limit_g = None  # of a position that corrects; None: any
        self._pushed = (0.0, 0.0)  # speed that passed for acceleration, g s

    def forget_velocity(self):
        """What has been lost in a saturated sample is not known."""
        self.vx = self.vy = 0.0

    def update(self, step, ax_g, ay_g):
        """Take level earth-frame acceleration; step is gain times dt."""
        self.vx += step * (ax_g - _LEAK * self.px)
        self.vy += step * (ay_g - _LEAK * self.py)
        self.px += step * (self.vx - _LEAK * self.px)
        self.py += step * (self.vy - _LEAK * self.py)

    def correction(self):
        """(x, y): the position that corrects, g."""
        most = self.limit_g
        if most is None:
            return self.px, self.py
        return max(-most, min(most, self.px)), max(-most, min(most, self.py))

    def limited(self):
        """(x, y): whether the position is beyond the limit."""
        most = self.limit_g
        return most is not None and abs(self.px) > most, most is not None and abs(self.py) > most

    def watch_speed(self, ax_g, ay_g, span_s):
        """A block's mean level acceleration: True if it cannot be one, for its speed."""
        x, y = self._pushed
        if True in self.limited():
            x, y = x + ax_g * span_s, y + ay_g * span_s
        else:
            x, y = [part * (1.0 - min(1.0, span_s / _TOP_LEAK_S)) for part in (x, y)]
        too_fast = (x * x + y * y) * 9.80665 ** 2 > self.top_speed_m_s ** 2
        self._pushed = (0.0, 0.0) if too_fast else (x, y)
        return too_fast

    def rescale(self, ratio):
        """The same velocity and position for a gain that has changed by this ratio."""
        self.vx *= ratio
        self.vy *= ratio
        self.px *= ratio * ratio
        self.py *= ratio * ratio

    def state(self):
        """All that changes, for set_state()."""
        return (self.vx, self.vy, self.px, self.py, self.limit_g, self._pushed)

    def set_state(self, state):
        """Go on from a state()."""
        self.vx, self.vy, self.px, self.py, self.limit_g, self._pushed = state

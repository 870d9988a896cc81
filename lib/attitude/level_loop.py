# SPDX-License-Identifier: MIT
"""The position that should not be there: level acceleration integrated twice, with a leak."""

_LEAK = 2.0  # makes it the Butterworth polynomial s^3 + 2 s^2 + 2 s + 1
_MOST_G = 0.05


class LevelLoop:
    """Velocity `.vx .vy` and position `.px .py`, in g by the gain (rad/s) and its square."""

    def __init__(self):
        self.clear()

    def clear(self):
        """No velocity, no position."""
        self.vx = self.vy = self.px = self.py = 0.0

    def forget_velocity(self):
        """What has been lost in a saturated sample is not known."""
        self.vx = self.vy = 0.0

    def update(self, step, ax_g, ay_g):
        """Take level earth-frame acceleration; step is gain times dt."""
        self.vx += step * (ax_g - _LEAK * self.px)
        self.vy += step * (ay_g - _LEAK * self.py)
        self.px += step * (self.vx - _LEAK * self.px)
        self.py += step * (self.vy - _LEAK * self.py)

    def rescale(self, ratio):
        """The same velocity and position for a gain that has changed by this ratio."""
        self.vx *= ratio
        self.vy *= ratio
        self.px *= ratio * ratio
        self.py *= ratio * ratio

    def position(self):
        """(x, y) in g, no more than a bias could cause: the rest is a wrong attitude."""
        return (max(-_MOST_G, min(_MOST_G, self.px)), max(-_MOST_G, min(_MOST_G, self.py)))

    def state(self):
        """All that changes, for set_state()."""
        return (self.vx, self.vy, self.px, self.py)

    def set_state(self, state):
        """Go on from a state()."""
        self.vx, self.vy, self.px, self.py = state

# SPDX-License-Identifier: MIT
"""How far the truth may be from what is claimed: one sigma of tilt and yaw, in degrees.

What is known of the gyro gives one part, what the level loop has seen of accelerations the other.
The error of the accelerometer itself (50 mg are 3 degrees) is not in it: a calibration finds that.
The factors were found on recordings and simulated motion, so that 95 % bounds (2.45 sigma of a
tilt, which has two axes, 1.96 of yaw) hold the truth for 90 to 99 % of the time.
"""

from math import degrees, radians, sqrt

_SHAKEN_S = 5.0
_SHAKEN = 0.6  # tilt by the position's root mean square
_LEAST_DEG = 0.1
_YAW = 0.8  # the learning is cautious, since its noise lasts: see _CORRELATED there
YAW_NOISE = radians(0.005)  # the gyro's, per root second (PS p. 12)
_FORGOTTEN = 8.0  # an error of a bias may last four times as long as the view of it
_OVER = radians(20.0)  # of a yaw, what a block beyond the gyro's range may hide
_CLAIMED_DEG, _DOUBTED_DEG = 1.0, 3.0


class Bounds:
    """Keeps what the views and the covariance do not tell; `.uncertain` is not 0 while the tilt is
    not known well enough to be claimed: 1 it levels, or its gyro is not known; 2 pushes have
    moved what it levels by."""

    def __init__(self):
        self.clear()

    def clear(self):
        """Nothing is known."""
        self._square = 0.0  # of the position, g^2
        self._explained = [0.0, 0.0]  # variance of it by the gyro, g^2
        self._yaw = 0.0  # variance that no view shows any more, rad^2
        self._over = False
        self.uncertain = 1

    def forget_yaw(self):
        """Yaw counts from here."""
        self._yaw = 0.0

    def explained(self, axis, variance):
        """What the gyro's errors explain of a position's variance (g^2) at this look."""
        self._explained[axis] = variance

    def update(self, loop, span_s, at_rest, young):
        """Once a block; young: the start is not over."""
        square = loop.px * loop.px + loop.py * loop.py
        self._square += min(1.0, span_s / _SHAKEN_S) * (square - self._square)
        self._yaw += YAW_NOISE * YAW_NOISE * span_s
        if self._over:
            self._yaw += _OVER * _OVER
            self._over = False
        if at_rest:
            self._explained = [0.0, 0.0]
        x, y = self._explained
        # a lasting error of the attitude shows as a position half of it
        sigma = tilt_deg(4.0 * (x + y), self._square)
        if not young and tilt_deg(0.0, self._square) > _DOUBTED_DEG:
            self.uncertain = 2
        elif young or sigma > _DOUBTED_DEG:
            self.uncertain = 1
        elif sigma < _CLAIMED_DEG:
            self.uncertain = 0

    def bias_forgotten(self, view, learning, keep):
        """The view's yaw keeps only this part of what old biases did; the rest stays in doubt."""
        for n in (0, 1, 2):
            self._yaw += _FORGOTTEN * (1.0 - keep) * (view.yaw[n] * learning.sigma[n]) ** 2

    def over_range(self):
        """In this block the gyro has lost a part of a turn."""
        self._over = True

    def tilt_sigma_deg(self, view, learning):
        """One sigma of a level axis."""
        variance = sum([learning.variance(view.of(0, axis)) for axis in (0, 1)])
        return tilt_deg(variance, self._square)

    def yaw_sigma_deg(self, view, learning):
        """One sigma of the yaw since the start."""
        return yaw_deg(self._yaw + learning.variance(view.yaw))

    def state(self):
        """All that changes, for set_state()."""
        return self._square, tuple(self._explained), self._yaw, self._over, self.uncertain

    def set_state(self, state):
        """Go on from a state()."""
        self._square, explained, self._yaw, self._over, self.uncertain = state
        self._explained = list(explained)


def tilt_deg(variance, square):
    """One sigma of a level axis by the variance of both, rad^2, and the position's, g^2."""
    sigma = degrees(sqrt((variance + _SHAKEN * _SHAKEN * square) / 2.0))
    return sqrt(sigma * sigma + _LEAST_DEG * _LEAST_DEG)


def yaw_deg(variance):
    """One sigma of the yaw by its variance, rad^2."""
    return degrees(_YAW * sqrt(variance))

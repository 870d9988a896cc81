# SPDX-License-Identifier: MIT
"""How a gyro bias shows in the level loop while the sensor turns."""

from .quaternion import rotate_back


class BiasView:
    """What the loop's position would be if each gyro axis had a bias of 1, for both level axes.

    A bias is fixed to the sensor, the loop to the earth and slow: by the time a bias shows, the
    sensor has turned on. So the attitude matrix goes through the same third-order filter as the
    bias does; the correction projected on it is the bias (least mean squares).
    """

    def __init__(self):
        self.clear()

    def clear(self):
        """No bias has been seen yet."""
        self._tilt = [0.0] * 6  # earth x in sensor axes, earth y in sensor axes
        self._velocity = [0.0] * 6
        self._position = [0.0] * 6

    def update(self, step, q):
        """Follow the attitude q; step is the loop's gain times the time since the last call."""
        rows = rotate_back(q, 1.0, 0.0, 0.0) + rotate_back(q, 0.0, 1.0, 0.0)
        tilt, velocity, position = self._tilt, self._velocity, self._position
        for i in range(6):
            tilt[i] += step * (rows[i] - position[i])
            velocity[i] += step * (tilt[i] - 2.0 * position[i])
            position[i] += step * (velocity[i] - 2.0 * position[i])

    def project(self, px, py):
        """The loop's position as a change of bias, sensor axes."""
        seen = self._position
        return tuple([seen[3 + i] * px - seen[i] * py for i in range(3)])

    def state(self):
        """All that changes, for set_state()."""
        return tuple(self._tilt + self._velocity + self._position)

    def set_state(self, state):
        """Go on from a state()."""
        self._tilt = list(state[:6])
        self._velocity = list(state[6:12])
        self._position = list(state[12:])

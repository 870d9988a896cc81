# SPDX-License-Identifier: MIT
"""How each error of a gyro shows in the attitude: what an error of 1 has added so far.

A gyro's errors are fixed to the sensor, the level loop to the earth and slow: by the time one
shows, the sensor has turned on. So each goes the way that the attitude and the loop's velocity
and position go: the same third-order filter, in the earth frame, once a block.

Errors are numbered: 0 to 2 the biases (rad/s), 3 to 11 a matrix row by row (3 + 3 i + j: what axis
i reads too much is that part of the rate about j), 12 and 13 a tilt unknown from the start (rad).
"""

from .quaternion import rotate_back

ERRORS = 14
_GYRO = 12  # of them the gyro's
_OF_AXIS = 13  # those that show on a level axis


class GyroView:
    """`.tilt[axis][error]` in rad, `.velocity` and `.position` in g by the gain and its square,
    for the level axes x and y; `.yaw[error]` in rad. An unknown tilt shows on its own axis only,
    as error 12 there.
    """

    def __init__(self):
        self.clear()
        self.forget_yaw()

    def clear(self):
        """No error has shown yet; yaw remembers."""
        self.tilt, self.velocity, self.position = [
            [[0.0] * _OF_AXIS, [0.0] * _OF_AXIS] for _ in range(3)
        ]
        self._rows = None

    def forget_yaw(self):
        """Yaw counts from here."""
        self.yaw = [0.0] * _GYRO

    def forget_velocity(self):
        """The loop's velocity has become zero, whatever it was."""
        self.velocity = [[0.0] * _OF_AXIS, [0.0] * _OF_AXIS]

    def begin_tilt(self):
        """The tilt is unknown from now on."""
        for axis in (0, 1):
            self.tilt[axis][12] = 1.0
            self.velocity[axis][12] = self.position[axis][12] = 0.0

    def follow_level(self, q, rates, span_s, step, limited):
        """A block of span_s with mean rates (rad/s) has ended at q; step is the loop's gain times
        span_s, `limited` says for each axis whether the loop's correction had reached its limit.
        """
        rows = rotate_back(q, 0.0, 1.0, 0.0), rotate_back(q, -1.0, 0.0, 0.0)
        last, self._rows = self._rows or rows, rows
        for axis in range(2):
            tilt, velocity, position = self.tilt[axis], self.velocity[axis], self.position[axis]
            mean = [0.5 * span_s * (a + b) for a, b in zip(last[axis], rows[axis])]
            back = 0.0 if limited[axis] else step
            for n, added in enumerate(_spread(mean, rates) + [0.0]):
                tilt[n] += added - back * position[n]
                velocity[n] += step * (tilt[n] - 2.0 * position[n])
                position[n] += step * (velocity[n] - 2.0 * position[n])

    def follow_yaw(self, q, rates, span_s, keep):
        """The same block, for yaw; `keep` is the part that an old bias keeps, since it walks."""
        row = [span_s * part for part in rotate_back(q, 0.0, 0.0, 1.0)]
        yaw = self.yaw
        for n, added in enumerate(_spread(row, rates)):
            yaw[n] = (yaw[n] * keep if n < 3 else yaw[n]) + added

    def of(self, kind, axis):
        """A row of ERRORS numbers: kind 0 tilt, 1 velocity, 2 position of level axis 0 or 1."""
        row = (self.tilt, self.velocity, self.position)[kind][axis]
        return row[:12] + ([0.0, row[12]] if axis else [row[12], 0.0])

    def state(self):
        """All that changes, for set_state()."""
        levels = [tuple(row) for part in (self.tilt, self.velocity, self.position) for row in part]
        return tuple(levels) + (self._rows, tuple(self.yaw))

    def set_state(self, state):
        """Go on from a state()."""
        rows = [list(row) for row in state[:6]]
        self.tilt, self.velocity, self.position = rows[:2], rows[2:4], rows[4:]
        self._rows, self.yaw = state[6], list(state[7])


def _spread(row, rates):
    """What the errors add through one row: biases at once, the matrix with the rates."""
    return list(row) + [part * rate for part in row for rate in rates]

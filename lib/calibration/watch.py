# SPDX-License-Identifier: MIT
"""Rest, seen in a running loop by a look at the driver's counts some times a second."""

from array import array
from collections import namedtuple
from math import sqrt

import micropython
from micropython import const

# Means over the time of rest: g, deg/s, degC
Rest = namedtuple("Rest", ("accel_g", "gyro_dps", "temp_c"))

_ACCEL_LIMIT_G = const(0.05)  # of one sample from the first
_DRIFT_LIMIT_G = const(0.012)  # of the mean from the first half to the second: a slow tilt
BIAS_LIMIT_DPS = const(40)  # of any bias, PS p. 12: +-20 at once and +-20 over temperature
_TURN_DPS = const(0.75)  # slower about a level axis nobody sees in half a second
_TEMP = const(3)


def near(a, b, bound):
    """Whether two vectors differ by so much at most, in each axis."""
    return max([abs(x - y) for x, y in zip(a, b)]) <= bound


def turn_dps(still, bias_dps, bound_dps):
    """Whether a Rest that is no bias as known was a turn: its rate about the vertical, or 0.0.

    bias_dps: as known, good to bound_dps. A difference that lies along gravity, which stood still,
    is a turn; any other is a bias that has changed, since a turn would have tilted gravity.
    """
    off = [g - b for g, b in zip(still.gyro_dps, bias_dps)]
    length = sqrt(sum([a * a for a in still.accel_g]))
    along = sum([o * a for o, a in zip(off, still.accel_g)]) / length
    across = sqrt(max(0.0, sum([o * o for o in off]) - along * along))
    return along if abs(along) > bound_dps and across <= max(bound_dps, _TURN_DPS) else 0.0


class Watch:
    """After `looks` looks at a sensor that stands still, rest() has their means.

    gyro_limit_dps: how far a rate may be from that of the first look. Two samples a second or
    more apart say nothing of what shakes in between, many of them do. Each look wants a sample of
    its own: ask fresh() first. Allocates in rest() only.
    """

    def __init__(self, imu, looks, gyro_limit_dps):
        self._counts = imu.counts
        self._imu = imu
        self._looks = looks
        self._gyro_limit_dps = gyro_limit_dps
        self._first = array("h", [0] * 7)
        self._last = array("h", [0] * 7)
        self._half = array("i", [0] * 7)
        self._sums = array("i", [0] * 7)
        self._n = 0

    def restart(self):
        """Look anew."""
        self._n = 0

    # native: as bytecode their frames would be heap blocks
    @micropython.native
    def fresh(self):
        """Whether another sample is there than at the last call: in an outage the last good one
        stays, and what it says, motion or rest, says nothing of now."""
        last, counts = self._last, self._counts
        other = False
        for i in range(7):
            if last[i] != counts[i]:
                last[i] = counts[i]
                other = True
        return other

    @micropython.native
    def look(self):
        """One look: 1 when rest() is due, 0 while it stands still, -1 when it has moved."""
        first, sums, counts = self._first, self._sums, self._counts
        moved = self._n > 0 and self._has_moved()
        if moved or self._n == 0 or self._n == self._looks:
            self._n = 0
            for i in range(7):
                first[i] = counts[i]
                sums[i] = 0
        for i in range(7):
            sums[i] += counts[i] - first[i]
        self._n += 1
        if self._n == self._looks // 2:
            for i in range(7):
                self._half[i] = sums[i]
        if self._n == self._looks and self._has_drifted():
            self._n = 0
            moved = True
        if moved:
            return -1
        return 1 if self._n == self._looks else 0

    @micropython.native
    def _has_moved(self):
        imu, counts, first = self._imu, self._counts, self._first
        limit = int(_ACCEL_LIMIT_G * imu.accel_lsb_per_g)
        for i in range(7):
            if i == _TEMP:
                limit = int(self._gyro_limit_dps * imu.gyro_lsb_per_dps)
            elif not -limit <= counts[i] - first[i] <= limit:
                return True
        return False

    def _has_drifted(self):
        """Half of the looks against the other half, as sums."""
        n = self._looks // 2
        limit = int(_DRIFT_LIMIT_G * self._imu.accel_lsb_per_g * n)
        for i in range(3):
            if abs(2 * self._half[i] - self._sums[i]) > limit:
                return True
        return False

    def rest(self):
        """A Rest of the looks since it stood still."""
        imu, n = self._imu, self._looks
        mean = [f + s / n for f, s in zip(self._first, self._sums)]
        accel = tuple([m / imu.accel_lsb_per_g for m in mean[:3]])
        gyro = tuple([m / imu.gyro_lsb_per_dps for m in mean[4:]])
        profile = imu.profile
        return Rest(accel, gyro, mean[_TEMP] / profile.temp_lsb_per_c + profile.temp_offset_c)

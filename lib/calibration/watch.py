# SPDX-License-Identifier: MIT
"""Rest, seen in a running loop by a look at the driver's counts some times a second."""

from array import array

from micropython import const

from calibration.rest import Rest

_ACCEL_LIMIT_G = const(0.05)  # of one sample from the first
_DRIFT_LIMIT_G = const(0.012)  # of the mean from the first half to the second: a slow tilt
_TEMP = const(3)


class Watch:
    """After `looks` looks at a sensor that stands still, rest() has their means.

    gyro_limit_dps: how far a rate may be from that of the first look. Two samples a second or
    more apart say nothing of what shakes in between, many of them do. Allocates in rest() only.
    """

    def __init__(self, imu, looks, gyro_limit_dps):
        self._counts = imu.counts
        self._imu = imu
        self._looks = looks
        self._gyro_limit_dps = gyro_limit_dps
        self._first = array("h", [0] * 7)
        self._half = array("i", [0] * 7)
        self._sums = array("i", [0] * 7)
        self._n = 0

    def restart(self):
        """Look anew."""
        self._n = 0

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
        """Rest (calibration.rest) of the looks since it stood still."""
        imu, n = self._imu, self._looks
        mean = [f + s / n for f, s in zip(self._first, self._sums)]
        accel = tuple([m / imu.accel_lsb_per_g for m in mean[:3]])
        gyro = tuple([m / imu.gyro_lsb_per_dps for m in mean[4:]])
        profile = imu.profile
        return Rest(accel, gyro, mean[_TEMP] / profile.temp_lsb_per_c + profile.temp_offset_c)

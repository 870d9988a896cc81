# SPDX-License-Identifier: MIT
"""Float filters fed with counts, with the integer ones' interface: millidegrees out."""

from attitude.tilt import accel_tilt_deg


class FromCounts:
    """Float filters fed with counts: `cores`, one of three axes or one for each axis.

    Given the measured time with each sample. Allocates, so the collector runs now and then.
    """

    timed = True
    at_rest = False  # they do not tell

    def __init__(self, cores, calibration, imu):
        self.cores = cores
        self._gyro_lsb = imu.gyro_lsb_per_dps
        self._accel_lsb = imu.accel_lsb_per_g
        self._calibration = calibration
        self._started = False
        self.roll_mdeg = self.pitch_mdeg = self.yaw_mdeg = 0

    def calibrate(self, calibration):
        """Correct the samples by this Calibration from now on."""
        self._calibration = calibration

    def _physical(self, counts):
        g, dps = self._accel_lsb, self._gyro_lsb
        return self._calibration.apply(
            (counts[0] / g, counts[1] / g, counts[2] / g),
            (counts[4] / dps, counts[5] / dps, counts[6] / dps),
        )

    def reset(self):
        """Start anew on the next sample."""
        self._started = False
        for core in self.cores:
            core.reset()

    def relevel(self):
        """The next sample starts anew: nobody knows what came before it."""
        self.reset()

    def state(self):
        """What set_state() takes to continue here."""
        return [core.state() for core in self.cores]

    def set_state(self, state):
        """Continue from a state() of the same kind."""
        self._started = True
        for core, own in zip(self.cores, state):
            if hasattr(core, "set_state"):
                core.set_state(own)
            elif isinstance(own, tuple):
                core.reset(*own)
            else:
                core.reset(own)

    def go_on_from(self, other):
        """Continue where another one of the same kind is, with own settings."""
        self.set_state(other.state())


class FloatAttitude(FromCounts):
    """The float Attitude."""

    def update(self, counts, dt_us):
        """One sample, dt_us after the last."""
        (ax, ay, az), (gx, gy, gz) = self._physical(counts)
        core = self.cores[0]
        core.update(gx, gy, gz, ax, ay, az, dt_us * 1e-6)
        self.roll_mdeg = round(core.roll_deg * 1000)
        self.pitch_mdeg = round(core.pitch_deg * 1000)
        self.yaw_mdeg = round(core.yaw_deg * 1000)


class FloatTilt(FromCounts):
    """Two one-axis filters, for roll and pitch; yaw stays 0."""

    def update(self, counts, dt_us):
        """One sample, dt_us after the last; the first one sets the angles."""
        accel, (gx, gy, _) = self._physical(counts)
        angles = accel_tilt_deg(*accel)
        if not self._started:
            self._started = True
            for core, angle in zip(self.cores, angles):
                core.reset(angle)
        roll, pitch = self.cores
        self.roll_mdeg = round(roll.update(angles[0], gx, dt_us * 1e-6) * 1000)
        self.pitch_mdeg = round(pitch.update(angles[1], gy, dt_us * 1e-6) * 1000)

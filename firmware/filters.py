# SPDX-License-Identifier: MIT
"""The estimators by the names of the knob `filter`: counts in, millidegrees out.

All have update(...), roll_mdeg, pitch_mdeg, yaw_mdeg, state(), set_state() and relevel(). The
integer ones take update(counts) at a fixed period; the float ones are wrapped here (FromCounts)
to take counts as well, and the measured time: update(counts, dt_us). `timed` tells which.
"""

_ATTITUDE = {
    "attitude_tau_s": "tau_s",
    "attitude_rest_tau_s": "rest_tau_s",
    "attitude_bias_tau_s": "bias_tau_s",
}
# knob filter: {knob: the filter's own name of the setting}
SETTINGS = {
    "attitude": _ATTITUDE,
    "kalman2": {
        "kalman_q_angle": "q_angle",
        "kalman_q_bias": "q_bias",
        "kalman_r_measure": "r_measure",
    },
    "float.attitude": _ATTITUDE,
    "float.kalman": {
        "kalman_q_angle": "q_angle",
        "kalman_q_bias": "q_bias",
        "kalman_r_measure": "r_measure",
    },
    "float.complementary": {"complementary_tau_s": "tau_s"},
}

# dlpf_hz: the gyro's delay in seconds (PS-MPU-6000A, table of DLPF_CFG)
_DELAY_S = {
    260: 0.00098,
    184: 0.0019,
    94: 0.0028,
    44: 0.0048,
    21: 0.0083,
    10: 0.0134,
    5: 0.0186,
}


def lag_s(config):
    """Age of what a burst says when it is read, seconds: filter delay and half a sample."""
    return _DELAY_S[config.dlpf_hz] + 0.5 / config.sensor_hz


def make(config, calibration, imu):
    """The filter that `config` asks for, calibrated, in its start state."""
    name = config.filter
    settings = {own: getattr(config, knob) for knob, own in SETTINGS[name].items()}
    if name.endswith("attitude"):
        settings["lag_s"] = lag_s(config)
    if name in ("attitude", "kalman2"):
        from attitude import fixed

        kind = fixed.Attitude if name == "attitude" else fixed.KalmanTilt2
        made = kind(
            rate_hz=config.rate_hz,
            gyro_dps=imu.gyro_range_dps,
            accel_g=imu.accel_range_g,
            **settings,
        )
        made.calibrate(calibration)
        return made
    if name == "float.attitude":
        from attitude import Attitude

        core = Attitude(
            config.rate_hz,
            gyro_range_dps=imu.gyro_range_dps,
            accel_range_g=imu.accel_range_g,
            **settings,
        )
        return FloatAttitude((core,), calibration, imu)
    if name == "float.kalman":
        from attitude import KalmanTilt as kind
    else:
        from attitude import Complementary as kind
    return FloatTilt((kind(**settings), kind(**settings)), calibration, imu)


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

    def __init__(self, cores, calibration, imu):
        from attitude import accel_tilt_deg

        super().__init__(cores, calibration, imu)
        self._tilt_deg = accel_tilt_deg

    def update(self, counts, dt_us):
        """One sample, dt_us after the last; the first one sets the angles."""
        accel, (gx, gy, _) = self._physical(counts)
        angles = self._tilt_deg(*accel)
        if not self._started:
            self._started = True
            for core, angle in zip(self.cores, angles):
                core.reset(angle)
        roll, pitch = self.cores
        self.roll_mdeg = round(roll.update(angles[0], gx, dt_us * 1e-6) * 1000)
        self.pitch_mdeg = round(pitch.update(angles[1], gy, dt_us * 1e-6) * 1000)

# SPDX-License-Identifier: MIT
"""The estimators by the names of the knob `filter`: counts in, millidegrees out.

All have update(...), roll_mdeg, pitch_mdeg, yaw_mdeg, state(), set_state() and relevel(). The
integer ones take update(counts) at a fixed period; the float ones are wrapped (from_counts) to
take counts as well, and the measured time: update(counts, dt_us). `timed` tells which.
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


def lag_s(config, imu):
    """Age of what a burst says when it is read, seconds: filter delay and half a sample."""
    return imu.delay_s + 0.5 / config.sensor_hz


def make(config, calibration, imu):
    """The filter that `config` asks for, calibrated, in its start state."""
    name = config.filter
    settings = {own: getattr(config, knob) for knob, own in SETTINGS[name].items()}
    if name.endswith("attitude"):
        settings["lag_s"] = lag_s(config, imu)
    ranges = {"gyro_dps": imu.gyro_range_dps, "accel_g": imu.accel_range_g}
    if name == "attitude":
        from attitude.fixed import Attitude

        made = Attitude(config.rate_hz, **ranges, **settings)
    elif name == "kalman2":
        from attitude.fixed import KalmanTilt2

        made = KalmanTilt2(config.rate_hz, **ranges, **settings)
    else:
        made = _float(name, config.rate_hz, ranges, settings)
    made.calibrate(calibration)
    return made


def _float(name, rate_hz, ranges, settings):
    from attitude.from_counts import FloatAttitude, FloatTilt

    if name == "float.attitude":
        return FloatAttitude(rate_hz, **ranges, **settings)
    if name == "float.kalman":
        from attitude import KalmanTilt as kind
    else:
        from attitude import Complementary as kind
    return FloatTilt(kind, rate_hz, **ranges, **settings)

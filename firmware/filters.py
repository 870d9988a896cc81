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
    from attitude.from_counts import FloatAttitude, FloatTilt

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

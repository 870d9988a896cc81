# SPDX-License-Identifier: MIT
"""The estimators by the names of the knob `filter`: counts in, millidegrees out.

All have the interface that firmware.tick works with: step(counts) at a fixed period (integers) or
update(counts, dt_us) with the measured time (float, `timed`), `out`, swap(), keep(), bridge(),
relevel(), zero_yaw(); and for the foreground prepare() and go_on_from().
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


def settings(config, imu):
    """{the filter's own name: value} of all that the knobs and the sensor say."""
    name = config.filter
    made = {own: getattr(config, knob) for knob, own in SETTINGS[name].items()}
    if name.endswith("attitude"):
        made["lag_s"] = lag_s(config, imu)
    return made


def is_timed(name):
    """Whether the filter of this name is a float one, which takes the time with each sample and
    allocates."""
    return name.startswith("float.")


def make(config, calibration, imu, rate_hz):
    """The filter that `config` asks for, calibrated, in its start state, for samples that come
    rate_hz times a second."""
    name = config.filter
    values = settings(config, imu)
    if name in ("attitude", "kalman2"):
        from attitude import fixed

        kind = fixed.Attitude if name == "attitude" else fixed.KalmanTilt2
        made = kind(
            rate_hz=rate_hz,
            gyro_dps=imu.gyro_range_dps,
            accel_g=imu.accel_range_g,
            **values,
        )
        made.calibrate(calibration)
        return made
    from attitude.from_counts import FloatAttitude, FloatTilt

    if name == "float.attitude":
        from attitude import Attitude

        core = Attitude(
            rate_hz,
            gyro_range_dps=imu.gyro_range_dps,
            accel_range_g=imu.accel_range_g,
            **values,
        )
        return FloatAttitude((core,), calibration, imu)
    if name == "float.kalman":
        from attitude import KalmanTilt as kind
    else:
        from attitude import Complementary as kind
    return FloatTilt((kind(**values), kind(**values)), calibration, imu)

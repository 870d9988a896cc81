# SPDX-License-Identifier: MIT
"""The estimators by the names of the knob `filter`: counts in, millidegrees out.

All have the interface that firmware.tick works with: step(counts) at a fixed period (integers) or
update(counts, dt_us) with the measured time (float, `timed`), `out`, swap(), keep(), turn(),
relevel(), zero_yaw(); and for the foreground prepare() and go_on_from().
"""

from firmware.briefly import Lasting

_loaded = {}  # type: dict  # knob filter: (class, what it is told first)

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
    values["gyro_dps"] = imu.gyro_range_dps
    values["accel_g"] = imu.accel_range_g
    if name not in _loaded:
        with Lasting():
            _loaded[name] = _load(name)
    kind, of = _loaded[name]
    made = kind(*of, rate_hz, **values)
    made.calibrate(calibration)
    return made


def _load(name):
    """(class, what it is told first) of the filter of this name."""
    if name == "attitude":
        from attitude.fixed import Attitude

        return Attitude, ()
    if name == "kalman2":
        from attitude.fixed import KalmanTilt2

        return KalmanTilt2, ()
    from attitude.from_counts import FloatAttitude, FloatTilt

    if name == "float.attitude":
        return FloatAttitude, ()
    if name == "float.kalman":
        from attitude import KalmanTilt as kind
    else:
        from attitude import Complementary as kind
    return FloatTilt, (kind,)

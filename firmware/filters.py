# SPDX-License-Identifier: MIT
"""The estimators by the names of the knob `filter`: counts in, millidegrees out.

All have the interface that firmware.tick works with: step(counts) at a fixed period (integers) or
update(counts, dt_us) with the measured time (float, `timed`), `out`, swap(), keep(), turn(),
relevel(), zero_yaw(); and for the foreground prepare() and go_on_from().
"""

import gc
import sys

from firmware.briefly import Lasting, forget

_loaded = {}  # type: dict  # knob filter: (class, what it is told first, modules that it brought)
_used = {}  # type: dict  # the bit of an App: the knob filter that it runs with

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
    rate_hz times a second. MemoryError where not even the code of unused ones makes room."""
    try:
        return _make(config, calibration, imu, rate_hz)
    except MemoryError:
        forget_unused(config.filter)
    try:
        return _make(config, calibration, imu, rate_hz)
    except MemoryError:
        forget_unused()
        text = "no piece of the heap is large enough for %s any more: Ctrl-D starts the board anew"
        raise MemoryError(text % config.filter) from None


def _make(config, calibration, imu, rate_hz):
    name = config.filter
    values = settings(config, imu)
    values["gyro_dps"] = imu.gyro_range_dps
    values["accel_g"] = imu.accel_range_g
    if name not in _loaded:
        with Lasting():
            _load(name)
    kind, of, _ = _loaded[name]
    made = kind(*of, rate_hz, **values)
    made.calibrate(calibration)
    return made


def _load(name):
    before = list(sys.modules)
    try:
        kind, of = _named(name)
    except BaseException:  # no heap for the rest: what has come by then is of no use
        forget(_since(before))
        raise
    _loaded[name] = kind, of, _since(before)


def use(mask, name):
    """The App with this bit runs with this one from now on."""
    _used[mask] = name


def forget_unused(wanted=None, room=None):
    """The code of filters that no App runs with is heap again: of all, or until `room` bytes are
    free; last that of attitude, which wants the largest pieces when it comes again."""
    for name in sorted(_loaded, key=_is_default):
        if room and gc.mem_free() >= room:
            break
        if name != wanted and name not in _used.values():
            forget(_loaded.pop(name)[2])
            gc.collect()


def _is_default(name):
    return name == "attitude"


def _since(before):
    return [name for name in sys.modules if name not in before]


def _named(name):
    """(class, what it is told first) of the filter of this name."""
    if name == "attitude":
        from attitude.fixed.attitude import Attitude

        return Attitude, ()
    if name == "kalman2":
        from attitude.fixed.kalman_tilt2 import KalmanTilt2

        return KalmanTilt2, ()
    if name == "float.attitude":
        from attitude.float_attitude import FloatAttitude

        return FloatAttitude, ()
    from attitude.float_tilt import FloatTilt

    if name == "float.kalman":
        from attitude.kalman_tilt import KalmanTilt

        return FloatTilt, (KalmanTilt,)
    from attitude.complementary import Complementary

    return FloatTilt, (Complementary,)

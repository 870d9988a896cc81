# SPDX-License-Identifier: MIT
"""The estimators by the names of the knob `filter`: counts in, millidegrees out.

All have the interface that firmware.tick works with: step(counts) at a fixed period (integers) or
update(counts, dt_us) with the measured time (float, `timed`), `out`, swap(), keep(), turn(),
relevel(), zero_yaw(); and for the foreground prepare() and go_on_from().
"""

import gc

from firmware.briefly import Briefly, Lasting

_loaded = {}  # type: dict  # knob filter: (class, what it is told first)
_used = {}  # type: dict  # the bit of an App: the knob filter that it runs with
_NO_ROOM = (
    "the heap has no room for %s beside what is loaded: app.config.set('filter', '%s'), "
    "app.save() and Ctrl-D start with it"
)

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
    values = settings(config, imu)
    values["gyro_dps"] = imu.gyro_range_dps
    values["accel_g"] = imu.accel_range_g
    kind, of = load(config.filter)
    often = gc.threshold()
    gc.threshold(-1)  # kalman2's gains leave much garbage
    try:
        try:
            made = kind(*of, rate_hz, **values)
        except MemoryError:  # no piece for its arrays
            forget_unused()
            made = kind(*of, rate_hz, **values)
        made.calibrate(calibration)
    finally:
        gc.threshold(often)
    return made


def load(name):
    """(class, what it is told first) of the filter of this name. MemoryError where not even the
    code of others, which nobody runs, makes room."""
    if name not in _loaded:
        try:
            with Briefly("firmware.loading"), Lasting():
                from firmware.loading import load

                load(name, _loaded, _used)
        except MemoryError:
            raise MemoryError(_NO_ROOM % (name, name)) from None
    return _loaded[name]


def use(mask, name):
    """The App with this bit runs with this one from now on."""
    _used[mask] = name


def leave(room):
    """Where less than `room` bytes are free, code of filters that nobody runs is heap again."""
    if gc.mem_free() < room:
        gc.collect()
        if gc.mem_free() < room:
            forget_unused()


def forget_unused():
    """The code of filters that no App runs with is heap again, but that of attitude."""
    with Briefly("firmware.loading"):
        from firmware.loading import unload

        unload(_loaded, _used)
    gc.collect()

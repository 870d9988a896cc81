# SPDX-License-Identifier: MIT
"""Every knob: default and range, as data; saved safely to flash. Its unit and meaning, which only
somebody who reads asks for, are in firmware.texts.

config.txt may be edited by hand: a line that is refused is named and its default used.
"""

from firmware.briefly import Briefly

PATH = "config.txt"
CALIBRATION_PATH = "calibration.txt"
_KIND = "config"
_VERSION = 1

# name, default, and its choices or the lowest and the highest value. A float default takes any
# number, an int default whole ones.
ROWS = (
    ("rate_hz", 250, 80, 1000),
    ("drive", "timer", ("timer", "data-ready")),
    ("burst", "auto", ("auto", "split", "blocking")),
    ("address", 0x68, (0x68, 0x69)),
    ("bus", -1, (-1, 0, 1)),
    ("bus_hz", 400000, 10000, 400000),
    ("pin_sda", -1, -1, 63),
    ("pin_scl", -1, -1, 63),
    ("pin_int", -1, -1, 63),
    ("pin_out_1", -1, -1, 63),
    ("pin_out_2", -1, -1, 63),
    ("pin_out_3", -1, -1, 63),
    ("pin_out_4", -1, -1, 63),
    ("allow_unknown", 0, (0, 1)),
    ("gyro_dps", 500, (250, 500, 1000, 2000)),
    ("accel_g", 8, (2, 4, 8, 16)),
    ("dlpf_hz", 44, (260, 184, 94, 44, 21, 10, 5)),
    ("sensor_hz", 1000, 4, 1000),
    (
        "filter",
        "attitude",
        ("attitude", "kalman2", "float.attitude", "float.kalman", "float.complementary"),
    ),
    ("kalman_q_angle", 0.001, 1e-06, 10.0),
    ("kalman_q_bias", 0.003, 0.0, 10.0),
    ("kalman_r_measure", 0.03, 0.0001, 1000.0),
    ("complementary_tau_s", 0.5, 0.01, 60.0),
    ("attitude_tau_s", 2.3, 0.1, 60.0),
    ("attitude_rest_tau_s", 0.5, 0.1, 60.0),
    ("attitude_bias_tau_s", 30.0, 1.0, 600.0),
    ("rest_s", 0.5, 0.0, 10.0),
    ("still_dps", 3.0, 0.1, 50.0),
    ("self_test", 0, (0, 1)),
    ("telemetry_hz", 50, 0, 100),
    ("telemetry_format", "plain", ("plain", "serial-studio", "teleplot", "plotjuggler")),
    ("failsafe_ms", 100, 10, 10000),
    ("output_failures", 3, 1, 1000),
    ("balance_kp", 200.0, 0.0, 1000.0),
    ("balance_kd", 6.0, 0.0, 100.0),
    ("balance_speed", 0.02, 0.0, 0.2),
    ("balance_travel", 0.006, 0.0, 0.1),
    ("platform_lead_ms", 45, 0, 200),
    ("platform_slew_dps", 300, 30, 2000),
    ("quad_angle_p", 5.0, 0.0, 20.0),
    ("quad_rate_p", 0.7, 0.0, 10.0),
    ("quad_rate_i", 1.0, 0.0, 10.0),
    ("quad_rate_d", 0.012, 0.0, 0.2),
    ("quad_yaw_angle_p", 3.0, 0.0, 20.0),
    ("quad_yaw_rate_p", 3.0, 0.0, 10.0),
    ("quad_yaw_rate_i", 1.5, 0.0, 10.0),
    ("watchdog_ms", 0, (0, 2000, 4000, 8000)),
)


def __getattr__(name):
    if name != "KNOBS":  # with all that is known of each; made for whoever asks
        raise AttributeError("firmware.config has no %s" % name)
    with Briefly("firmware.texts"):
        from firmware import texts

        return texts.knobs(ROWS)


class Config:
    """The values by name: `config.rate_hz`. `config.rate_hz = 500` is app.set("rate_hz", 500).

    name: of an App among several, for its files. change: the function of (name, value) that an
    assignment calls; the app's set().
    """

    def __init__(self, name=""):
        put = object.__setattr__  # past the one below
        before = name + "." if name else ""
        put(self, "path", before + PATH)
        put(self, "calibration_path", before + CALIBRATION_PATH)
        put(self, "_values", defaults())
        put(self, "change", self.set)

    def __getattr__(self, name):
        if name != "_values" and name in self._values:
            return self._values[name]
        raise AttributeError(_unknown(name))

    def __setattr__(self, name, value):
        if name == "change":
            object.__setattr__(self, name, value)
        elif name in self._values:
            self.change(name, value)
        else:
            raise AttributeError(_unknown(name))

    def set(self, name, value):
        """Set a knob here, not in a running app. ValueError naming what is allowed."""
        self._values[name] = checked(name, value)

    def values(self):
        """All values by name, for take()."""
        return self._values.copy()

    def take(self, values):
        """All values as they were."""
        self._values.update(values)

    def changed(self):
        """{name: value} of those that differ from their defaults."""
        out = {}
        for row in ROWS:
            if self._values[row[0]] != row[1]:
                out[row[0]] = self._values[row[0]]
        return out

    def reset(self):
        """All knobs back to their defaults; not saved."""
        self._values.update(defaults())

    def load(self, path=None):
        """Take the stored values; returns a list of warnings. Never fails because of the file."""
        path = path or self.path
        with Briefly("firmware.store"):
            from firmware import store

            stored, warnings = store.load(path, _KIND, _VERSION, by_hand=True)
        with Briefly("firmware.texts"):
            for name in sorted(stored or ()):
                try:
                    self.set(name, stored[name])
                except ValueError as error:
                    __import__("firmware.texts")  # once for all of them
                    warnings.append("%s: %s; default used" % (path, error))
        return warnings

    def save(self, path=None):
        """Write all values to flash, safely (firmware.store). OSError when the flash refuses."""
        with Briefly("firmware.store"):
            from firmware import store

            store.save(path or self.path, _KIND, _VERSION, self._values)

    def show(self, pausing=()):
        """Print each knob: value, unit, meaning, what is allowed; `*` marks one that differs from
        its default, `~` one of `pausing`, at whose change the ticks pause for some milliseconds.
        """
        with Briefly("firmware.texts"):
            from firmware import texts

            texts.show(ROWS, self._values, pausing)


def defaults():
    """{name: default} of all knobs."""
    return {row[0]: row[1] for row in ROWS}


def checked(name, value):
    """The value as the knob keeps it; ValueError when there is no such knob or it is refused."""
    for row in ROWS:
        if row[0] == name:
            break
    else:
        raise ValueError(_unknown(name))
    default = row[1]
    if isinstance(default, str):
        good = isinstance(value, str)
    elif isinstance(default, float):
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
    else:
        good = isinstance(value, int) and not isinstance(value, bool)
    if good:
        good = value in row[2] if len(row) == 3 else row[2] <= value <= row[3]
    if not good:
        with Briefly("firmware.texts"):
            from firmware import texts

            raise ValueError("%s = %r: %s" % (name, value, texts.allowed(row)))
    # a number of its own: the caller's lies among what the caller leaves, and this one stays
    return value * 1.0 if isinstance(default, float) else value


def _unknown(name):
    with Briefly("firmware.texts"):
        from firmware import texts

        return texts.unknown(str(name), ROWS)

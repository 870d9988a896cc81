# SPDX-License-Identifier: MIT
"""Every knob: default, unit, range and meaning, as data; saved safely to flash.

config.txt may be edited by hand: a line that is refused is named and its default used.
"""

from collections import namedtuple

from firmware import calibration, store

PATH = "config.txt"
_KIND = "config"
_VERSION = 1

# choices: a tuple, or None: then low to high. A float default takes any number, an int default
# whole ones.
Knob = namedtuple("Knob", ("name", "default", "unit", "choices", "low", "high", "meaning"))

_LINES = ("plain", "serial-studio", "teleplot", "plotjuggler")  # firmware.telemetry

_ROWS = (
    ("rate_hz", 250, "Hz", None, 80, 1000, "rate of the loop"),
    ("drive", "timer", "", ("timer", "data-ready"), 0, 0, "what ticks: timer, or the INT line"),
    ("burst", "auto", "", ("auto", "split", "blocking"), 0, 0, "auto: split on the RP2 port"),
    ("address", 0x68, "", (0x68, 0x69), 0, 0, "of the sensor; AD0 high is 0x69"),
    ("bus", -1, "", (-1, 0, 1), 0, 0, "I2C block; -1: that of the pins, or the first"),
    ("bus_hz", 400000, "Hz", None, 10000, 400000, "clock of the bus; less for long wires"),
    ("pin_sda", -1, "GPIO", None, -1, 63, "-1: the board's own"),
    ("pin_scl", -1, "GPIO", None, -1, 63, "the same"),
    ("pin_int", -1, "GPIO", None, -1, 63, "the same; of drive = data-ready"),
    ("pin_out_1", -1, "GPIO", None, -1, 63, "the same; servos and ESCs"),
    ("pin_out_2", -1, "GPIO", None, -1, 63, "the same"),
    ("pin_out_3", -1, "GPIO", None, -1, 63, "the same"),
    ("pin_out_4", -1, "GPIO", None, -1, 63, "the same"),
    ("allow_unknown", 0, "", (0, 1), 0, 0, "1: take an unknown WHO_AM_I for an MPU6050"),
    ("gyro_dps", 500, "deg/s", (250, 500, 1000, 2000), 0, 0, "range of the gyroscope"),
    ("accel_g", 8, "g", (2, 4, 8, 16), 0, 0, "range of the accelerometer"),
    ("dlpf_hz", 44, "Hz", (260, 184, 94, 44, 21, 10, 5), 0, 0, "the sensor's low-pass"),
    ("sensor_hz", 1000, "Hz", None, 4, 1000, "the sensor's own sample rate"),
    (
        "filter",
        "attitude",
        "",
        ("attitude", "kalman2", "float.attitude", "float.kalman", "float.complementary"),
        0,
        0,
        "the estimator; without a prefix in integers",
    ),
    ("kalman_q_angle", 0.001, "deg^2/s", None, 1e-6, 10.0, "process noise of the angle"),
    ("kalman_q_bias", 0.003, "(deg/s)^2/s", None, 0.0, 10.0, "process noise of the gyro bias"),
    ("kalman_r_measure", 0.03, "deg^2", None, 1e-4, 1000.0, "noise of the accelerometer angle"),
    ("complementary_tau_s", 0.5, "s", None, 0.01, 60.0, "time constant of float.complementary"),
    ("attitude_tau_s", 2.3, "s", None, 0.1, 60.0, "accelerometer time constant in motion"),
    ("attitude_rest_tau_s", 0.5, "s", None, 0.1, 60.0, "accelerometer time constant at rest"),
    ("attitude_bias_tau_s", 30.0, "s", None, 1.0, 600.0, "time constant of the gyro bias"),
    ("rest_s", 0.5, "s", None, 0.0, 10.0, "gyro bias at start: time at rest; 0 skips"),
    ("still_dps", 3.0, "deg/s", None, 0.1, 50.0, "spread of the gyro still taken for rest"),
    ("self_test", 0, "", (0, 1), 0, 0, "1: the chip tests itself at start, at rest; 1.3 s"),
    ("telemetry_hz", 50, "Hz", None, 0, 100, "lines per second; 0 silences"),
    ("telemetry_format", "plain", "", _LINES, 0, 0, "of the lines: plain, or for a program"),
    ("failsafe_ms", 100, "ms", None, 10, 10000, "age at which outputs go to their safe value"),
    ("output_failures", 3, "", None, 1, 1000, "exceptions in a row until an output is safe"),
    ("balance_kp", 200.0, "permille/deg", None, 0.0, 1000.0, "balance: of the lean"),
    ("balance_kd", 6.0, "permille s/deg", None, 0.0, 100.0, "balance: of its rate"),
    ("balance_speed", 0.02, "deg/permille", None, 0.0, 0.2, "balance: lean against the drive"),
    ("balance_travel", 0.006, "deg/permille/s", None, 0.0, 0.1, "balance: and against its sum"),
    ("platform_lead_ms", 45, "ms", None, 0, 200, "platform: how far the base is looked ahead"),
    ("platform_slew_dps", 300, "deg/s", None, 30, 2000, "platform: the servo's speed"),
    ("quad_angle_p", 5.0, "deg/s/deg", None, 0.0, 20.0, "quad, roll and pitch: rate wanted"),
    ("quad_rate_p", 0.7, "permille s/deg", None, 0.0, 10.0, "quad, roll and pitch: rate loop"),
    ("quad_rate_i", 1.0, "permille/deg", None, 0.0, 10.0, "the same, integral"),
    ("quad_rate_d", 0.012, "permille s2/deg", None, 0.0, 0.2, "the same, derivative"),
    ("quad_yaw_angle_p", 3.0, "deg/s/deg", None, 0.0, 20.0, "quad, yaw: rate wanted"),
    ("quad_yaw_rate_p", 3.0, "permille s/deg", None, 0.0, 10.0, "quad, yaw: rate loop"),
    ("quad_yaw_rate_i", 1.5, "permille/deg", None, 0.0, 10.0, "the same, integral"),
    ("watchdog_ms", 0, "ms", (0, 2000, 4000, 8000), 0, 0, "resets a board without good samples"),
)
KNOBS = tuple([Knob(*row) for row in _ROWS])
del _ROWS, _LINES


class Config:
    """The values by name: `config.rate_hz`. `config.rate_hz = 500` is app.set("rate_hz", 500).

    name: of an App among several, for its files. change: the function of (name, value) that an
    assignment calls; the app's set().
    """

    def __init__(self, name=""):
        put = object.__setattr__  # past the one below
        before = name + "." if name else ""
        put(self, "path", before + PATH)
        put(self, "calibration_path", before + calibration.PATH)
        put(self, "_values", {knob.name: knob.default for knob in KNOBS})
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
        for knob in KNOBS:
            if self._values[knob.name] != knob.default:
                out[knob.name] = self._values[knob.name]
        return out

    def reset(self):
        """All knobs back to their defaults; not saved."""
        for knob in KNOBS:
            self._values[knob.name] = knob.default

    def load(self, path=None):
        """Take the stored values; returns a list of warnings. Never fails because of the file."""
        path = path or self.path
        stored, warnings = store.load(path, _KIND, _VERSION, by_hand=True)
        for name in sorted(stored or ()):
            try:
                self.set(name, stored[name])
            except ValueError as error:
                warnings.append("%s: %s; default used" % (path, error))
        return warnings

    def save(self, path=None):
        """Write all values to flash, safely (firmware.store). OSError when the flash refuses."""
        store.save(path or self.path, _KIND, _VERSION, self._values)

    def show(self, pausing=()):
        """Print each knob: value, unit, meaning, what is allowed; `*` marks one that differs from
        its default, `~` one of `pausing`, at whose change the ticks pause for some milliseconds.
        """
        for knob in KNOBS:
            value = self._values[knob.name]
            differs = value != knob.default
            print(
                "%s%s %-20s %s %s  (%s; %s%s)"
                % (
                    "*" if differs else " ",
                    "~" if knob.name in pausing else " ",
                    knob.name,
                    value,
                    knob.unit,
                    knob.meaning,
                    _allowed(knob),
                    "; default %s" % knob.default if differs else "",
                )
            )


def checked(name, value):
    """The value as the knob keeps it; ValueError when there is no such knob or it is refused."""
    for knob in KNOBS:
        if knob.name == name:
            break
    else:
        raise ValueError(_unknown(name))
    default, choices = knob.default, knob.choices
    if isinstance(default, str):
        good = isinstance(value, str)
    elif isinstance(default, float):
        good = isinstance(value, (int, float)) and not isinstance(value, bool)
    else:
        good = isinstance(value, int) and not isinstance(value, bool)
    if good:
        good = value in choices if choices else knob.low <= value <= knob.high
    if not good:
        raise ValueError("%s = %r: %s" % (name, value, _allowed(knob)))
    return float(value) if isinstance(default, float) else value


def _allowed(knob):
    if knob.choices:
        return "one of " + ", ".join([str(choice) for choice in knob.choices])
    whole = "" if isinstance(knob.default, float) else "a whole number, "
    return "%s%s to %s %s" % (whole, knob.low, knob.high, knob.unit)


def _unknown(name):
    """Names the knob that shares the most pairs of letters."""
    best, most = "", 0
    name = str(name)
    for knob in KNOBS:
        shared = sum([name[i : i + 2] in knob.name for i in range(len(name) - 1)])
        shared = 2 * shared - abs(len(knob.name) - len(name))
        if knob.name.startswith(name):
            shared += 100
        if shared > most:
            best, most = knob.name, shared
    return "no knob %s%s" % (name[:40], ": did you mean %s?" % best if best else "")

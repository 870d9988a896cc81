# SPDX-License-Identifier: MIT
"""What is printed when somebody asks: app.help(), what a knob means and takes. Loaded for that,
and forgotten.
"""

from collections import namedtuple

_HELP = """app.start(), app.stop()            run in the background; end
app.roll_deg, .pitch_deg, .yaw_deg now; app.stale, app.uncertain: whether to believe them
app.sample()                       all of one instant
app.watch()                        lines for a plotter, until a key is pressed
app.show(), app.set(knob, value)   every knob; change one at once
app.changed(), app.undo()          what differs from its default; take back the last change
app.save(), app.defaults()         keep the knobs on the flash; all back to their defaults
app.stats(), app.report()          timing and faults; how the sensor is
app.zero_yaw()                     the direction it looks in is yaw 0
app.level_here()                   it stands level now: kept as its mounting
app.calibrating()                  calibrate, step by step
app.forget_scale()                 what was learned of the gyro's scale is taken back
app.outputs.add(update, safe)      call update(app) after each tick
with app.bus: ...                  other devices on the sensor's bus"""

# each knob's unit and meaning
_MEANINGS = {
    "rate_hz": ("Hz", "rate of the loop"),
    "drive": ("", "what ticks: timer, or the INT line"),
    "burst": ("", "auto: split on the RP2 port"),
    "address": ("", "of the sensor; AD0 high is 0x69"),
    "bus": ("", "I2C block; -1: that of the pins, or the first"),
    "bus_hz": ("Hz", "clock of the bus; less for long wires"),
    "pin_sda": ("GPIO", "-1: the board's own"),
    "pin_scl": ("GPIO", "the same"),
    "pin_int": ("GPIO", "the same; of drive = data-ready"),
    "pin_out_1": ("GPIO", "the same; servos and ESCs"),
    "pin_out_2": ("GPIO", "the same"),
    "pin_out_3": ("GPIO", "the same"),
    "pin_out_4": ("GPIO", "the same"),
    "allow_unknown": ("", "1: take an unknown WHO_AM_I for an MPU6050"),
    "gyro_dps": ("deg/s", "range of the gyroscope"),
    "accel_g": ("g", "range of the accelerometer"),
    "dlpf_hz": ("Hz", "the sensor's low-pass"),
    "sensor_hz": ("Hz", "the sensor's own sample rate"),
    "filter": ("", "the estimator; without a prefix in integers"),
    "kalman_q_angle": ("deg^2/s", "process noise of the angle"),
    "kalman_q_bias": ("(deg/s)^2/s", "process noise of the gyro bias"),
    "kalman_r_measure": ("deg^2", "noise of the accelerometer angle"),
    "complementary_tau_s": ("s", "time constant of float.complementary"),
    "attitude_tau_s": ("s", "accelerometer time constant in motion"),
    "attitude_rest_tau_s": ("s", "accelerometer time constant at rest"),
    "attitude_bias_tau_s": ("s", "time constant of the gyro bias"),
    "rest_s": ("s", "gyro bias at start: time at rest; 0 skips"),
    "still_dps": ("deg/s", "spread of the gyro still taken for rest"),
    "self_test": ("", "1: the chip tests itself at start, at rest; 1.3 s"),
    "telemetry_hz": ("Hz", "lines per second; 0 silences"),
    "telemetry_format": ("", "of the lines: plain, or for a program"),
    "failsafe_ms": ("ms", "age at which outputs go to their safe value"),
    "output_failures": ("", "exceptions in a row until an output is safe"),
    "balance_kp": ("permille/deg", "balance: of the lean"),
    "balance_kd": ("permille s/deg", "balance: of its rate"),
    "balance_speed": ("deg/permille", "balance: lean against the drive"),
    "balance_travel": ("deg/permille/s", "balance: and against its sum"),
    "platform_lead_ms": ("ms", "platform: how far the base is looked ahead"),
    "platform_slew_dps": ("deg/s", "platform: the servo's speed"),
    "quad_angle_p": ("deg/s/deg", "quad, roll and pitch: rate wanted"),
    "quad_rate_p": ("permille s/deg", "quad, roll and pitch: rate loop"),
    "quad_rate_i": ("permille/deg", "the same, integral"),
    "quad_rate_d": ("permille s2/deg", "the same, derivative"),
    "quad_yaw_angle_p": ("deg/s/deg", "quad, yaw: rate wanted"),
    "quad_yaw_rate_p": ("permille s/deg", "quad, yaw: rate loop"),
    "quad_yaw_rate_i": ("permille/deg", "the same, integral"),
    "watchdog_ms": ("ms", "resets a board without good samples"),
}

# choices: a tuple, or None: then low to high
Knob = namedtuple("Knob", ("name", "default", "unit", "choices", "low", "high", "meaning"))


def help():
    """Print what an App can be asked and told."""
    for line in _HELP.split("\n"):  # each by itself: a soft tick waits while one is sent
        print(line)


def knobs(rows):
    """A Knob of each of the rows of firmware.config."""
    return tuple([_knob(row) for row in rows])


def _knob(row):
    unit, meaning = _MEANINGS[row[0]]
    choices, low, high = (row[2], 0, 0) if len(row) == 3 else (None, row[2], row[3])
    return Knob(row[0], row[1], unit, choices, low, high, meaning)


def show(rows, values, pausing):
    """Print each knob (firmware.config.Config.show)."""
    for row in rows:
        knob = _knob(row)
        value = values[knob.name]
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
                allowed(row),
                "; default %s" % knob.default if differs else "",
            )
        )


def allowed(row):
    """What a knob takes, in words."""
    knob = _knob(row)
    if knob.choices:
        return "one of " + ", ".join([str(choice) for choice in knob.choices])
    whole = "" if isinstance(knob.default, float) else "a whole number, "
    return "%s%s to %s %s" % (whole, knob.low, knob.high, knob.unit)


def unknown(name, rows):
    """That there is no such knob; names the one that shares the most pairs of letters."""
    best, most = "", 0
    for row in rows:
        knob = row[0]
        shared = sum([name[i : i + 2] in knob for i in range(len(name) - 1)])
        shared = 2 * shared - abs(len(knob) - len(name))
        if knob.startswith(name):
            shared += 100
        if shared > most:
            best, most = knob, shared
    return "no knob %s%s" % (name[:40], ": did you mean %s?" % best if best else "")

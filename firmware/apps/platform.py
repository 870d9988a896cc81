# SPDX-License-Identifier: MIT
"""A camera platform that holds its top level: two servos, the sensor on the top plate.

    sensor on the plate -> attitude -> tilt of the plate, less the servo's own part = tilt of
    the base, as it will be when the servo gets there -> servo goes against it

The sensor rides on the plate, so a command cannot be the plate's tilt itself: a level plate would
ask for zero and the servo would fall back. Each command is the last one changed by what is
left of the tilt, with a model of the servo to tell what is still under way.

    from firmware.apps import platform
    app = platform.start()      # roll servo on the board's first output, pitch on its second
"""

import micropython
from control import Servo
from machine import PWM, Pin
from micropython import const

from firmware.app import App

# A standard servo: a pulse waits for its frame of 20 ms, then the servo's own loop closes the way.
_DELAY_US = const(12000)
_LAG_US = const(28000)
_LEAD_MS = const(45)  # how far ahead the base is looked for: both, and the sensor's own delay
_SMOOTH_US = const(25000)  # of the base's rate: a servo is never quite where its model is
_SLEW_DPS = const(300)


class Axis:
    """One servo and what is known of it. Angles in millidegrees, rates in millidegrees/s."""

    def __init__(self, servo, period_us):
        self.servo = servo
        self.tune(period_us)
        self.reset()

    def tune(self, period_us, lag_us=_LAG_US, lead_ms=_LEAD_MS, slew_dps=_SLEW_DPS):
        """Settings of the servo's model: its lag, its speed, and how far to look ahead."""
        self._waiting = [0] * max(1, _DELAY_US // period_us)  # commands on their way to it
        self._weight = period_us * 1024 // (lag_us + period_us)
        self._smooth = period_us * 1024 // (_SMOOTH_US + period_us)
        self._step = slew_dps * period_us // 1000
        self._per_s = 1000000 // period_us
        self._lead_ms = lead_ms

    def reset(self):
        """The servo is at its middle and at rest."""
        self.command = 0  # asked of the servo
        self.reached = 0  # where it is by now, as far as the model knows
        self.base_rate = 0
        self.resume()

    def resume(self):
        """What is on its way to the servo is the last command, wherever it is."""
        waiting = self._waiting
        for k in range(len(waiting)):
            waiting[k] = self.command
        self._next = 0

    @micropython.native
    def update(self, tilt, rate):
        """Plate's tilt and rate -> servo. Small integers only: nothing is allocated."""
        waiting, k = self._waiting, self._next
        move = (waiting[k] - self.reached) * self._weight >> 10
        move = min(max(move, -self._step), self._step)
        self.reached += move
        base = tilt - self.reached
        self.base_rate += (rate - move * self._per_s - self.base_rate) * self._smooth >> 10
        ahead = self.base_rate * self._lead_ms // 1000
        waiting[k] = self.command = self.servo.write(-base - ahead)
        self._next = 0 if k + 1 == len(waiting) else k + 1


class Platform:
    """The two axes as an output of the app."""

    def __init__(self, servos, period_us):
        self.roll = Axis(servos[0], period_us)
        self.pitch = Axis(servos[1], period_us)
        # until the attitude has settled the accelerometer still moves it, and the servos' jerks
        # move the accelerometer: held back for a second, or the platform shakes itself up
        self._wait = 1000000 // period_us

    def tune(self, period_us):
        """The loop's period, which the app tells also when it changes."""
        for axis in (self.roll, self.pitch):
            axis.tune(period_us)
            axis.resume()

    @micropython.native
    def update(self, app):
        """In each tick."""
        if self._wait:
            self._wait -= 1
            return
        tilt, rates = app.angles_mdeg, app.rates_mdps
        self.roll.update(tilt[0], rates[0])
        self.pitch.update(tilt[1], rates[1])

    @micropython.native
    def safe(self):
        """The estimate is lost: the servos stay where they are, which a camera forgives most."""


def start(app=None):
    """Set up and run; returns the app, whose `.platform` has the axes.

    With another sensor: app = App(); app.imu = MinIMU9(app.board.i2c()); start(app).
    """
    app = app or App()
    if app.imu is None:  # a sensor of the caller's, a MinIMU9 say, keeps its own filter
        app.set("dlpf_hz", 94)
    pins = app.board.outputs
    servos = [Servo(PWM(Pin(pin))) for pin in pins[:2]]
    app.platform = Platform(servos, 1000000 // app.config.rate_hz)
    app.outputs.add(app.platform.update, app.platform.safe, hard=True, tune=app.platform.tune)
    app.start()
    return app

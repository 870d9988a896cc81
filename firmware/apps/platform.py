# SPDX-License-Identifier: MIT
"""A camera platform that holds its top level: two servos, the sensor on the top plate.

    sensor on the plate -> attitude -> tilt of the plate, less the servo's own part = tilt of
    the base, as it will be when the servo gets there -> servo goes against it

The sensor rides on the plate, so a command cannot be the plate's tilt itself: a level plate would
ask for zero and the servo would fall back. Each command is the last one changed by what is
left of the tilt, with a model of the servo to tell what is still under way.

    from firmware.apps import platform
    app = platform.start()      # roll servo on the board's first output, pitch on its second

Knobs: platform_lead_ms (how far ahead the base is looked for), platform_slew_dps.
"""

import micropython
from control import Servo
from micropython import const

from firmware.apps.arming import running, running_app

# A standard servo: a pulse waits for its frame of 20 ms, then the servo's own loop closes the way.
_DELAY_US = const(12000)
_LAG_US = const(28000)
_SMOOTH_US = const(25000)  # of the base's rate: a servo is never quite where its model is
_PWM_HZ = const(50)


class Axis:
    """One servo and what is known of it. Angles in millidegrees, rates in millidegrees/s."""

    def __init__(self, servo, period_us, lead_ms, slew_dps):
        self.servo = servo
        self.command = 0  # asked of the servo
        self.reached = 0  # where it is by now, as far as the model knows
        self.base_rate = 0
        self.tune(period_us, lead_ms, slew_dps)

    def tune(self, period_us, lead_ms, slew_dps):
        """Settings of the servo's model: its speed, and how far to look ahead. What is on its
        way to the servo is the last command."""
        self._waiting = [self.command] * max(1, _DELAY_US // period_us)
        self._next = 0
        self._weight = period_us * 1024 // (_LAG_US + period_us)
        self._smooth = period_us * 1024 // (_SMOOTH_US + period_us)
        self._step = slew_dps * period_us // 1000
        self._per_s = 1000000 // period_us
        self._lead_ms = lead_ms

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
    """The two axes as a hard output of the app."""

    def __init__(self, app, servos):
        self._app = app
        period_us = app.period_us or 1000000 // app.config.rate_hz
        model = (app.config.platform_lead_ms, app.config.platform_slew_dps)
        self.roll = Axis(servos[0], period_us, *model)
        self.pitch = Axis(servos[1], period_us, *model)
        # until the attitude has settled the accelerometer still moves it, and the servos' jerks
        # move the accelerometer: held back for a second, or the platform shakes itself up
        self._wait = 1000000 // period_us

    def tune(self, period_us):
        """The loop's period and the knobs; the app calls it whenever they change."""
        config = self._app.config
        for axis in (self.roll, self.pitch):
            axis.tune(period_us, config.platform_lead_ms, config.platform_slew_dps)

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
    app = running_app(app)
    if app.has("platform"):
        return running(app)
    pins = app.board.take("platform", 2)
    if app.imu is None or hasattr(app.imu, "set_up"):  # a MinIMU-9 keeps its own filter
        app.set("dlpf_hz", 94)
    servos = [Servo(app.board.pwm(pin, _PWM_HZ)) for pin in pins]
    app.platform = Platform(app, servos)
    app.attach("platform", app.platform)
    return app

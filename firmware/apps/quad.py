# SPDX-License-Identifier: MIT
"""The attitude loop of a quadcopter at 1 kHz, in integers, without allocating a byte.

    sensor -> attitude ---angles---> angle loops --rates--> rate loops --torques--> mixer -> ESCs
                  |                  (P, 3 axes)            (PID, 3 axes)             ^
                  +---rates-------------------------------------^          throttle --+

The pilot's side sets the four commands and must repeat them: after link_ms without, or when the
estimate is lost, the motors stop. arm() refuses unless throttle is zero and the frame level.

    from firmware.apps import quad
    app = quad.start()      # ESCs on the board's four outputs, in control.mixer's order
    app.quad.command(0); app.quad.arm(app)
    app.quad.command(550, roll_mdeg=5000)
"""

import micropython
from control import Escs
from control.fixed import QuadControl
from machine import PWM, Pin
from micropython import const

from firmware.app import App

# Roll, pitch, yaw: deg/s per degree; permille of motor speed per deg/s, per degree, per deg/s^2.
# For the frame in tools/plants/quad.py; larger frames want more.
ANGLE_GAINS = (5.0, 5.0, 3.0)
RATE_GAINS = ((0.7, 1.0, 0.012), (0.7, 1.0, 0.012), (3.0, 1.5, 0.0))
_TORQUE_MAX = const(350)  # permille
_LINK_MS = const(500)
_CRASHED_MDEG = const(80000)  # no return from here: stop what still turns


class Quad:
    """The controller as an output of the app."""

    def __init__(self, escs, period_us):
        self.escs = escs
        self.throttle = 0
        self.yaw_mdeg = 0
        self.link_lost = 0  # times the motors stopped because nobody commanded
        self._link = 0
        self.tune(period_us)

    def tune(self, period_us):
        """The loop's period, which the app tells also when it changes."""
        self.control = QuadControl(ANGLE_GAINS, RATE_GAINS, _TORQUE_MAX, 1000000 / period_us)
        self.control.target(0, 0, self.yaw_mdeg)
        self._link_max = 1000 * _LINK_MS // period_us

    def command(self, throttle, roll_mdeg=0, pitch_mdeg=0, yaw_mdeg=None):
        """The pilot's wish: throttle in permille, angles in millidegrees; yaw None keeps it."""
        if yaw_mdeg is not None:
            self.yaw_mdeg = yaw_mdeg
        self.control.target(roll_mdeg, pitch_mdeg, self.yaw_mdeg)
        self.throttle = throttle
        self._link = 0

    def arm(self, app):
        """Let the motors turn. ValueError says why not."""
        tilt = app.angles_mdeg
        self.control.reset()
        self.command(0, 0, 0, tilt[2])
        self.escs.arm(self.throttle, max(abs(tilt[0]), abs(tilt[1])))

    @micropython.native
    def update(self, app):
        """In each tick."""
        angles, control, escs = app.angles_mdeg, self.control, self.escs
        control.update(self.throttle, angles, app.rates_mdps)
        escs.write(control.motors)
        if not escs.armed:
            return
        self._link += 1
        if self._link > self._link_max:
            self.link_lost += 1
            escs.safe()
        elif not (-_CRASHED_MDEG < angles[0] < _CRASHED_MDEG
                  and -_CRASHED_MDEG < angles[1] < _CRASHED_MDEG):  # fmt: skip
            escs.safe()

    @micropython.native
    def safe(self):
        """The estimate is lost: motors off, disarmed."""
        self.escs.safe()


def start(app=None):
    """Set up and run, disarmed; returns the app, whose `.quad` is the controller."""
    app = app or App()
    app.set("rate_hz", 1000)
    app.set("dlpf_hz", 94)
    escs = Escs([PWM(Pin(pin)) for pin in app.board.outputs])
    app.quad = Quad(escs, 1000000 // app.config.rate_hz)
    app.outputs.add(app.quad.update, app.quad.safe, hard=True, tune=app.quad.tune)
    app.start()
    return app

# SPDX-License-Identifier: MIT
"""The attitude loop of a quadcopter at 1 kHz, in integers, without allocating a byte.

    sensor -> attitude ---angles---> angle loops --rates--> rate loops --torques--> mixer -> ESCs
                  |                  (P, 3 axes)            (PID, 3 axes)             ^
                  +---rates-----------------------------^                throttle ----+

The pilot's side sets the four commands and must repeat them: after link_ms without, when the
frame is on its side, or when the estimate is lost, the motors stop.

    from firmware.apps import quad
    app = quad.start()      # ESCs on the board's four outputs, in control.mixer's order
    app.quad.command(0); app.quad.arm()
    app.quad.command(550, roll_mdeg=5000)

Gains are knobs: quad_angle_p, quad_rate_p, quad_rate_i, quad_rate_d of roll and pitch,
quad_yaw_angle_p, quad_yaw_rate_p, quad_yaw_rate_i; for the frame in tools/plants/quad.py, larger
frames want more.
"""

import micropython
from control import Escs
from control.fixed import QuadControl
from micropython import const

from firmware.apps.arming import refuse, running, running_app

_TORQUE_MAX = const(350)  # permille
_LINK_MS = const(500)
_CRASHED_MDEG = const(80000)  # no return from here: stop what still turns
_PWM_HZ = const(400)
_STOP_NS = const(1000000)
_TAU_S = const(20.0)  # in free flight the accelerometer says "level" whatever the attitude is


class Quad:
    """The controller as a hard output of the app."""

    def __init__(self, app, escs):
        self._app = app
        self.escs = escs
        self.throttle = 0
        self.yaw_mdeg = 0
        self.link_lost = 0  # times the motors stopped because nobody commanded
        self._link = 0
        self.control = None
        self.tune(app.period_us or 1000000 // app.config.rate_hz)

    def tune(self, period_us):
        """The loop's period and the knobs; the app calls it whenever they change. What it does at
        the moment goes on."""
        c = self._app.config
        level = (c.quad_rate_p, c.quad_rate_i, c.quad_rate_d)
        control = QuadControl(
            (c.quad_angle_p, c.quad_angle_p, c.quad_yaw_angle_p),
            (level, level, (c.quad_yaw_rate_p, c.quad_yaw_rate_i, 0.0)),
            _TORQUE_MAX,
            1000000 / period_us,
        )
        control.go_on_from(self.control)
        self.control = control
        self._link_max = 1000 * _LINK_MS // period_us

    def command(self, throttle, roll_mdeg=0, pitch_mdeg=0, yaw_mdeg=None):
        """The pilot's wish: throttle in permille, angles in millidegrees; yaw None keeps it."""
        if yaw_mdeg is not None:
            self.yaw_mdeg = yaw_mdeg
        self.control.target(roll_mdeg, pitch_mdeg, self.yaw_mdeg)
        self.throttle = throttle
        self._link = 0

    def arm(self, app=None):
        """Let the motors turn. ValueError says why not."""
        app = app or self._app
        refuse(app, "quad")
        if not app.filter.knows_yaw:
            text = "not armed: the filter %s does not know the yaw; app.set('filter', 'attitude')"
            raise ValueError(text % app.config.filter)
        tilt = app.angles_mdeg
        throttle = self.throttle
        if not throttle:
            self.command(0, 0, 0, tilt[2])
            self.control.reset()
        self.escs.arm(throttle, max(abs(tilt[0]), abs(tilt[1])))

    def check(self, config):
        """ValueError where it flies, and these knobs would take from it what it steers by."""
        if self.armed and not config.filter.endswith("attitude"):
            text = "the quad is armed, and the filter %s does not know the yaw"
            raise ValueError(text % config.filter)

    def disarm(self):
        """Motors off, until arm()."""
        self.safe()

    @property
    def armed(self):
        """Whether the motors may turn."""
        return self.escs.armed

    @micropython.native
    def update(self, app):
        """In each tick."""
        angles, control, escs = app.angles_mdeg, self.control, self.escs
        control.update(self.throttle, angles, app.rates_mdps)
        escs.write(control.motors)
        if not escs.armed:
            return
        self._link += 1
        roll, pitch = angles[0], angles[1]
        if self._link > self._link_max:
            self.link_lost += 1
            escs.safe()
        elif max(roll, pitch) > _CRASHED_MDEG or min(roll, pitch) < -_CRASHED_MDEG:
            escs.safe()

    @micropython.native
    def safe(self):
        """The estimate is lost, or the loop ends: motors off, disarmed."""
        self.escs.safe()


def start(app=None):
    """Set up and run, disarmed; returns the app, whose `.quad` is the controller."""
    app = running_app(app)
    if app.has("quad"):
        return running(app)
    pins = app.board.take("quad", 4)
    app.set("rate_hz", 1000)
    app.set("dlpf_hz", 94)
    app.set("attitude_tau_s", _TAU_S)
    escs = Escs([app.board.pwm(pin, _PWM_HZ, _STOP_NS) for pin in pins])
    app.quad = Quad(app, escs)
    app.attach("quad", app.quad)
    return app

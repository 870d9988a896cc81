# SPDX-License-Identifier: MIT
"""A self-balancing robot: two geared motors, no encoders.

    sensor -> attitude -> lean ---(+)--> PID with the gyro's rate -> H-bridges
                                   |
    target lean <- speed loop <- drive, low-passed (a geared motor's speed follows its voltage)

The speed loop leans the robot against its own movement and sums up what remains, so it stands
where it is, and on what is really its balance: an error of the accelerometer or of the mounting
ends up in the target lean, not in a robot that drives away.

    from firmware.apps import balance
    app = balance.start()     # motors: left forward, left back, right forward, right back
    app.balance.arm()         # hold it upright for a second: then it balances

Gains are knobs: balance_kp, balance_kd, balance_speed, balance_travel; for the robot in
tools/plants/balance.py.
"""

import micropython
from control import HBridge
from control.fixed import PID
from micropython import const

from firmware.apps.arming import refuse, running, running_app

_LAG_US = const(200000)  # of the drive's low-pass
_LEAN_MAX_MDEG = const(12000)
_FALLEN_MDEG = const(40000)
_UPRIGHT_MDEG = const(5000)
_PWM_HZ = const(20000)


class Balance:
    """The controller as a hard output of the app. Angles in millidegrees, drive in permille.

    armed: the motors may turn once it has been held upright for a second, and again after a
    fall, until disarm(), a stale estimate or the end of the loop. running: they do.
    """

    def __init__(self, app, motors):
        self._app = app
        self._motors = motors
        self.armed = self.running = False
        self.tune(app.period_us or 1000000 // app.config.rate_hz)
        self._begin()

    def tune(self, period_us):
        """The loop's period and the knobs; the app calls it whenever they change. What it does at
        the moment goes on."""
        config = self._app.config
        self._speed_mdeg = round(config.balance_speed * 1000)
        self._lag = period_us * 1024 // (_LAG_US + period_us)
        self._per_tick = round(config.balance_travel * 1000 * period_us / 1000000 * 1024)
        kp, kd = config.balance_kp / 1000, config.balance_kd / 1000
        self.pid = PID(kp, 0, kd, 1000, 1000000 / period_us, input_max=500000)
        self._second = 1000000 // period_us

    def arm(self, app=None):
        """Let the motors turn once it stands upright. ValueError says why not."""
        refuse(app or self._app, "balance")
        self._begin()
        self.armed = True

    def disarm(self):
        """Motors off, until arm()."""
        self.safe()

    @micropython.native
    def update(self, app):
        """In each tick. Starts when the armed robot has been held upright for 1 s."""
        if not self.armed:
            return
        lean = app.angles_mdeg[1]
        if not self.running:
            upright = -_UPRIGHT_MDEG < lean < _UPRIGHT_MDEG
            self._wait = self._wait - 1 if upright else self._second
            self.running = self._wait == 0
        elif lean > _FALLEN_MDEG or lean < -_FALLEN_MDEG:
            self._rest()
        else:
            self._balance(lean, app.rates_mdps[1])

    @micropython.native
    def _balance(self, lean, rate):
        speed = self._speed >> 10
        self._travel += speed * self._per_tick
        limit = _LEAN_MAX_MDEG << 10
        self._travel = min(max(self._travel, -limit), limit)
        target = -self._speed_mdeg * speed - (self._travel >> 10)
        target = min(max(target, -_LEAN_MAX_MDEG), _LEAN_MAX_MDEG)
        drive = -self.pid.update(target - lean, rate)
        self._speed += (drive - speed) * self._lag
        for motor in self._motors:
            motor.write(drive)

    @micropython.native
    def _begin(self):
        self._wait = self._second
        self._speed = 0  # low-passed drive, 1/1024 permille
        self._travel = 0  # its sum as a lean, 1/1024 mdeg
        self.pid.reset()

    @micropython.native
    def _rest(self):
        self.running = False
        for motor in self._motors:  # first, whatever happens to the rest
            motor.stop()
        self._begin()

    @micropython.native
    def safe(self):
        """The estimate is lost, or the loop ends: motors off and disarmed."""
        self.armed = False
        self._rest()


def start(app=None):
    """Set up and run, disarmed; returns the app, whose `.balance` is the controller."""
    app = running_app(app)
    if app.has("balance"):
        return running(app)
    pins = app.board.take("balance", 4)
    pwms = [app.board.pwm(pin, _PWM_HZ) for pin in pins]
    app.set("dlpf_hz", 94)
    app.balance = Balance(app, (HBridge(pwms[0], pwms[1]), HBridge(pwms[2], pwms[3])))
    app.attach("balance", app.balance)
    return app

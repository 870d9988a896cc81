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
"""

import micropython
from control import HBridge
from control.fixed import PID
from machine import PWM, Pin
from micropython import const

from firmware.app import App

# Gains in permille of the supply and degrees; for the robot in tools/plants/balance.py.
KP, KD = 200.0, 6.0
_SPEED_MDEG = const(20)  # of lean against each permille of drive
TRAVEL = 0.006  # degrees of lean per permille of drive and second
_LAG_US = const(200000)  # of the drive's low-pass
_LEAN_MAX_MDEG = const(12000)
_FALLEN_MDEG = const(40000)
_UPRIGHT_MDEG = const(5000)


class Balance:
    """The controller as an output of the app. Angles in millidegrees, drive in permille."""

    def __init__(self, motors, period_us):
        self._motors = motors
        self.running = False
        self.tune(period_us)

    def tune(self, period_us):
        """The loop's period, which the app tells also when it changes."""
        self._lag = period_us * 1024 // (_LAG_US + period_us)
        self._per_tick = round(TRAVEL * 1000 * period_us / 1000000 * 1024)
        self.pid = PID(KP / 1000, 0, KD / 1000, 1000, 1000000 / period_us, input_max=500000)
        self._second = 1000000 // period_us
        self._begin()

    @micropython.native
    def update(self, app):
        """In each tick. Starts when the robot has been held upright for 1 s."""
        lean = app.angles_mdeg[1]
        if not self.running:
            upright = -_UPRIGHT_MDEG < lean < _UPRIGHT_MDEG
            self._wait = self._wait - 1 if upright else self._second
            self.running = self._wait == 0
        elif lean > _FALLEN_MDEG or lean < -_FALLEN_MDEG:
            self.safe()
        else:
            self._balance(lean, app.rates_mdps[1])

    @micropython.native
    def _balance(self, lean, rate):
        speed = self._speed >> 10
        self._travel += speed * self._per_tick
        limit = _LEAN_MAX_MDEG << 10
        self._travel = min(max(self._travel, -limit), limit)
        target = -_SPEED_MDEG * speed - (self._travel >> 10)
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
    def safe(self):
        """Fallen, or the estimate is lost: motors off until it stands upright again."""
        self.running = False
        self._begin()
        for motor in self._motors:
            motor.stop()


def start(app=None):
    """Set up and run; returns the app, whose `.balance` is the controller."""
    app = app or App()
    app.set("dlpf_hz", 94)
    pwms = [PWM(Pin(pin)) for pin in app.board.outputs]
    app.balance = Balance(
        (HBridge(pwms[0], pwms[1]), HBridge(pwms[2], pwms[3])), 1000000 // app.config.rate_hz
    )
    app.outputs.add(app.balance.update, app.balance.safe, hard=True, tune=app.balance.tune)
    app.start()
    return app

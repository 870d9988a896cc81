# SPDX-License-Identifier: MIT
"""A controller of one's own: a PID holds the roll at 0 with a motor on an H-bridge.

Wire the sensor as in print_angles.py, the bridge's two inputs (DRV8833, L298) to the pins that
are printed. The wheels off the ground first: it drives at once.
At the REPL, while it runs: pid.tune(kp=30) or hold.target_deg = 2.
"""

from control import PID, HBridge

from firmware.app import App


class Hold:
    """Roll to drive; degrees in, permille of the supply out."""

    target_deg = 0.0

    def update(self, app):
        """After each tick. The gyro's rate is the derivative: no difference, no noise of one."""
        error = self.target_deg - app.roll_deg
        rate_dps = app.rates_mdps[0] / 1000
        motor.write(int(pid.update(error, app.period_us / 1e6, rate=rate_dps)))

    def safe(self):
        """No estimate, or the loop has stopped: coast, and begin without the old integral."""
        motor.stop()
        pid.reset()


app = App()
app.start()
pins = app.board.take("own_pid", 2)
motor = HBridge(app.board.pwm(pins[0], 20000), app.board.pwm(pins[1], 20000))
pid = PID(kp=20, ki=10, kd=0.5, limit=1000)
hold = Hold()
app.outputs.add(hold.update, hold.safe)
print("forward GP%d, backward GP%d" % tuple(pins))

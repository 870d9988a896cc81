# SPDX-License-Identifier: MIT
"""A servo that follows the roll angle: 1 ms at -45 degrees, 1.5 ms level, 2 ms at +45 degrees.

Wire the sensor as in print_angles.py, the servo's signal to the pin that is printed, its
supply to 5 V of its own (not the board's 3V3), the grounds together.
The program ends and the servo goes on: the loop runs in the background, the REPL is free.
"""

from control import Servo

from firmware.app import App

app = App()
app.start()
pin = app.board.take("servo", 1)[0]
servo = Servo(app.board.pwm(pin, 50), pulse_us=(1000, 2000), angle_deg=(-45, 45), slew_dps=None)


def follow(app):
    """After each tick."""
    servo.write(app.angles_mdeg[0])


app.outputs.add(follow, servo.release)  # without an estimate: no pulses, the servo lets go
print("the servo's signal is GP%d" % pin)

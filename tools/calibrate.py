# SPDX-License-Identifier: MIT
"""Calibrates a board's sensor, step by step: gyro at rest, six faces (or any poses), mounting.

`python -m tools.calibrate --port /dev/ttyACM0` asks for each pose, lets the board measure, tells
at once when it was not still, and stores the result on the board; the next start uses it.
`--virtual` prints the figures of the procedure on a virtual sensor at the datasheet's worst.
`--poses 14` takes that many poses of any kind instead of the faces of a box; `--mounting` finds
how the sensor sits in the robot, `--slope 4` does so on a floor that is not level.
"""

import argparse
import ast
import datetime
import sys

from mpremote.transport import TransportError

from tools.deploy import DeployError, open_board

_SETUP = """
from firmware.board import find
from firmware.calibrating import merged
from firmware.config import Config
from firmware.startup import load_calibration, save_calibration, sensor
from mpu6050 import mounting
from mpu6050.calibrate import Poses, gyro_bias, rest
def attempt(function):
    try:
        answer = True, function()
    except ValueError as error:
        answer = False, str(error)
    print(repr(answer))
config = Config()
config.load()
imu = sensor(find(), config)
stored = cal = load_calibration()[0]
poses = Poses(imu)
readings = []
def level():
    readings.append(cal.apply(rest(imu, %(seconds)s).accel_g, (0, 0, 0))[0])
def solve():
    global cal
    cal = gyro_bias(imu, poses.solve(cal, faces=%(faces)s), %(seconds)s)
    return cal.residual_mg, cal.accel_bias_g, cal.gyro_bias_dps, cal.temp_c
def mount():
    global cal
    cal = cal.mounted(mounting.from_tilt(mounting.level_of(readings[:-1]), readings[-1]))
    return mounting.nearest(cal.gyro_matrix)
"""


class Refused(Exception):
    """The board says no to a step, in words for the person who holds it."""


class Guide:
    """One calibration. `run(code)` executes on the board, `ask(text)` waits for the person."""

    def __init__(self, run, ask=input, say=print, seconds=1.0, faces=True):
        self._run, self._ask, self._say = run, ask, say
        self._seconds = seconds
        run(_SETUP % {"seconds": seconds, "faces": faces})

    def poses(self, count=None):
        """The six faces in any order, or `count` poses of any kind; then the fit."""
        done = 0
        while done != count:
            missing = ast.literal_eval(self._run("print(poses.missing())"))
            if count is None and not missing:
                break
            left = " ".join(missing) if count is None else f"{count - done} more"
            up = self._measure(f"poses.add({self._seconds})", f"Another side up (left: {left})")
            done += 1
            self._say(f"  {up} up")
        residual, accel, gyro, temp = self._measure("solve()", "Let it lie still for the gyro")
        self._say("accelerometer offset %s mg, residual %.2f mg" % (_list(accel, 1000), residual))
        self._say("gyro bias %s deg/s at %.1f degC" % (_list(gyro), temp))

    def mounting(self, headings=1):
        """Which way is up and forward: the robot level, then with its nose lifted.

        headings: on a slope, so many readings, the robot turned by equal steps of heading.
        """
        for k in range(headings):
            turned = f", turned by {360 * k // headings} degrees on the spot" if k else ""
            self._measure("level()", f"The robot as if driving straight on{turned}")
        if headings == 1:  # level_of() wants to average
            self._run("readings.append(readings[0])")
        self._measure("level()", "Its nose lifted by about 30 degrees")
        forward, up, off = self._measure("mount()")
        self._say(f"sensor axes: {forward} forward, {up} up, and {off:.1f} degrees of rotation")

    def save(self, date):
        """Store the calibration on the board; a second temperature tells the biases' slopes."""
        self._run(f"save_calibration(merged(stored, cal.but(date={date!r})))")

    def _measure(self, call, prompt=None):
        """The value of a call on the board; when it refuses, say why and ask again."""
        while True:
            if prompt:
                self._ask(f"{prompt}, then Enter ")
            answer = self._run(f"attempt(lambda: {call})")
            good, value = ast.literal_eval(answer.strip())
            if good:
                return value
            if not prompt:
                raise Refused(value)
            self._say(f"  again: {value}")


def _list(values, scale=1):
    return "(%s)" % ", ".join("%.2f" % (scale * v) for v in values)


def _arguments():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    target = parser.add_mutually_exclusive_group(required=True)
    target.add_argument("--port", help="serial port of the board")
    target.add_argument("--virtual", action="store_true", help="the worst sensor, on the PC")
    parser.add_argument("--seed", type=int, default=1, help="signs of the worst sensor's errors")
    parser.add_argument("--poses", type=int, help="so many poses of any kind, at least 6")
    parser.add_argument("--mounting", action="store_true", help="find how it sits in the robot")
    parser.add_argument("--slope", type=int, default=1, help="headings on a floor not level")
    parser.add_argument("--seconds", type=float, default=1.0, help="of rest for each pose")
    return parser.parse_args()


def main():
    args = _arguments()
    if args.virtual:
        from tools.calibrate_virtual import run

        return run(args.seed)
    try:
        board = open_board(args.port)
        try:
            run = lambda code: board.exec(code).decode()  # noqa: E731
            guide = Guide(run, seconds=args.seconds, faces=args.poses is None)
            guide.poses(args.poses)
            if args.mounting or args.slope > 1:
                guide.mounting(args.slope)
            guide.save(datetime.date.today().isoformat())
        finally:
            board.close()
    except (DeployError, Refused, TransportError) as error:
        print(f"calibrate: {error}", file=sys.stderr)
        return 1
    print("stored; RESET the board to use it")
    return 0


if __name__ == "__main__":
    sys.exit(main())

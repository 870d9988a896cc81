# SPDX-License-Identifier: MIT
"""Calibrates the sensor of a board, step by step, and stores the result on its flash.

    python -m tools.calibrate --port /dev/ttyACM0 [--any-poses] [--mounting]
    python -m tools.calibrate --virtual [--seed N]

--port drives firmware/calibrating.py on the board with mpremote. --virtual runs the same module
on the virtual board with a sensor at the datasheet's worst tolerances (3 % scale, 80 mg, 2 %
cross-axis, drift), at two temperatures, and prints what is left against the truth.
"""

import argparse
import datetime
import subprocess
import sys

FACES = ("+x", "+y", "+z", "-x", "-y", "-z")


class Refused(Exception):
    """The board's own words on why a step did not work."""


class Board:
    """The board at a serial port, with app.calibrating() in the variable `c`."""

    def __init__(self, port, timeout_s=60):
        self.port, self.timeout_s = port, timeout_s

    def ask(self, expression):
        """What the expression gives, printed. Refused with the last line of its traceback."""
        command = [sys.executable, "-m", "mpremote", "connect", self.port, "resume", "exec"]
        done = subprocess.run(
            [*command, expression], capture_output=True, text=True, timeout=self.timeout_s
        )
        if done.returncode:
            lines = (done.stderr + done.stdout).strip().splitlines()
            raise Refused(lines[-1] if lines else "no answer")
        return done.stdout.strip().splitlines()[-1] if done.stdout.strip() else ""

    def step(self, call):
        """One step of firmware.calibrating."""
        return self.ask(f"print(c.{call})")


def guided(board, any_poses, mounted, wait=input, say=print):
    """All steps on a board; the user is asked to turn the sensor in between. Returns a text."""
    board.ask("from firmware.app import App\napp = globals().get('app') or App()")
    board.ask("c = app.calibrating()")
    _until_done(board, "gyro()", "Lay the sensor down and leave it alone.", wait, say)
    if any_poses:
        for number in range(12):
            ask = f"Pose {number + 1} of 12: any direction, well spread; at rest."
            _until_done(board, "pose()", ask, wait, say)
        say(board.step("solve(faces=False)"))
    else:
        while True:
            ask = "Lay the sensor on a face that has not been up yet."
            if "all faces" in _until_done(board, "pose()", ask, wait, say):
                break
        say(board.step("solve()"))
    if mounted:
        _until_done(board, "level()", "Set the robot level.", wait, say)
        _until_done(board, "nose_up()", "Lift its nose by 10 to 80 degrees.", wait, say)
    return board.step(f"save({datetime.date.today().isoformat()!r})")


def _until_done(board, call, ask, wait, say):
    while True:
        wait(f"{ask} Then press Enter. ")
        try:
            said = board.step(call)
        except Refused as why:
            say(f"  once more: {why}")
            continue
        say(f"  {said}")
        return said


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.calibrate", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--port", metavar="DEV", help="the board's serial port")
    parser.add_argument("--any-poses", action="store_true", help="12 poses in place of 6 faces")
    parser.add_argument("--mounting", action="store_true", help="find how the sensor sits, too")
    parser.add_argument("--virtual", action="store_true", help="a worst sensor on the PC")
    parser.add_argument("--seed", type=int, default=1, help="of the worst sensor's signs")
    options = parser.parse_args(arguments)
    if options.virtual:
        from tools.calibrate_virtual import run

        return run(options.seed)
    if not options.port:
        parser.error("--port DEV or --virtual")
    try:
        print(guided(Board(options.port), options.any_poses, options.mounting))
    except Refused as why:
        print(f"calibrate: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Calibrates a board's sensor, step by step: six faces (or any poses), gyro at rest, mounting.

`python -m tools.calibrate --port /dev/ttyACM0` asks for each pose, lets the board measure, tells
at once when it was not still, and stores the result on the board; the next start uses it.
`--virtual` prints the figures of the procedure on a virtual sensor at the datasheet's worst.
`--poses 14` takes that many poses of any kind instead of the faces of a box; `--mounting` finds
how the sensor sits in the robot, `--slope 4` does so on a floor that is not level.
"""

import argparse
import ast
import datetime
import math
import sys

from tools.deploy.link import ANSWER_S, DeployError, Gone, Link, Raised

_INTRO = """Lay the sensor as each line says, take your hand off it, press Enter. Side +x is where
its x arrow points. Ctrl-C stops, and nothing is stored."""
_UNCHANGED = "nothing new is stored; RESET the board to start its program again"

_SETUP = """
from firmware.board import here
from firmware.config import Config
board, config = here(), Config()
notes = config.load()
board.use(config)
if config.watchdog_ms:  # the app started it and nothing stops it
    dog = board.watchdog(config.watchdog_ms)
    feeding = board.timer(config.watchdog_ms * 250, lambda _: dog.feed())
from firmware.calibrating import Calibrating
from firmware.startup import sensor
imu = sensor(board, config)
steps = Calibrating(imu)
sound = True
def attempt(function):
    global sound
    try:
        if not sound:  # a wire may have come off while it was turned: the chip forgets all
            imu.use_bus(board.recover())
            imu.reset()
            imu.configure()
        sound = False
        answer = True, function()
        sound = True
    except ValueError as error:
        answer = False, str(error)
    except OSError as error:
        answer = False, "no answer from the sensor, check its wires: %s" % error
    print(repr(answer))
print(repr(notes + steps.warnings))
"""


class Refused(Exception):
    """Why the calibration ends without a result, in words for the person who holds the board."""


class Guide:
    """One calibration. `run(code)` executes on the board, `ask(text)` waits for the person."""

    def __init__(self, run, ask=input, say=print, seconds=1.0, faces=True):
        self._run, self._ask, self._say = run, ask, say
        self._seconds, self._faces = seconds, faces
        for text in ast.literal_eval(run(_SETUP)):
            say(f"warning: {text}")

    def poses(self, count=6):
        """At least `count` poses, all six faces or any poses; then the fit, and the gyro."""
        left = "" if self._faces else f"{count} more"
        for done in range(1, count + 1):
            left = self._pose(left, count - done)
        good, found = self._attempt(f"solve({self._faces})")
        while not good:
            self._pose(found)
            good, found = self._attempt(f"solve({self._faces})")
        self._say(found)
        if self._run("print(steps.doubtful)").strip() == "True":
            self._say("  --poses 14 needs no side square")
            self._ask("Enter keeps it, Ctrl-C stops ")
        self._say(self._measure(f"gyro({self._seconds})", "Let it lie still for the gyro"))

    def mounting(self, headings=1):
        """Which way is up and forward: the robot level, then with its nose lifted.

        headings: on a slope, so many readings, the robot turned by equal steps of heading.
        """
        level, nose_up = f"level({headings}, {self._seconds})", f"nose_up({self._seconds})"
        place = "on the slope" if headings > 1 else "on level ground"
        for k in range(headings):
            turned = f", turned by {360 * k // headings} degrees on the spot" if k else ""
            self._measure(level, f"The robot upright {place}{turned}")
        self._say("sensor: " + self._measure(nose_up, "Its nose lifted by about 30 degrees"))

    def save(self, date):
        """Store it on the board; what was stored, in words."""
        return self._run(f"print(steps.save({date!r}))").strip()

    def _pose(self, left, more=0):
        """One pose; what is to come after it, in words."""
        prompt = f"Another side up ({left})" if left else "A side up"
        text = self._measure(f"pose({self._seconds})", prompt)
        up, _, missing = text.partition("; ")
        self._say(f"  {up}")
        return missing if self._faces else f"{more} more"

    def _measure(self, call, prompt):
        """What a step on the board found; when it refuses, say why and ask again."""
        while True:
            self._ask(f"{prompt}, then Enter ")
            good, found = self._attempt(call)
            if good:
                return found
            self._say(f"  again: {found}")

    def _attempt(self, call):
        """(True, what a step on the board found), or (False, why it refuses)."""
        return ast.literal_eval(self._run(f"attempt(lambda: steps.{call})").strip())


def _plain(traceback):
    """What a person can use of the board's traceback: its message."""
    text = traceback.replace("\r\n", "\n").strip()
    message = text.rpartition("\n  File ")[2].partition("\n")[2] or text
    if message.startswith("ImportError"):
        return f"Plumb is not on this board, or another version ({message}): make deploy PORT=..."
    return message


def calibrate(args):
    """The whole calibration of the board at args.port; what was stored. Refused, DeployError."""
    with Link(args.port) as board:
        board.stop()  # by a soft reset: main.py, and with it the app, no longer runs

        def run(code):
            try:
                return board.run(code, ANSWER_S + 5 * args.seconds)
            except Raised as error:
                raise Refused(_plain(error.traceback)) from error

        try:
            guide = Guide(run, seconds=args.seconds, faces=args.poses is None)
            print(_INTRO)
            guide.poses(args.poses or 6)
            if args.mounting or args.slope > 1:
                guide.mounting(args.slope)
            return guide.save(datetime.date.today().isoformat())
        except Gone as error:
            raise Refused(str(error)) from error
        finally:
            board.leave()


def _at_least(low, kind=int):
    def number(text):
        value = kind(text)
        if not low <= value < math.inf:
            raise argparse.ArgumentTypeError(f"{text}: at least {low}")
        return value

    return number


def _arguments():
    parser = argparse.ArgumentParser(
        prog="python -m tools.calibrate", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    target = parser.add_mutually_exclusive_group(required=True)
    target.add_argument("--port", help="serial port of the board, as /dev/ttyACM0")
    target.add_argument("--virtual", action="store_true", help="the worst sensor, on the PC")
    parser.add_argument("--seed", type=int, default=1, help="--virtual: signs of its errors")
    parser.add_argument("--poses", type=_at_least(6), metavar="N", help="any poses, 6 or more")
    parser.add_argument("--mounting", action="store_true", help="find how it sits in the robot")
    parser.add_argument(
        "--slope", type=_at_least(2), default=1, metavar="N",
        help="--mounting where no floor is level: the robot turned to N headings, 2 or more",
    )  # fmt: skip
    parser.add_argument("--seconds", type=_at_least(0.05, float), default=1.0, help="each rest; 1")
    return parser.parse_args()


def main():
    args = _arguments()
    if args.virtual:
        from tools.calibrate.virtual import run

        return run(args.seed)
    try:
        print(f"{calibrate(args)}; RESET the board to use it")
        return 0
    except (DeployError, OSError) as error:
        text = str(error)
    except Refused as error:
        text = f"{error}\n{_UNCHANGED}"
    except (KeyboardInterrupt, EOFError):
        text = f"stopped; {_UNCHANGED}"
        print()  # the prompt has no end of line
    print(f"calibrate: {text}", file=sys.stderr)
    return 1


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""`python -m tools.virtual.pico`: a virtual board for the real mpremote, screen or Thonny."""

import argparse
import time

from tools.virtual import images, motion
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import load_scenario
from tools.virtual.rp2040.board import PicoError, VirtualPico

__all__ = ["PicoError", "VirtualPico"]

SLICE_MS = 20
REST_S = 5.0  # the program takes the gyro's offset at rest, before anything moves


def main():
    options = _parse()
    print("booting" if options.bare else "booting, main.py and all: half a minute", flush=True)
    bus = Bus(MPU6050Chip(source(options.motion)), faults=load_scenario(options.faults or []))
    board = VirtualPico(bus=bus, root=not options.bare, micropython=options.micropython)
    with board as pico, pico.terminal() as port:
        print(f"MicroPython with an MPU6050 ({options.motion}); Ctrl-C here ends it", flush=True)
        print(f"try: mpremote connect {port.path} resume repl", flush=True)
        print(f"port: {port.path}", flush=True)
        end = time.monotonic() + options.seconds if options.seconds else None
        try:
            while end is None or time.monotonic() < end:
                began, before = time.monotonic(), pico.nanos
                port.serve_ms(SLICE_MS)
                _not_ahead(began, (pico.nanos - before) / 1e9)
        except KeyboardInterrupt:
            print()


def _not_ahead(began, emulated_s):
    """A sleeping board must not run ahead of real time."""
    time.sleep(max(0.0, emulated_s - (time.monotonic() - began)))


def source(name):
    """A motion source by its name: still, swing, free, shaken (by a motor of 3000 turns a minute
    while it moves freely), or the path of a recording."""
    if name == "still":
        return motion.Still()
    moving = {"swing": motion.Sinusoid, "free": motion.FreeMotion, "shaken": _shaken}
    moves = moving[name]() if name in moving else motion.Replay(name)
    return motion.Sequence((motion.Still(), REST_S), (moves, 0.0))


def _shaken():
    return motion.Vibration(3000, over=motion.FreeMotion())


def _parse():
    parser = argparse.ArgumentParser(prog="python -m tools.virtual.pico", description=__doc__)
    parser.add_argument(
        "--motion", default="swing", metavar="NAME",
        help="still, swing, free, shaken, or a recording (.csv, .npz); default: %(default)s",
    )  # fmt: skip
    parser.add_argument("--faults", metavar="FILE", help="a scenario of faults (JSON)")
    parser.add_argument("--bare", action="store_true", help="nothing on the board's flash")
    parser.add_argument(
        "--micropython", choices=images.VERSIONS, default=images.DEFAULT, metavar="VERSION",
        help="release to run, of %(choices)s; default: %(default)s",
    )  # fmt: skip
    parser.add_argument("--seconds", type=float, help="end after this time; default: Ctrl-C")
    return parser.parse_args()


if __name__ == "__main__":
    main()

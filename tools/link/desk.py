# SPDX-License-Identifier: MIT
"""Which board: the options --port and --virtual, and the virtual one's process."""

import contextlib
import subprocess
import sys
import tempfile
from pathlib import Path

START_S = 30


def options(parser):
    """Add them to a command's parser; returns the group, of which one is chosen."""
    which = parser.add_mutually_exclusive_group()
    which.add_argument("--port", metavar="DEV", help="serial port; default: the only board")
    which.add_argument("--virtual", action="store_true", help="a virtual board in its place")
    parser.add_argument(
        "--motion", default="free", metavar="NAME",
        help="of the virtual board: still, swing, free, shaken, or a recording",
    )  # fmt: skip
    return which


@contextlib.contextmanager
def board(chosen):
    """The port's name, while it is needed. SystemExit in words when there is none."""
    if not chosen.virtual:
        yield chosen.port or _only_board()
        return
    with VirtualBoard(chosen.motion) as virtual:
        yield virtual.port


class VirtualBoard:
    """tools.virtual.live as a process; port: a link to its terminal. do("unplug"), "plug",
    "reset"."""

    def __init__(self, motion="free"):
        self._motion = motion
        self._folder = tempfile.TemporaryDirectory()
        self.port = str(Path(self._folder.name) / "board")

    def __enter__(self):
        command = [sys.executable, "-m", "tools.virtual.live", "--motion", self._motion]
        self._process = subprocess.Popen(
            [*command, "--link", self.port, "--root", self._folder.name],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            text=True, cwd=Path(__file__).parents[2],
        )  # fmt: skip
        if not self._process.stdout.readline().startswith("port:"):
            sys.exit("the virtual board does not start")
        return self

    def do(self, what):
        """What a hand does at the cable."""
        self._process.stdin.write(what + "\n")
        self._process.stdin.flush()

    def __exit__(self, *error):
        self._process.stdin.close()
        self._process.terminate()
        self._process.wait()
        self._process.stdout.close()
        self._folder.cleanup()
        return False


def _only_board():
    from serial.tools import list_ports

    found = [port.device for port in list_ports.comports() if port.vid is not None]
    if len(found) == 1:
        return found[0]
    what = "no board on USB" if not found else f"several: {', '.join(found)}"
    sys.exit(f"{what}. Name it with --port, or take --virtual")

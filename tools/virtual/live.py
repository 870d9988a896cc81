# SPDX-License-Identifier: MIT
"""`python -m tools.virtual.live`: a virtual board that keeps up with real time, on a terminal.

CPython runs the firmware's own files on the Port, its REPL answers mpremote's protocol at a
pseudo-terminal, and the sensor moves. The emulated RP2040 (tools.virtual.pico) runs the real
MicroPython, but too slowly to be looked at live.

--link PATH: a symbolic link to the terminal, the same after each plugging-in. Lines on standard
input are the hand at the cable: `unplug`, `plug`, `reset`, `end`.
"""

import argparse
import contextlib
import io
import os
import select
import signal
import tempfile
import time
import traceback
import tty
from pathlib import Path

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import source
from tools.virtual.port import Port

STEP_S = 0.004
BEHIND_S = 1.0  # later than that, time is given up, not caught up
OUT_MAX = 256  # bytes that a board holds for a reader that does not read
RAW = b"raw REPL; CTRL-B to exit\r\n>"


class Wire:
    """The board's end of the line: a console for the firmware, plugged in or not. path: the
    terminal's name."""

    def __init__(self, link):
        self._link = link
        self._master = self._slave = None
        self._out = bytearray()

    def plug(self):
        """A terminal, and the link to it."""
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self._out.clear()
        path = os.ttyname(self._slave)
        if self._link:
            with contextlib.suppress(FileNotFoundError):
                os.unlink(self._link)
            os.symlink(path, self._link)
        self.path = self._link or path

    def unplug(self):
        """The line is gone for whoever has it open."""
        if self._master is not None:
            os.close(self._slave)
            os.close(self._master)
            self._master = None
            if self._link:
                os.unlink(self._link)

    def ready(self):
        """Whether somebody takes 64 bytes, as the firmware's console asks."""
        self.flush()
        return self._master is not None and len(self._out) < OUT_MAX

    def write(self, data):
        """From the firmware."""
        self._out += data
        self.flush()

    def key(self):
        """The firmware's look for a key: it is for the REPL."""
        return False

    def flush(self):
        """What the terminal takes."""
        if self._master is None or not self._out:
            return
        with contextlib.suppress(BlockingIOError):
            del self._out[: os.write(self._master, self._out)]

    def read(self):
        """What was typed."""
        if self._master is None or not select.select([self._master], [], [], 0)[0]:
            return b""
        try:
            return os.read(self._master, 4096)
        except OSError:
            return b""


class Repl:
    """MicroPython's raw REPL, as mpremote speaks it, but for raw paste."""

    def __init__(self, port, wire, variables):
        self._port, self._wire, self._variables = port, wire, variables
        self._raw = False
        self._line = bytearray()

    def feed(self, data):
        """Bytes that were typed."""
        for byte in data:
            if byte == 1:  # Ctrl-A
                self._raw = True
                self._line.clear()
                self._wire.write(RAW)
            elif byte == 2:
                self._raw = False
                self._wire.write(b"\r\n>>> ")
            elif byte == 3:
                self._line.clear()
            elif self._raw and byte == 4:
                self._run()
            elif self._raw:
                self._line.append(byte)
                if self._line == b"\x05A\x01":  # raw paste: understood, not done
                    self._line.clear()
                    self._wire.write(b"R\x00")

    def _run(self):
        code, printed, raised = self._line.decode(), io.StringIO(), ""
        self._line.clear()
        self._wire.write(b"OK")
        with contextlib.redirect_stdout(printed):
            try:
                self._port.exec(code, self._variables)
            except BaseException:
                raised = traceback.format_exc(limit=-2)
        for text in (printed.getvalue(), raised):
            self._wire.write(text.replace("\n", "\r\n").encode() + b"\x04")
        self._wire.write(b">")


class Hand:
    """The lines of standard input, without waiting."""

    def __init__(self):
        self._text = b""
        self._open = True

    def asked(self):
        """The next line, or ''."""
        if self._open and select.select([0], [], [], 0)[0]:
            data = os.read(0, 4096)
            self._open = bool(data)
            self._text += data
        line, mark, rest = self._text.partition(b"\n")
        if not mark:
            return ""
        self._text = rest
        return line.decode().strip()


def serve(options, wire, hand):
    """One life of the board, until it ends or is reset; True: again."""
    chip = MPU6050Chip(source(options.motion), seed=3, gyro_bias_dps=(1.5, -1.0, 0.7))
    with Port(
        "rp2", {0: Bus(chip, log_length=1)}, root=options.root, version=(1, 26, 1)
    ) as port:
        from firmware.app import App

        app = App(console=wire)
        app.start()
        print(f"port: {wire.path}", flush=True)  # from now on it answers
        repl = Repl(port, wire, {"app": app, "imu": app.imu})
        due = time.monotonic()
        while True:
            port.run_ms(1000 * STEP_S)
            wire.flush()
            repl.feed(wire.read())
            asked = hand.asked()
            if asked == "unplug":
                wire.unplug()
            elif asked == "plug":
                wire.plug()
            elif asked in ("reset", "end"):
                app.stop()
                return asked == "reset"
            due += STEP_S
            late = time.monotonic() - due
            if late > BEHIND_S:
                due += late
            time.sleep(max(0.0, -late))


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.virtual.live", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        "--motion", default="free", metavar="NAME",
        help="still, swing, free, shaken, or a recording; default: %(default)s",
    )  # fmt: skip
    parser.add_argument("--link", type=Path, metavar="PATH")
    parser.add_argument("--root", type=Path, metavar="DIR", help="the board's flash")
    options = parser.parse_args()
    # at once: an exception would end in the tick, which lets none out
    signal.signal(signal.SIGTERM, lambda *_: os._exit(0))
    wire, hand = Wire(options.link), Hand()
    with tempfile.TemporaryDirectory() as flash:
        options.root = options.root or Path(flash)
        wire.plug()
        try:
            while serve(options, wire, hand):
                wire.unplug()
                time.sleep(0.3)
                wire.plug()
        finally:
            wire.unplug()


if __name__ == "__main__":
    main()

# SPDX-License-Identifier: MIT
"""Angles as text at a fixed rate: lines that Thonny's plotter reads, or another program.

A line is made in a buffer and written after a tick without allocating, only when somebody takes
it. Its length divides the 256 bytes of the USB buffer: a reader that goes away leaves it full to
the byte, so the look before each write is enough never to wait.
"""

import select
import sys
import time

import micropython
from micropython import const

_ROLL = const(2)  # places: firmware.tick.estimate
_PITCH = const(3)
_YAW = const(4)

_STALL_US = const(10000)  # a UART at 115200 baud takes 7 ms for a line
# Choices of the knob telemetry_format: (what comes first, a line) with room for the numbers.
# Documentation of the programs: Serial Studio, Operation Modes, "Quick Plot" (commas; a first row
# without a number names the channels); teleplot's README for VS Code (on a serial port each
# variable is a line ">name:value", others are shown as text); PlotJuggler's serial port, which
# takes what stands between braces as JSON whose numbers become series.
_FORMATS = {
    "plain": (
        b"# roll, pitch and yaw in degrees; stale: no answer from the sensor, angle held\r\n",
        b"roll_deg:    0.00 pitch_deg:    0.00 yaw_deg:    0.00 stale:0 \r\n",
    ),
    "serial-studio": (
        b"roll_deg,pitch_deg,yaw_deg,stale\r\n",
        b"    0.00,    0.00,    0.00,  0\r\n",
    ),
    "teleplot": (
        b"",
        b">roll:    0.00\r\n>pitch:    0.00\r\n>yaw:    0.00\r\n>stale:      0\r\n",
    ),
    "plotjuggler": (
        b"",
        b'{"roll":    0.00,"pitch":    0.00,"yaw":    0.00,"stale":0}   \r\n',
    ),
}
_ANGLE = b"    0.00"  # put_mdeg's eight characters


@micropython.viper
def put_mdeg(line: ptr8, at: int, mdeg: int):
    """Write millidegrees as degrees with two decimals, eight characters, right-aligned."""
    value = mdeg if mdeg >= 0 else 0 - mdeg
    value = (value + 5) // 10
    minus = 1 if mdeg < 0 and value else 0
    i = at + 7
    while i >= at:
        if i == at + 5:
            line[i] = 46
        elif i >= at + 4 or value:
            line[i] = 48 + value % 10
            value //= 10
        else:
            line[i] = 45 if minus else 32
            minus = 0
        i -= 1


class Console:
    """Standard output and input of the board, with a look before each use."""

    def __init__(self):
        self._out = select.poll()
        self._out.register(sys.stdout, select.POLLOUT)
        self._in = select.poll()
        self._in.register(sys.stdin, select.POLLIN)
        self.write = sys.stdout.buffer.write  # takes bytes; a bound method, so kept

    def ready(self):
        """Whether somebody takes what is written. Allocates nothing."""
        for _ in self._out.ipoll(0):
            return True
        return False

    def key(self):
        """Whether a key waits to be read."""
        for _ in self._in.ipoll(0):
            return True
        return False

    def take(self):
        """Read the key that waits, so that it is not the REPL's."""
        sys.stdin.read(1)


class Telemetry:
    """Writes a line every few ticks, between begin() and end().

    console: a Console, or anything with ready() and write(bytes). format: of the lines.
    lines: how many were written; dropped: how many nobody took. stalls: writes that waited for a
    reader, although ready() had said that there is one, as an ESP32 does: the lines end then.
    """

    def __init__(self, console):
        self.console = console
        self._every = 0
        self._left = 0
        self._headed = None  # the form whose header was written
        self.format = ""
        self.set_format("plain")
        self.on = False
        self.lines = 0
        self.dropped = 0
        self.stalls = 0

    def set_rate(self, telemetry_hz, rate_hz):
        """Lines per second (0: none) for a loop of rate_hz."""
        self._every = round(rate_hz / telemetry_hz) if telemetry_hz else 0
        self._left = 0

    def set_format(self, name):
        """How lines look from the next one on: a choice of the knob telemetry_format."""
        if name == self.format:
            return
        self.format = name
        header, line = _FORMATS[name]
        roll = line.find(_ANGLE)
        pitch = line.find(_ANGLE, roll + 8)
        yaw = line.find(_ANGLE, pitch + 8)
        # in one piece: a tick may come in between
        self._form = (header, bytearray(line), roll, pitch, yaw, line.rfind(b"0"))

    def begin(self):
        """From now on lines are written; the header, where there is one, comes first."""
        self._headed = None
        self.on = True

    def end(self):
        """No more lines."""
        self.on = False

    def watch(self, seconds=None):
        """Write lines until a key is pressed (or for some seconds).

        The REPL and a line every 20 ms do not go together: a program on the PC that talks to
        the REPL would take the lines for its answers. So they come while this waits.
        """
        self.begin()
        began = time.ticks_ms()
        try:
            while not self.console.key():
                time.sleep_ms(10)
                passed = time.ticks_diff(time.ticks_ms(), began)
                if seconds is not None and passed >= seconds * 1000:
                    return
            self.console.take()
        except KeyboardInterrupt:
            pass
        finally:
            self.end()

    def tick(self, est, stale, passed):
        """`passed` ticks later, while `on`; write a line of the estimate when it is due."""
        if not self._every:
            return
        self._left -= passed
        if self._left > 0:
            return
        self._left = self._every
        if not self.console.ready():
            self.dropped += 1
            return
        form = self._form
        header, line, roll, pitch, yaw, at_stale = form
        if self._headed is not form:
            self._headed = form
            if header:
                self._write(header)
                return
        put_mdeg(line, roll, est[_ROLL])
        put_mdeg(line, pitch, est[_PITCH])
        put_mdeg(line, yaw, est[_YAW])
        line[at_stale] = 49 if stale else 48
        self._write(line)
        self.lines += 1

    def _write(self, data):
        began = time.ticks_us()
        self.console.write(data)
        if time.ticks_diff(time.ticks_us(), began) > _STALL_US:
            self.stalls += 1
            self.end()

# SPDX-License-Identifier: MIT
"""A serial line whose frames go one way and whose text the other.

    transport.serial = Demux(transport.serial)      # as mpremote itself does to mount a folder

mpremote's SerialTransport then talks to the REPL as always, while the board streams.
"""

import time

from tools.link.frames import Splitter

READ_S = 5.0  # a reader that waits longer for text has lost its board


class LineLost(OSError):
    """The line is gone, or nothing answers on it."""


class Demux:
    """What SerialTransport needs of a serial port. contents: of the frames that have come."""

    def __init__(self, serial):
        self._serial = serial
        self._split = Splitter()
        self._text = bytearray()
        self.contents = []
        self.received = 0  # bytes

    @property
    def bad(self):
        """Frames that were damaged."""
        return self._split.bad

    def pump(self):
        """Take what has arrived."""
        waiting = self._serial.in_waiting
        data = self._serial.read(waiting) if waiting else b""
        if data:
            self.received += len(data)
            text, contents = self._split.feed(data)
            self._text += text
            self.contents += contents

    def take(self):
        """The contents of frames since the last call."""
        contents, self.contents = self.contents, []
        return contents

    def inWaiting(self):  # pyserial's old name, which mpremote uses
        self.pump()
        return len(self._text)

    @property
    def in_waiting(self):
        return self.inWaiting()

    def read(self, size=1):
        """`size` bytes of text. LineLost when they do not come."""
        end = time.monotonic() + READ_S
        while self.inWaiting() < size:
            if time.monotonic() > end:
                raise LineLost("the board does not answer")
            time.sleep(0.001)
        text = bytes(self._text[:size])
        del self._text[:size]
        return text

    def write(self, data):
        return self._serial.write(data)

    def __getattr__(self, name):
        return getattr(self._serial, name)

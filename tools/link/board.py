# SPDX-License-Identifier: MIT
"""One connection to a board: its REPL and its stream, over mpremote's own transport."""

import contextlib
import time

from mpremote.transport import TransportError
from mpremote.transport_serial import SerialTransport

from tools.deploy.link import ANSWER_S
from tools.link.demux import Demux, LineLost

# `app` is what main.py has started, or a new one
_APP = """
from firmware.app import App
app = App.current()
if app is None:
    app = App()
    app.start()
"""
ENTER_S = 10.0


class BoardError(Exception):
    """The board raised an exception; the text is its last line."""


class Board:
    """A board on a serial port or pseudo-terminal. LineLost (an OSError) when it goes away."""

    def __init__(self, port):
        try:
            self._transport = SerialTransport(port, timeout=None)
        except TransportError as error:
            raise LineLost(str(error)) from None
        self._transport.is_pty = False  # or it reads without looking
        self.line = self._transport.serial = Demux(self._transport.serial)
        try:
            with _as_lost():
                self._transport.enter_raw_repl(soft_reset=False, timeout_overall=ENTER_S)
            self.run(_APP)
        except BaseException:
            self.close()
            raise

    def run(self, code):
        """Run lines on the board; what they printed. BoardError with the board's own words."""
        with _as_lost():
            printed, raised = self._transport.exec_raw(code, timeout=ANSWER_S)
        if raised:
            lines = raised.decode(errors="replace").strip().splitlines()
            raise BoardError(lines[-1])
        return printed.decode(errors="replace")

    def contents(self, wait_s=0.01):
        """The contents of the frames that have come; waits a little when there are none."""
        with _as_lost():
            self.line.pump()
            if not self.line.contents:
                time.sleep(wait_s)
                self.line.pump()
        return self.line.take()

    def close(self):
        """Leave the line; the board goes on."""
        with contextlib.suppress(OSError, TransportError):
            if self._transport.in_raw_repl:
                self._transport.exit_raw_repl()
        with contextlib.suppress(OSError, TransportError):
            self._transport.close()


@contextlib.contextmanager
def _as_lost():
    try:
        yield
    except LineLost:
        raise
    except (OSError, TransportError, TypeError) as error:  # pyserial's TypeError: closed meanwhile
        raise LineLost(str(error)) from None

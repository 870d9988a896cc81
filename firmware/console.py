# SPDX-License-Identifier: MIT
"""The line to the PC, never waited for."""

import select
import sys


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
        """Whether a key waits to be read; it is left for the REPL."""
        for _ in self._in.ipoll(0):
            return True
        return False

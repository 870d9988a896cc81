# SPDX-License-Identifier: MIT
"""Ctrl-C that came while something scheduled ran: MicroPython prints it there, and the main
program, which it was meant for, would go on. So it is pressed once more.
"""

import io
import os


class _Terminal(io.IOBase):
    """At which Ctrl-C is pressed."""

    left = 0

    def readinto(self, buffer):
        if self.left:
            self.left = 0
            buffer[0] = 3
            return 1

    def write(self, data):
        return len(data)


_terminal = _Terminal()


def press():
    """It goes to whatever jumps next: the caller returns at once."""
    notify = os.dupterm_notify  # first: where it is not, the user's terminal stays
    _terminal.left = 1
    before = os.dupterm(_terminal)
    notify(None)
    os.dupterm(before)

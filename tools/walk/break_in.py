# SPDX-License-Identifier: MIT
"""Ctrl-C anywhere in the firmware: MicroPython raises it at jumps and in sleeps of the main
program, so that is where it is raised here; never in an interrupt."""

import contextlib
import linecache
import re
import sys

_ROOMS = ("/firmware/", "/lib/")
_JUMP = re.compile(r"\b(if|elif|else|for|while|and|or|break|continue|except|finally|sleep_\w+)\b")


@contextlib.contextmanager
def ctrl_c(clock, after):
    """Within it the after-th jump (from 0) of the main program raises KeyboardInterrupt, once."""
    left, lines = after, {}

    def jumps(code, line):
        """Whether a line of this code has one."""
        found = lines.get((code, line))
        if found is None:
            text = linecache.getline(code.co_filename, line).split("#")[0]
            found = lines[code, line] = bool(_JUMP.search(text))
        return found

    def called(frame, event, argument):
        name = frame.f_code.co_filename
        if left < 0 or not any(room in name for room in _ROOMS):
            return None
        last = frame.f_lineno

        def line(frame, event, argument):
            nonlocal left, last
            if event == "line":
                jumped, last = jumps(frame.f_code, last), frame.f_lineno
                if jumped and left >= 0 and clock.in_foreground and not clock.scheduler.running:
                    left -= 1
                    if left < 0:
                        sys.settrace(None)
                        raise KeyboardInterrupt
            return line

        return line

    before = sys.gettrace()
    sys.settrace(called)
    try:
        yield
    finally:
        sys.settrace(before)

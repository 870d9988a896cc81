# SPDX-License-Identifier: MIT
"""What comes in between anywhere in the firmware: a Ctrl-C, or what was scheduled.

MicroPython looks for both at jumps and in sleeps of whatever runs, the main program or what was
scheduled, so that is where they come in here; never in an interrupt.
"""

import contextlib
import linecache
import os
import re
import sys
from pathlib import Path

_ROOT = Path(__file__).resolve().parents[2]
_ROOMS = tuple(str(_ROOT / folder) + os.sep for folder in ("firmware", "lib"))
_JUMP = re.compile(r"\b(if|elif|else|for|while|and|or|break|continue|except|finally|sleep_\w+)\b")


def ctrl_c(clock, after, below=False):
    """Within it the after-th jump (from 0) of the main program raises KeyboardInterrupt, once;
    below: of what the foreground does after a tick."""

    def press():
        raise KeyboardInterrupt

    return at_jump(clock, after, press, below)


def _is_with(frame):
    """Whether it is at a `with`. Where that is left MicroPython still calls __exit__() for what
    comes in at the last jump of its body; CPython does not for what a trace raises there."""
    text = linecache.getline(frame.f_code.co_filename, frame.f_lineno)
    return text.lstrip().startswith("with ")


@contextlib.contextmanager
def at_jump(clock, after, work, below=False):
    """Within it work() is called at the after-th jump (from 0), once; `below`: see ctrl_c."""
    left, lines = after, {}
    inside = not below

    def here():
        return clock.in_foreground and inside and clock.scheduler.running == below

    def jumps(code, line):
        """Whether a line of this code has one."""
        found = lines.get((code, line))
        if found is None:
            text = linecache.getline(code.co_filename, line).split("#")[0]
            found = lines[code, line] = bool(_JUMP.search(text))
        return found

    def called(frame, event, argument):
        nonlocal inside
        name = frame.f_code.co_filename
        if below and frame.f_code.co_name == "_after":
            inside = True
        if left < 0 or not name.startswith(_ROOMS):
            return None
        last = frame.f_lineno

        def line(frame, event, argument):
            nonlocal left, last, inside
            if below and event == "return" and frame.f_code.co_name == "_after":
                inside = False
            if event == "line":
                leaves = frame.f_lineno < last and _is_with(frame)
                jumped, last = jumps(frame.f_code, last), frame.f_lineno
                if jumped and left >= 0 and here() and not (leaves and left == 0):
                    left -= 1
                    if left < 0:
                        sys.settrace(None)
                        work()
            return line

        return line

    before = sys.gettrace()
    sys.settrace(called)
    try:
        yield
    finally:
        sys.settrace(before)

# SPDX-License-Identifier: MIT
"""Runs at each start of a board whose MicroPython has Plumb frozen in (tools.image).

The flash is mounted by then; boot.py and main.py come after it. They are the user's, always:
nothing frozen bears their names, since a frozen one would go before the one on the flash. A flash
without main.py gets one that starts the frozen application; an empty main.py starts nothing.
"""

import os
import sys

import micropython

_MAIN = """# Written by Plumb's image, as there was no main.py. It is yours to change.
from plumb_main import *
"""


def _there(path):
    try:
        os.stat(path)
    except OSError:
        return False
    return True


micropython.alloc_emergency_exception_buf(100)
if _there("/firmware"):  # deployed earlier: its half on sys.path would hide a half of the frozen
    sys.path.remove(".frozen")
    sys.path.insert(0, ".frozen")
if not _there("/main.py"):
    try:
        with open("/main.py.new", "w") as f:
            f.write(_MAIN)
        os.rename("/main.py.new", "/main.py")  # a cut before this is mended at the next start
    except OSError as error:  # a full or worn flash: the REPL is there all the same
        print("main.py was not written, so nothing starts by itself:", error)

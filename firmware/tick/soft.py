# SPDX-License-Identifier: MIT
"""A soft tick on an RP2: left out where the program has nearly used up the stack, and followed at
once by whatever else is scheduled.
"""

import micropython
from micropython import const

# of 8 KB: where so many are in use, a tick with a float filter, a collection in it and an
# interrupt in that would come to their end, which nothing checks: the board stands, or goes mad
_DEEP = const(4900)
# MicroPython calls one function for each event that ends its waiting. Where two have come with one
# event, one is left over from then on: the burst is begun when it is to be read, and read when it
# is too old. So each tick is an event of its own (Thumb's sev), which takes up what is left over
_EVENT = """
@micropython.asm_thumb
def event():
    data(2, 0xbf40)
"""


def _assembled():
    space: dict = {"micropython": micropython}
    try:
        exec(_EVENT, space)
    except (ImportError, SyntaxError):  # no Thumb: a RISC-V core, a PC
        return int
    return space["event"]


_event = _assembled()


def over(callback):
    """`callback` for the scheduler, which calls it wherever the program is, be it deep in calls or
    imports. A tick that is left out is lost, and counted."""

    @micropython.native
    def call(source, callback=callback, stack_use=micropython.stack_use, event=_event):
        if stack_use() < _DEEP:
            callback(source)
        event()

    return call

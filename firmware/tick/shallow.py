# SPDX-License-Identifier: MIT
"""A soft tick that is left out where the program has nearly used up the stack of an RP2."""

import micropython
from micropython import const

# of 8 KB: where so many are in use, a tick with a float filter, a collection in it and an
# interrupt in that would come to their end, which nothing checks: the board stands, or goes mad
_DEEP = const(4900)


def over(callback):
    """`callback` for the scheduler, which calls it wherever the program is, be it deep in calls or
    imports. A tick that is left out is lost, and counted."""

    @micropython.native
    def call(source, callback=callback, stack_use=micropython.stack_use):
        if stack_use() < _DEEP:
            callback(source)

    return call

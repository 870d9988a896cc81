# SPDX-License-Identifier: MIT
"""Refuses to be imported where viper code was compiled wrongly: the filters would be wrong too.

MicroPython 1.26 and 1.27 multiply the index of p[i] in place when it lives in a register (Thumb
and RISC-V; ptr16 and ptr32); 1.25 stores another register than it should at a constant index
(Xtensa). It is the compiler that counts, mpy-cross or the board's own for .py files, so this file
must be compiled by the same one as the rest. It takes a millisecond.
"""

import sys
from array import array

import micropython

_BEFORE = (5, 7, 9, 11)
_AFTER = (10, 25, 1, 52)


# Arguments and the first locals live in registers. Where i is multiplied the later accesses are
# at places up to 64, so the arrays have more.
@micropython.viper
def words(p: ptr32, i: int):
    """[5, 7, 9, 11] with i = 1 becomes [10, 25, 1, 52]."""
    j = i + 2
    p[0] = p[i] + 3
    p[1] = p[i] * 5 - p[0]
    p[j] = 51
    p[j] = p[j] + i
    p[2] = i


@micropython.viper
def halves(p: ptr16, i: int):
    """The same with 16 bits."""
    j = i + 2
    p[0] = p[i] + 3
    p[1] = p[i] * 5 - p[0]
    p[j] = 51
    p[j] = p[j] + i
    p[2] = i


def check(functions=((words, "i"), (halves, "h"))):
    """RuntimeError, with what to do, when one of the (function, type of its array) is wrong."""
    for function, kind in functions:
        numbers = array(kind, _BEFORE + (0,) * 64)
        function(numbers, 1)
        if tuple(numbers[:4]) != _AFTER:
            raise RuntimeError(
                "This code was compiled by a MicroPython that gets viper wrong (1.26 and 1.27; "
                "1.25 on ESP32). Here runs %s. Put the .mpy files of mpy-cross 1.28 or newer on "
                "the board (make deploy does), or use MicroPython 1.28 or newer."
                % ".".join([str(part) for part in sys.implementation.version[:3]])
            )


check()

# SPDX-License-Identifier: MIT
"""A tick that is left out where the foreground has nearly used up the stack.

On RP2 an interrupt works on the foreground's stack. Where runaway recursion has come near its
end, MicroPython raises before the first instruction of a callback, in a place where nobody can
catch it, and the board stands still for good. So a few instructions, which nothing checks, look
at the stack pointer first and return where too little is left: that tick is lost and counted, the
recursion ends in its RuntimeError, and the loop goes on.

They are assembled on the board, since they hold the address of a table.
"""

import sys
from array import array

import machine
from micropython import const

_CALL = const(10)  # of a type: which slot is its call (uint8); slots begin at 20, from 1
_SLOTS = const(16)

# where the 8 KB of core 0 begin (memmap_mp.ld of the port), and how many bytes must be left: with
# 2048 a board froze. An interrupt at their end is already below them: r2 is then more, not less
_RP2040 = const(0x20040000)
_RP2350 = const(0x20080000)
_NEEDS = const(2560)
# the table: the lowest sp with room; the callback; its type's call(self, n, n_kw, args), to which
# 0x47a0, blx r4, goes
_SOURCE = """
@micropython.asm_thumb
def guard(r0):
    mov(r3, %d)
    lsl(r3, r3, 8)
    add(r3, %d)
    lsl(r3, r3, 8)
    add(r3, %d)
    lsl(r3, r3, 8)
    add(r3, %d)
    ldr(r2, [r3, 0])
    mov(r1, sp)
    sub(r2, r2, r1)
    mov(r1, 32)
    lsl(r1, r1, 8)
    cmp(r2, r1)
    bls(END)
    push({r0, r1})
    ldr(r0, [r3, 4])
    ldr(r4, [r3, 8])
    mov(r3, sp)
    mov(r1, 1)
    mov(r2, 0)
    data(2, 0x47a0)
    pop({r0, r1})
    label(END)
    mov(r0, 0)
"""


class Guard:
    """Calls a callback with its argument while the stack has room for it."""

    def __init__(self):
        ends = _RP2040 if "RP2040" in sys.implementation._machine else _RP2350
        self._table = array("I", [ends + _NEEDS, 0, 0])
        self._call = None
        space: dict = {}
        try:
            exec(_SOURCE % _bytes(self._table), space)
        except (ImportError, SyntaxError):
            return  # no Thumb: a RISC-V core, a PC
        self._call = space["guard"]

    def over(self, callback):
        """A callback that calls `callback`, to which the caller keeps a reference."""
        if not self._call:
            return callback
        kind = machine.mem32[id(callback)]
        call = machine.mem32[kind + _SLOTS + 4 * machine.mem8[kind + _CALL]]
        self._table[2] = call & 0xFFFFFFFF
        self._table[1] = id(callback)
        return self._call


def _bytes(table):
    import uctypes

    address = uctypes.addressof(table)
    return address >> 24, address >> 16 & 255, address >> 8 & 255, address & 255

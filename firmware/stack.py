# SPDX-License-Identifier: MIT
"""A tick that is left out where the foreground has nearly used up the stack.

On RP2 an interrupt works on the foreground's stack. Where runaway recursion has come near its
end, MicroPython raises before the first instruction of a callback, in a place where nobody can
catch it, and the board stands still for good. So a few instructions, which nothing checks, look
at the stack pointer first and return where too little is left: that tick is lost and counted, the
recursion ends in its RuntimeError, and the loop goes on.

They are assembled on the board, since they hold the address of a table.
"""

import gc
from array import array

import machine
from micropython import const

_STACK = const(8192)  # bytes of core 0, on all chips; checks trip 256 before their end
_NEEDS = const(2560)  # of them must be left; a tick with a quadcopter was seen to need 2100
_CALL = const(10)  # of a type: which slot is its call (uint8); slots begin at 20, from 1
_SLOTS = const(16)

# of the table: the lowest address with room, the callback, its type's call(self, n, n_kw, args)
_SOURCE = """
import micropython
@micropython.asm_thumb
def sp():
    mov(r0, sp)
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
    data(2, 0x47a0)  # blx r4
    pop({r0, r1})
    label(END)
    mov(r0, 0)
"""


class Guard:
    """Calls a callback with its argument while the stack has room for it."""

    def __init__(self):
        self._table = array("I", [0, 0, 0])
        self._call = None
        space: dict = {}
        gc.collect()  # it takes two blocks of a kilobyte
        try:
            exec(_SOURCE % _bytes(self._table), space)
        except (AttributeError, ImportError, SyntaxError):
            return  # no Thumb: a RISC-V core, a PC
        self._call = space["guard"]
        self._table[0] = (space["sp"]() | _STACK - 1) + 1 - _STACK + _NEEDS

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

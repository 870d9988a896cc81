# SPDX-License-Identifier: MIT
"""Three instruction sets: which registers MicroPython's native code and its callers use.

From the procedure call standards of ARM (AAPCS), RISC-V (ilp32) and Xtensa (windowed, call8), and
from what py/emitnative.c says it expects.
"""

from typing import NamedTuple

import pypcode


class Convention(NamedTuple):
    """Register names. `arguments` as a function finds them, `call` where it puts those of a call
    and `result` where it takes that one's result; `returns`: its own. A call may change `scratch`;
    the function has to give back `kept` as they were.
    """

    language: str
    stack: str
    link: str
    arguments: tuple
    call: tuple
    result: str
    returns: str
    scratch: tuple
    kept: tuple
    context: tuple = ()
    function_bit: int = 0  # set in the address of a function


def _numbered(letter, *numbers):
    return tuple([letter + str(n) for n in numbers])


_ARM = Convention(
    "ARM:LE:32:Cortex", "sp", "lr", _numbered("r", 0, 1, 2, 3), _numbered("r", 0, 1, 2, 3),
    "r0", "r0", _numbered("r", 1, 2, 3, 12), _numbered("r", 4, 5, 6, 7, 8, 9, 10, 11),
    (("TMode", 1),), 1,
)  # fmt: skip
# a callee's a2 is the caller's a10: the window moves by 8, and saves a0 to a7 by itself
_XTENSA = Convention(
    "Xtensa:LE:32:default", "a1", "a0", _numbered("a", 2, 3, 4, 5), _numbered("a", 10, 11, 12, 13),
    "a10", "a2", _numbered("a", 8, 9, 11, 12, 13, 14, 15), (),
)  # fmt: skip
_RISCV = Convention(
    "RISCV:LE:32:RV32IMC", "sp", "ra", _numbered("a", 0, 1, 2, 3), _numbered("a", 0, 1, 2, 3),
    "a0", "a0", _numbered("a", 1, 2, 3, 4, 5, 6, 7) + _numbered("t", 0, 1, 2, 3, 4, 5, 6),
    ("s0", "s1", *_numbered("s", 2, 3, 4, 5, 6, 7, 8, 9, 10, 11)),
)  # fmt: skip

# mpy-cross's name: what its user knows it by, and the rest
ARCHS = {
    "armv6m": ("RP2040", _ARM),
    "armv7emsp": ("RP2350", _ARM),
    "xtensawin": ("ESP32, S3", _XTENSA),
    "rv32imc": ("ESP32-C3, C6", _RISCV),
}


class Processor:
    """pypcode's decoder for one of ARCHS, with registers by their place in its register space."""

    def __init__(self, arch):
        self.arch = arch
        self.convention = c = ARCHS[arch][1]
        self._page = 0x100
        self.decoder = pypcode.Context(c.language)
        for name, value in c.context:
            self.decoder.setVariableDefault(name, value)
        places = {name: v.offset for name, v in self.decoder.registers.items()}
        self.sizes = {}  # of each register
        for v in self.decoder.registers.values():
            self.sizes[v.offset] = max(v.size, self.sizes.get(v.offset, 0))
        self.stack, self.link = places[c.stack], places[c.link]
        self.arguments = [places[n] for n in c.arguments]
        self.call = [places[n] for n in c.call]
        self.result, self.returns = places[c.result], places[c.returns]
        self.scratch = [places[n] for n in c.scratch]
        self.kept = [places[n] for n in c.kept]

    def page(self):
        """A page for a function's code, its own: the decoder remembers what an IT began there."""
        self._page += 1
        return self._page

    def instruction(self, code, address, offset):
        """The text of one instruction, for a message."""
        try:
            found = self.decoder.disassemble(code, address, offset, 0, 1).instructions[0]
        except (pypcode.BadDataError, IndexError):
            return "no instruction"
        return "%s %s" % (found.mnem, found.body)

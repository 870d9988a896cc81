# SPDX-License-Identifier: MIT
"""A module's machine code on one processor, its functions called with Python objects."""

import struct

from . import pcode
from .faults import Impure, MachineFault
from .memory import PAGE, Memory
from .mpy import NATIVE, signature
from .runtime import CALLS, TABLE_WORDS, TO_OBJ, Runtime

# pages: function object, module context and its tables; stack; the function table
_MODULE, _STACK, _TABLE = 1, 2, 3
_STACK_SIZE = 0x4000
_HOME = 0x00D00000  # where a function returns to; no page
_POISON = 0xA5C3A5C3  # in registers that hold nothing
_LONGEST = 400_000  # instructions of one call: 50 ms on an RP2040


class Native:
    """One function's machine code, of a Mpy whose `names` are all text.

    globals: what it looks its names up in, to be set; modules: those whose functions it may call.
    count: instructions of the last call.
    """

    def __init__(self, processor, mpy, names, code, modules):
        self.processor, self.mpy, self.names = processor, mpy, names
        self.code, self.modules = code, modules
        self.globals = {}
        self.count = 0
        self._page = processor.page()
        self._base = self._page * PAGE
        self._blocks = {}
        self.signature, start = None, 0
        if code.kind == NATIVE:
            self.signature = signature(code.data, code.prelude)
            start = mpy.native_start
        self.entry = self._base + start

    def instruction(self, address):
        """An instruction as text, with its offset in the function."""
        offset = address - self._base
        text = self.processor.instruction(self.code.data, address, offset)
        return "+0x%X %s" % (offset, text)

    def block(self, address):
        """The pcode.Block at an address."""
        block = self._blocks.get(address)
        if block is None:
            block = pcode.block(self.processor, self.code.data, self._base, address)
            self._blocks[address] = block
        return block

    def coverage(self):
        """(instructions that ran so far, instructions that could); jumps by register left out."""
        ran = set().union(*[block.addresses for block in self._blocks.values()])
        found, to_do = {}, [self.entry]
        while to_do:
            address = to_do.pop()
            if address not in found:
                found[address] = self._blocks.get(address) or pcode.block(
                    self.processor, self.code.data, self._base, address
                )
                to_do += found[address].targets
        return len(ran), len(ran.union(*[block.addresses for block in found.values()]))

    def call(self, arguments, hardware=None, trace=None):
        """Run it; returns what it returns, raises what it raises, or MachineFault or Impure."""
        memory = Memory(hardware)
        runtime = Runtime(self, memory)
        registers = dict.fromkeys(self.processor.sizes, _POISON)
        function = self._module(memory, runtime)
        top = memory.add(_STACK, bytearray(_STACK_SIZE)) + _STACK_SIZE - 64
        for i, argument in enumerate(arguments):
            memory.store(top + 4 * i, 4, runtime.encode(argument))
        p = self.processor
        for place, word in zip(p.arguments, (function, len(arguments), 0, top)):
            registers[place] = word
        registers[p.stack], registers[p.link] = top, _HOME | p.convention.function_bit
        kept = {place: 0xB0000000 + place for place in p.kept}
        registers.update(kept)
        memory.trace = trace
        self._run(registers, memory, runtime)
        if any(registers[place] != word for place, word in kept.items()):
            raise MachineFault("does not give back a register of its caller")
        if p.kept and registers[p.stack] != top:
            raise MachineFault("does not give back the stack")
        return runtime.decode(registers[p.returns])

    def _module(self, memory, runtime):
        """Lay out the function object and what hangs on it; returns its address.

        py/objfun.h: type, context, children, code. py/obj.h: a context is a module (type,
        globals) and its constants (names, objects).
        """
        base = _MODULE * PAGE
        names_at = base + 64
        objects_at = names_at + (2 * len(self.mpy.names) + 3 & ~3)
        words = [0, base + 16, 0, self.entry, 0, 0, names_at, objects_at]
        data = struct.pack("<8I", *words).ljust(64, b"\0")
        data += struct.pack("<%dH" % len(self.mpy.names), *range(len(self.mpy.names)))
        data = data.ljust(objects_at - base, b"\0")
        table = _TABLE * PAGE
        data += b"".join(
            struct.pack("<I", runtime.encode_constant(value, table))
            for value in self.mpy.constants
        )
        memory.add(_MODULE, data)
        memory.add(self._page, self.code.data)
        bit = self.processor.convention.function_bit
        memory.add(_TABLE, b"".join(struct.pack("<I", w) for w in runtime.table(bit)))
        return base

    def _run(self, registers, memory, runtime):
        load, store, blocks = memory.load, memory.store, self._blocks
        address, at, left = self.entry, None, _LONGEST
        while True:
            block = blocks.get(address)
            if block is None:
                if not self._base <= address < self._base + len(self.code.data):
                    offset = address - self._base
                    raise MachineFault("jumps out of the function, to %+d" % offset, at)
                block = self.block(address)
            left -= len(block.addresses)
            if left < 0:
                raise MachineFault("did not return within %d instructions" % _LONGEST, address)
            at = block.addresses[-1]
            address, after = block.run(registers, load, store)
            if address & ~1 == _HOME:
                self.count = _LONGEST - left
                return
            if after:
                number = (address - CALLS) >> 2
                if not 0 <= number < TABLE_WORDS:
                    raise MachineFault("calls 0x%08X, no function" % address, at)
                if number == TO_OBJ and memory.trace is not None:
                    value = registers[self.processor.call[0]]
                    memory.trace.append((at, "makes an object of", 0, 0, value))
                try:
                    address = self._serve(runtime, number, registers, after)
                except MachineFault as fault:
                    fault.address = fault.address or at
                    raise

    def _serve(self, runtime, number, registers, after):
        """A call of a function of the table; returns where to go on."""
        p = self.processor
        try:
            arguments = [registers[place] for place in p.call]
            result = runtime.serve(number, arguments, registers, after)
        except (MachineFault, Impure):
            raise
        except Exception as error:
            after, result = runtime.caught(error, registers)
        for place in p.scratch:
            registers[place] = _POISON
        registers[p.result] = result & 0xFFFFFFFF
        return after

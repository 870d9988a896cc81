# SPDX-License-Identifier: MIT
"""A board's memory as a function sees it: a page of 64 KiB for each thing, holes between them.

A buffer's page is the Python object's own memory, so what is stored is in the object at once.
A read or write that misses, or is not aligned, is a MachineFault: so is an index gone wrong.
"""

import struct

from .faults import MachineFault

PAGE = 1 << 16
_FIRST_BUFFER = 0x2000
_READ = {size: struct.Struct(f).unpack_from for size, f in ((1, "<B"), (2, "<H"), (4, "<I"))}
_WRITE = {size: struct.Struct(f).pack_into for size, f in ((1, "<B"), (2, "<H"), (4, "<I"))}


class Memory:
    """load() and store() for Blocks; `hardware` (a tape.Replay) has what is outside all pages.

    trace: None, or a list that gets (instruction, "reads" or "writes", buffer's number, offset,
    value) of each access to a buffer or the hardware.
    """

    def __init__(self, hardware=None):
        self.pages = {}
        self.hardware = hardware
        self.trace = None
        self._buffers = {}  # id: (address, object)

    def add(self, number, data):
        """Let a page hold `data` (bytes or a bytearray); returns its address."""
        self.pages[number] = memoryview(data)
        return number * PAGE

    def address(self, buffer):
        """Where a Python object's memory is seen; TypeError when it has none."""
        known = self._buffers.get(id(buffer))
        if known is None:
            view = memoryview(buffer).cast("B")
            if len(view) > PAGE:
                raise ValueError("a buffer of %d bytes" % len(view))
            address = self.add(_FIRST_BUFFER + len(self._buffers), view)
            known = self._buffers[id(buffer)] = (address, buffer)
        return known[0]

    def buffer(self, address):
        """The memory from an address on, as address() may be told it again; None: no buffer."""
        number, offset = divmod(address, PAGE)
        if number < _FIRST_BUFFER or number not in self.pages or offset > len(self.pages[number]):
            return None
        return self.pages[number][offset:]

    def load(self, address, size, at=None):
        """The number of so many bytes at an address; `at`: the instruction."""
        try:
            value = _READ[size](self.pages[address >> 16], address & 0xFFFF)[0]
        except (KeyError, struct.error):
            value = self._outside("r", address, size, None, at)
        if address & size - 1:
            raise MachineFault("reads %d bytes at 0x%08X, not aligned" % (size, address), at)
        if self.trace is not None:
            self._note("reads", address, value, at)
        return value

    def store(self, address, size, value, at=None):
        """Write the number's low bytes to an address."""
        value &= (1 << 8 * size) - 1
        try:
            _WRITE[size](self.pages[address >> 16], address & 0xFFFF, value)
        except (KeyError, struct.error):
            self._outside("w", address, size, value, at)
        except TypeError:
            raise MachineFault("writes to what is constant, 0x%08X" % address, at) from None
        if address & size - 1:
            raise MachineFault("writes %d bytes at 0x%08X, not aligned" % (size, address), at)
        if self.trace is not None:
            self._note("writes", address, value, at)

    def _outside(self, how, address, size, value, at):
        verb = "reads" if how == "r" else "writes"
        beside = address >> 16 in self.pages
        if self.hardware is None or beside:
            where = "beside a buffer" if beside else "where nothing is"
            raise MachineFault("%s %d bytes at 0x%08X, %s" % (verb, size, address, where), at)
        try:
            return self.hardware.access(how, address, value)
        except LookupError as error:
            raise MachineFault(str(error), at) from None

    def _note(self, how, address, value, at):
        if address >> 16 >= _FIRST_BUFFER:
            self.trace.append((at, how, address >> 16, address & 0xFFFF, value))

# SPDX-License-Identifier: MIT
"""What is in a .mpy file: names, constants and the tree of its functions' code.

The format is MicroPython's (py/persistentcode.c), version 6. Its sub-version 3 (from 1.23 on)
puts a word before the machine code of native functions; 2 is the same otherwise.
"""

from typing import NamedTuple

BYTECODE, NATIVE, VIPER = 0, 1, 2  # kinds of code
FUN_TABLE = object()  # stands for the address of mp_fun_table among the constants

_VERSION = 6
_STATIC = 1  # a name that every firmware has, by number
_FIXED = (FUN_TABLE, None, False, True, ...)  # constants without data, by type
_STR, _BYTES, _INT, _FLOAT, _TUPLE = 5, 6, 7, 8, 10


class Code(NamedTuple):
    """One function or class body: `data` is its bytecode or machine code.

    prelude: where in `data` of a NATIVE function its description begins; None for other kinds.
    """

    kind: int
    data: bytes
    prelude: int | None
    children: tuple


class Signature(NamedTuple):
    """What a NATIVE function's prelude says: words of state, flags, arguments, name's number."""

    n_state: int
    flags: int
    n_args: int
    name: int


class Mpy:
    """A parsed file: `names` (text, or a static one's number), `constants`, `root`.

    native_start: where in the data of a NATIVE function its first instruction is.
    """

    def __init__(self, data):
        if data[:1] != b"M" or data[1] != _VERSION:
            raise ValueError("not a .mpy file of version %d" % _VERSION)
        self.native_start = 4 if data[2] & 3 >= 3 else 0
        self._data, self._at = data, 4
        n_names, n_constants = self._uint(), self._uint()
        self.names = [self._name() for _ in range(n_names)]
        self.constants = [self._constant() for _ in range(n_constants)]
        self.root = self._code()

    def _take(self, size):
        self._at += size
        return self._data[self._at - size : self._at]

    def _uint(self):
        value, self._at = uint(self._data, self._at)
        return value

    def _name(self):
        code = self._uint()
        if code & _STATIC:
            return code >> 1
        return self._take((code >> 1) + 1)[:-1].decode()

    def _constant(self):
        kind = self._take(1)[0]
        if kind < len(_FIXED):
            return _FIXED[kind]
        size = self._uint()
        if kind == _TUPLE:
            return tuple([self._constant() for _ in range(size)])
        data = self._take(size)
        if kind in (_STR, _BYTES):
            self._take(1)  # a zero behind it
            return data.decode() if kind == _STR else data
        return {_INT: int, _FLOAT: float}.get(kind, complex)(data.decode())

    def _code(self):
        head = self._uint()
        kind = head & 3
        data = self._take(head >> 3)
        extra = self._uint() if kind != BYTECODE else None  # a viper function's flags are 0
        children = [self._code() for _ in range(self._uint())] if head & 4 else ()
        return Code(kind, data, extra if kind == NATIVE else None, tuple(children))


def uint(data, at):
    """A number in groups of seven bits, highest first; returns it and where it ends."""
    value = 0
    while True:
        value = value << 7 | data[at] & 0x7F
        at += 1
        if not data[at - 1] & 0x80:
            return value, at


def signature(data, at):
    """The Signature at `at` in bytecode or in a native function's data."""
    byte = data[at]
    n_state, n_args, flags, shift = byte >> 3 & 15, byte & 3, 0, 0
    while byte & 0x80:  # each further byte has two bits of n_state, one of flags and arguments
        at += 1
        byte = data[at]
        n_state |= (byte & 0x30) << 2 * shift
        n_args |= (byte & 4) << shift
        flags |= (byte >> 6 & 1) << shift
        shift += 1
    at += 1
    while data[at] & 0x80:  # sizes of what follows
        at += 1
    return Signature(n_state + 1, flags, n_args, uint(data, at + 1)[0])

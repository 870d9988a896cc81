# SPDX-License-Identifier: MIT
"""Objects as machine words, and the operators on them by MicroPython's numbers (py/runtime0.h)."""

import operator

from .faults import MachineFault
from .mpy import FUN_TABLE

NO_OBJECT = 0
_FIRST = 0x01000000  # the word of object number 0
_SMALL = 1 << 30


def _matches(error, kind):
    return isinstance(error, kind)


_ARITHMETIC = (
    operator.or_, operator.xor, operator.and_, operator.lshift, operator.rshift, operator.add,
    operator.sub, operator.mul, operator.matmul, operator.floordiv, operator.truediv,
    operator.mod, operator.pow,
)  # fmt: skip
_UNARY = (operator.pos, operator.neg, operator.invert, operator.not_)
_BINARY = (
    operator.lt, operator.gt, operator.eq, operator.le, operator.ge, operator.ne,
    lambda a, b: a in b, operator.is_, _matches, *_ARITHMETIC, *_ARITHMETIC,
)  # fmt: skip


class Objects:
    """Numbers the Python objects that a function meets.

    Object representation A: a small integer is 2 n + 1. All else is a number above _FIRST, where
    no memory is.
    """

    def __init__(self):
        self._objects = []
        self._numbers = {}

    def encode(self, value):
        """The word of an object."""
        if type(value) is int and -_SMALL <= value < _SMALL:
            return (value << 1 | 1) & 0xFFFFFFFF
        number = self._numbers.get(id(value))
        if number is None:
            number = self._numbers[id(value)] = len(self._objects)
            self._objects.append(value)  # kept, so that its id stays its own
        return _FIRST + 8 * number

    def encode_constant(self, value, table):
        """The word of a constant of a .mpy, the function table's address among them."""
        return table if value is FUN_TABLE else self.encode(value)

    def decode(self, word):
        """The object of a word; MachineFault when it is none."""
        if word & 1:
            return (word >> 1) - (word >> 31 << 31)
        number, rest = divmod(word - _FIRST, 8)
        if rest or not 0 <= number < len(self._objects):
            raise MachineFault("0x%08X is taken for an object" % word)
        return self._objects[number]

    # entries of the function table that need nothing else

    def is_true(self, word):
        return int(bool(self.decode(word)))

    def unary(self, number, word):
        return self.encode(_UNARY[number](self.decode(word)))

    def binary(self, number, left, right):
        return self.encode(_BINARY[number](self.decode(left), self.decode(right)))

    def floor_divide(self, a, b):
        return signed(a) // signed(b)

    def modulo(self, a, b):
        return signed(a) % signed(b)


def signed(word):
    """A word as the int that it is in two's complement."""
    return (word ^ 0x80000000) - 0x80000000

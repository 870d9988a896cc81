# SPDX-License-Identifier: MIT
"""mp_fun_table: what native code calls, on Python objects in the place of MicroPython's.

Numbers, argument order and the meaning of each entry are py/nativeglue.h's and nativeglue.c's;
they are the same from MicroPython 1.22 to 1.29.
"""

import builtins
import types

from .faults import Impure, MachineFault
from .objects import NO_OBJECT, Objects, signed
from .snapshot import is_open
from .tape import Outside

CALLS = 0x00E00000  # where the table's functions seem to be; no page
TABLE_WORDS = 50
TO_OBJ = 4  # the entry that makes an object of a number
_OBJ, _BOOL, _INT, _UINT = range(4)  # types of viper; beyond them are pointers
_LOAD = 4  # MP_OBJ_SENTINEL: an element is not stored but loaded


class Runtime(Objects):
    """The table for one call of one function (a machine.Native)."""

    def __init__(self, native, memory):
        super().__init__()
        self.native, self.memory = native, memory
        self._handlers = []  # of exceptions: [buffer, registers, address]
        self._here = None  # registers, and where the call under way returns to

    def table(self, function_bit):
        """The table's words."""
        constants = [self.encode(value) for value in (None, False, True)]
        return constants + [CALLS + 4 * i + function_bit for i in range(3, TABLE_WORDS)]

    def _items(self, n, at):
        return [self.decode(self.memory.load(at + 4 * i, 4)) for i in range(n)]

    def _name(self, number):
        if not 0 <= number < len(self.native.names):
            raise MachineFault("name %d of %d" % (number, len(self.native.names)))
        return self.native.names[number]

    # calls, and exceptions that leave them

    def serve(self, number, arguments, registers, after):
        """Call entry `number`; returns the result's word."""
        function = _TABLE.get(number)
        if function is None:
            raise Impure("it needs entry %d of the function table" % number)
        self._here = registers, after
        result = function(self, *arguments[: function.__code__.co_argcount - 1])
        return 0 if result is None else result

    def caught(self, error, registers):
        """Go to the handler: (address, result of the nlr_push that returns again), or raise."""
        if not self._handlers:
            raise error
        buffer, saved, address = self._handlers.pop()
        registers.update(saved)
        self.memory.store(buffer + 4, 4, self.encode(error))
        return address, 1

    def nlr_push(self, buffer):
        self._handlers.append([buffer])
        return self.setjmp(buffer)

    def setjmp(self, _buffer):
        registers, after = self._here
        self._handlers[-1][1:] = dict(registers), after
        return 0

    def nlr_pop(self):
        self._handlers.pop()

    def raise_(self, word):
        if word != NO_OBJECT and self.decode(word) is not None:
            raise self.decode(word)

    # conversions

    def from_obj(self, word, kind):
        value = self.decode(word)
        if kind & 15 == _OBJ:
            return word
        if kind & 15 == _BOOL:
            return int(bool(value))
        if kind & 15 > _UINT:
            try:
                return self.memory.address(value)
            except TypeError:
                pass
        if not isinstance(value, int):
            raise TypeError("can't convert %s to int" % type(value).__name__)
        return value

    def to_obj(self, value, kind):
        kind &= 15
        if kind == _OBJ:
            return value
        if kind == _BOOL:
            return self.encode(value != 0)
        if kind > _UINT:  # for another function's pointer: here an address would mean nothing
            buffer = self.memory.buffer(value)
            return self.encode(value if buffer is None else buffer)
        return self.encode(signed(value) if kind == _INT else value)

    # names, attributes, elements

    def swap_globals(self, _new):
        return 0  # they are the caller's own

    def load_global(self, name):
        name = self._name(name)
        if name in self.native.globals:
            return self.encode(self.native.globals[name])
        if not hasattr(builtins, name):
            raise NameError(name)
        return self.encode(getattr(builtins, name))

    def store_global(self, name, _word):
        raise Impure("it changes the global %s" % self._name(name))

    def load_attr(self, base, name):
        return self.encode(getattr(self.decode(base), self._name(name)))

    def load_method(self, base, name, to):
        self.memory.store(to, 4, self.load_attr(base, name))
        self.memory.store(to + 4, 4, NO_OBJECT)

    def store_attr(self, base, name, word):
        setattr(self.decode(base), self._name(name), self.decode(word))

    def subscript(self, base, index, word):
        base, index = self.decode(base), self.decode(index)
        if word == _LOAD:
            return self.encode(base[index])
        base[index] = self.decode(word)
        return self.encode(None)

    # functions, tuples

    def new_tuple(self, n, at):
        return self.encode(tuple(self._items(n, at)))

    def call(self, function, counts, at):
        return self._call(self.decode(function), counts & 0xFF, counts >> 8 & 0xFF, at)

    def call_method(self, n, n_keywords, at):
        function, own = self.memory.load(at, 4), self.memory.load(at + 4, 4)
        if own != NO_OBJECT:
            raise MachineFault("a method with its object, which load_method did not give")
        return self._call(self.decode(function), n, n_keywords, at + 8)

    def _call(self, function, n, n_keywords, at):
        self._check(function)
        items = self._items(n + 2 * n_keywords, at)
        keywords = dict(zip(items[n::2], items[n + 1 :: 2]))
        return self.encode(function(*items[:n], **keywords))

    def _check(self, function):
        """Impure unless it is viper's, board code, a class, a built-in, or an argument's own."""
        if isinstance(function, types.FunctionType):
            module = function.__module__ or ""
            if is_open(function) and module.partition(".")[0] in self.native.modules:
                return
        elif isinstance(function, (type, types.BuiltinFunctionType, types.MethodType, Outside)):
            return
        raise Impure("it calls %s" % getattr(function, "__qualname__", function))

    def arg_check(self, n, n_keywords, _sig):
        raise TypeError("function called with %d and %d arguments" % (n, n_keywords))

    def setup_code_state(self, state, n, n_keywords, at):
        """Put a native function's arguments at the end of its state, the first one last."""
        wanted = self.native.signature
        if n_keywords or n != wanted.n_args:
            raise TypeError("native function takes %d arguments, not %d" % (wanted.n_args, n))
        first = state + 20  # behind function, ip, sp, n_state, old globals
        for i in range(wanted.n_state):
            word = self.memory.load(at + 4 * i, 4) if i < n else NO_OBJECT
            self.memory.store(first + 4 * (wanted.n_state - 1 - i), 4, word)

    def getiter(self, word, buffer):
        iterator = self.encode(iter(self.decode(word)))
        if buffer == 0:
            return iterator
        self.memory.store(buffer, 4, NO_OBJECT)  # it has no iterator itself, but knows one
        self.memory.store(buffer + 4, 4, iterator)
        return NO_OBJECT

    def iternext(self, buffer):
        for value in self.decode(self.memory.load(buffer + 4, 4)):
            return self.encode(value)
        return NO_OBJECT  # the end


_TABLE = {
    3: Runtime.from_obj, TO_OBJ: Runtime.to_obj, 5: Runtime.swap_globals, 7: Runtime.load_global,
    9: Runtime.load_attr, 10: Runtime.load_method, 13: Runtime.store_global,
    14: Runtime.store_attr, 15: Runtime.subscript, 16: Runtime.is_true, 17: Runtime.unary,
    18: Runtime.binary, 19: Runtime.new_tuple, 27: Runtime.call, 28: Runtime.call_method,
    30: Runtime.getiter, 31: Runtime.iternext, 32: Runtime.nlr_push, 33: Runtime.nlr_pop,
    34: Runtime.raise_, 44: Runtime.arg_check, 45: Runtime.setup_code_state,
    46: Runtime.floor_divide, 47: Runtime.modulo, 49: Runtime.setjmp,
}  # fmt: skip

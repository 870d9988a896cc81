# SPDX-License-Identifier: MIT
"""Copies and pictures of what a call is given: numbers, buffers and objects made of them.

What is neither, a bus or a pin, is an Opaque in a copy: a function that leaves it alone does not
notice, one that uses it is Impure.
"""

import ctypes
import types
from array import array

from .faults import Impure
from .tape import Outside

_ATOMS = (type(None), bool, int, float, str, bytes, type, types.BuiltinFunctionType, Outside)


class Opaque:
    """Stands for something of which only the name is known, and some attributes may be."""

    def __init__(self, what, **attributes):
        object.__setattr__(self, "what", what)
        object.__setattr__(self, "attributes", attributes)

    def _used(self, *_arguments, **_keywords):
        raise Impure("it uses %s" % object.__getattribute__(self, "what"))

    def __getattribute__(self, name):
        known = object.__getattribute__(self, "attributes")
        if name in known:
            return known[name]
        raise Impure("it uses %s.%s" % (object.__getattribute__(self, "what"), name))

    __setattr__ = __call__ = __getitem__ = __setitem__ = __len__ = _used
    __iter__ = __bool__ = __add__ = __sub__ = _used


def is_open(function):
    """Whether a Python function has no hidden variables: viper's, or one of a module."""
    return hasattr(function, "checked") or not function.__closure__


def _is_ours(value, folders):
    """Whether it is an instance of a class of one of these modules (or a module inside)."""
    home = getattr(type(value), "__module__", "")
    ours = home in folders or home.partition(".")[0] in folders
    return ours and hasattr(value, "__dict__")


def _offset(view):
    """Where a memoryview begins in its object, bytes."""

    def place(buffer):
        return ctypes.addressof(ctypes.c_char.from_buffer(buffer))

    return place(view) - place(view.obj) if len(view) else 0


class Copier:
    """copy(value) for one call: what was one object stays one.

    folders: modules whose classes are board code.
    """

    def __init__(self, folders):
        self.folders = folders
        self._known = {}  # id: (copy, original, kept so that the id stays its own)

    def copy(self, value):
        """A copy of a value, deep."""
        if type(value) is Opaque or isinstance(value, _ATOMS):
            return value
        if id(value) not in self._known:
            maker = self._maker(value)
            if maker is None:
                maker = self._opaque
            maker(value)
        return self._known[id(value)][0]

    def _maker(self, value):
        kinds = (
            (array, self._buffer), (bytearray, self._buffer), (memoryview, self._view),
            (list, self._list), (dict, self._dict), (types.MethodType, self._method),
        )  # fmt: skip
        for kind, maker in kinds:
            if type(value) is kind:
                return maker
        if isinstance(value, types.FunctionType):
            return self._function if is_open(value) else None
        if isinstance(value, tuple):
            return self._tuple
        return self._instance if _is_ours(value, self.folders) else None

    def _put(self, value, copy):
        self._known[id(value)] = (copy, value)
        return copy

    def _keep(self, value):
        self._put(value, value)

    def _function(self, value):
        """Board code binds what a function works with as defaults: a copy has copies of them."""
        inner = getattr(value, "checked", value)
        if all(isinstance(default, _ATOMS) for default in inner.__defaults__ or ()):
            return self._keep(value)
        made = types.FunctionType(
            inner.__code__, inner.__globals__, inner.__name__, None, inner.__closure__
        )
        made.__module__, made.checked = value.__module__, made
        self._put(value, made)
        made.__defaults__ = tuple([self.copy(default) for default in inner.__defaults__])

    def _opaque(self, value):
        self._put(value, Opaque(getattr(value, "__name__", type(value).__name__)))

    def _buffer(self, value):
        self._put(value, value[:])

    def _view(self, value):
        if value.readonly:
            return self._keep(value)
        base = memoryview(self.copy(value.obj)).cast("B")
        start = _offset(value)
        self._put(value, base[start : start + value.nbytes].cast(value.format))

    def _list(self, value):
        self._put(value, []).extend([self.copy(item) for item in value])

    def _tuple(self, value):
        items = [self.copy(item) for item in value]
        if id(value) not in self._known:  # by way of an item
            self._put(value, type(value)(*items) if hasattr(value, "_fields") else tuple(items))

    def _dict(self, value):
        self._put(value, {}).update({key: self.copy(item) for key, item in value.items()})

    def _method(self, value):
        owner = self.copy(value.__self__)
        if id(value) not in self._known:  # the owner may keep its own method
            self._put(value, types.MethodType(value.__func__, owner))

    def _instance(self, value):
        made = self._put(value, object.__new__(type(value)))
        made.__dict__.update({key: self.copy(item) for key, item in vars(value).items()})


def picture(value, folders):
    """{place: content} of a value: the same for two that nothing could tell apart.

    Places are texts like "[0]._s"; each object is told once, where it is met first, a buffer with
    all its numbers.
    """
    found, known = {}, {}

    def tell(value, place):
        hidden = type(value) is Opaque
        if not hidden and isinstance(value, (bool, int, float, str, bytes, type(None))):
            found[place] = [type(value).__name__, value]
        elif id(value) in known:
            found[place] = known[id(value)]
        else:
            known[id(value)] = place
            if hidden:
                found[place] = None
            else:
                inside(value, place)

    def inside(value, place):
        if isinstance(value, (array, bytearray, memoryview)):
            found[place] = tuple(value)
        elif isinstance(value, (list, tuple)):
            for i, item in enumerate(value):
                tell(item, "%s[%d]" % (place, i))
        elif isinstance(value, dict):
            for key, item in value.items():
                tell(item, "%s[%r]" % (place, key))
        elif isinstance(value, types.MethodType):
            tell(value.__self__, place + ".__self__")
        elif isinstance(value, types.FunctionType) and is_open(value):
            found[place] = None
            for i, item in enumerate(getattr(value, "checked", value).__defaults__ or ()):
                tell(item, "%s.__defaults__[%d]" % (place, i))
        elif _is_ours(value, folders):
            for key, item in sorted(vars(value).items()):
                tell(item, "%s.%s" % (place, key))
        else:
            found[place] = None

    tell(value, "")
    return found

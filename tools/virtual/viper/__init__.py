# SPDX-License-Identifier: MIT
"""`micropython.viper` on CPython: executes the function and checks it.

What would wrap, be cut or be read from beside a buffer on the board raises here: OverflowError,
IndexError or ZeroDivisionError naming function, line and operands. What the board's compiler
refuses raises ViperTypeError when the function is defined. Everything else gives the board's
result bit for bit.
"""

import ast
import builtins
import ctypes
import errno
import linecache
import types
from array import array

from .compile import Function
from .consts import file_constants
from .ranges import divides_safely
from .values import LIMITS, ViperTypeError

_FORMATS = {"ptr": "B", "ptr8": "B", "ptr16": "H", "ptr32": "i"}
_files = {}
_codes = {}  # (file, line) -> (definition, code): every Port imports the board's code afresh
# callables (address, pointer kind) -> object with [index], or None; a Port adds its peripherals
address_space = []


def overflow(value, title, line, text, variables):
    """Report a result that 32 bits (or a shift count that 0..31, or a store that its element)
    cannot hold.
    """
    names = [
        node.id
        for node in ast.walk(ast.parse(text.removeprefix("store of ")))
        if isinstance(node, ast.Name)
    ]
    operands = ", ".join(
        "%s=%s" % (n, variables[n]) for n in dict.fromkeys(names) if n in variables
    )
    raise OverflowError("%s, line %d: %s gives %d (%s)" % (title, line, text, value, operands))


def bad_index(index, title, line):
    raise IndexError("%s, line %d: pointer index %d" % (title, line, index))


def divide(a, b, title, line, text):
    """Floor division; OverflowError where the board's routine gives something else."""
    if not divides_safely((a, a), (b, b)):
        raise OverflowError(
            "%s, line %d: %s is wrong on the board: %d // %d" % (title, line, text, a, b)
        )
    return a // b


def number(value, kind, title, line, text):
    """Convert an object to int or uint as the board does, except that what does not fit raises."""
    if not isinstance(value, int):
        raise TypeError(
            "%s, line %d: %s: can't convert %s to %s"
            % (title, line, text, type(value).__name__, kind)
        )
    low, high = LIMITS[kind]
    if not low <= value <= high:
        raise OverflowError("%s, line %d: %s = %d is no %s" % (title, line, text, value, kind))
    return int(value)


def pointer(value, kind, title):
    """Return what pointer type `kind` reads and writes: a view of a buffer, or the peripheral at
    an address.
    """
    if value.__class__ is array and value.typecode == "i" and kind == "ptr32":
        return memoryview(value)
    if isinstance(value, int):
        for lookup in address_space:
            memory = lookup(value & 0xFFFFFFFF, kind)
            if memory is not None:
                return memory
        raise IndexError(
            "%s: %s of address 0x%08X: nothing is there" % (title, kind, value & 0xFFFFFFFF)
        )
    try:
        view = memoryview(value).cast("B")
    except TypeError:
        raise TypeError("%s: %s of %s" % (title, kind, type(value).__name__)) from None
    if kind in ("ptr8", "ptr"):
        return view
    size = 2 if kind == "ptr16" else 4
    if isinstance(value, memoryview) and len(view) and not view.readonly:
        offset = ctypes.addressof(ctypes.c_char.from_buffer(view)) % size
        if offset:
            raise ValueError("%s: %s of an odd address stops an RP2040" % (title, kind))
    return view[: len(view) // size * size].cast(_FORMATS[kind])


def oserror(code):
    """`OSError(code)` with its errno, which CPython sets only when a text comes with it."""
    if isinstance(code, int):
        return OSError(code, errno.errorcode.get(code, ""))
    return OSError(code)


_HELPERS = {
    "_viper_oserror": oserror,
    "_viper_overflow": overflow,
    "_viper_index": bad_index,
    "_viper_divide": divide,
    "_viper_number": number,
    "_viper_pointer": pointer,
    "locals": locals,
    "bool": bool,
    "int": int,
}


def _parsed(filename):
    """Return ({first line: definition}, constants) of a source file."""
    linecache.checkcache(filename)
    lines = linecache.getlines(filename)
    source = "".join(lines)
    known = _files.get(filename)
    if known and known[0] == source:
        return known[1:]
    if not source:
        raise ViperTypeError("the checked viper needs the source of %s" % filename)
    tree = ast.parse(source, filename)
    definitions = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef) and node.decorator_list:
            definitions[min(d.lineno for d in node.decorator_list)] = node
    _files[filename] = (source, definitions, file_constants(tree))
    return _files[filename][1:]


def _code_of(function, filename, outer_names):
    """Compile the translated function inside a scope that has `outer_names`, and return its code
    object.
    """
    arguments = ast.arguments([], [ast.arg(n) for n in outer_names], None, [], [], None, [])
    outer = ast.FunctionDef("outer", arguments, [function], [])
    module = ast.fix_missing_locations(ast.Module([outer], []))
    code = builtins.compile(module, filename, "exec")  # `compile` is the file beside this one
    for name in ("outer", function.name):
        code = next(
            c for c in code.co_consts if isinstance(c, types.CodeType) and c.co_name == name
        )
    return code


def viper(function):
    """Decorator: the checked twin of `function`, with its globals and closure; `__wrapped__` is
    the original.
    """
    filename = function.__code__.co_filename
    definitions, constants = _parsed(filename)
    definition = definitions.get(function.__code__.co_firstlineno)
    if definition is None:
        raise ViperTypeError("no source for %s in %s" % (function.__qualname__, filename))
    free = function.__code__.co_freevars
    place = (filename, function.__code__.co_firstlineno)
    known, code = _codes.get(place, (None, None))
    if known is not definition:
        translator = Function(definition, constants, function.__qualname__)
        code = _code_of(translator.translate(), filename, [*_HELPERS, *free])
        _codes[place] = (definition, code)
    cells = dict(zip(free, function.__closure__ or ()))
    cells.update({n: types.CellType(helper) for n, helper in _HELPERS.items()})
    closure = tuple(cells[n] for n in code.co_freevars)
    checked = types.FunctionType(code, function.__globals__, function.__name__, None, closure)
    checked.__doc__, checked.__qualname__ = function.__doc__, function.__qualname__
    checked.__module__, checked.__wrapped__ = function.__module__, function
    return checked


def install_types():
    """Give `builtins` the names that viper annotations use, so that they evaluate."""
    for name in ("ptr", "ptr8", "ptr16", "ptr32", "uint"):
        if not hasattr(builtins, name):
            setattr(
                builtins,
                name,
                type(name, (), {"__doc__": "viper's %s; a type only inside viper code" % name}),
            )

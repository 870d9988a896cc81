# SPDX-License-Identifier: MIT
"""`micropython.viper` on CPython without the checks: the same integers, about twice as fast.

For long recordings of code that the checked twin has proven: what would wrap on the board would
be another number here. A store that an element cannot hold still raises.
"""

import ast
from array import array

from . import _code_of, _parsed
from .consts import fold
from .values import ELEMENT

_FORMATS = {"ptr": "B", "ptr8": "B", "ptr16": "H", "ptr32": "i"}


def view(value, code):
    """What a pointer of this element reads and writes."""
    if value.__class__ is array and value.typecode == code:
        return value
    return memoryview(value).cast("B").cast(code)


class _Plain(ast.NodeTransformer):
    """Casts away, pointers to views, constants to numbers."""

    def __init__(self, constants):
        self._constants = constants

    def visit_Name(self, node):
        value = fold(node, self._constants) if isinstance(node.ctx, ast.Load) else None
        return node if value is None else ast.copy_location(ast.Constant(value), node)

    def visit_Call(self, node):
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name in ELEMENT and ast.unparse(node.args[0]).startswith("int("):
            moved = node.args[0]  # ptr32(int(p) + bytes)
            places = fold(moved.right, self._constants) // ELEMENT[name]
            whole = ast.Call(ast.Name("memoryview", ast.Load()), moved.left.args, [])
            further = ast.Slice(ast.Constant(places), None, None)
            return ast.copy_location(ast.Subscript(whole, further, ast.Load()), node)
        self.generic_visit(node)
        if name in _FORMATS:
            return ast.copy_location(_view(node.args[0], name), node)
        if name in ("int", "uint") and len(node.args) == 1:
            return node.args[0]
        return node


def _view(value, kind):
    return ast.Call(
        ast.Name("_viper_view", ast.Load()), [value, ast.Constant(_FORMATS[kind])], []
    )


def viper(function):
    """Decorator: the unchecked twin of `function`; `__wrapped__` is the original."""
    filename = function.__code__.co_filename
    definitions, constants = _parsed(filename)
    definition = definitions[function.__code__.co_firstlineno]
    made = ast.parse(ast.unparse(definition)).body[0]
    ast.increment_lineno(made, definition.lineno)
    made.decorator_list, made.returns = [], None
    _Plain({name: (value, 0) for name, (value, _) in constants.items()}).visit(made)
    for argument in reversed(made.args.args):
        kind = argument.annotation.id if isinstance(argument.annotation, ast.Name) else ""
        argument.annotation = None
        if kind in _FORMATS:
            value = _view(ast.Name(argument.arg, ast.Load()), kind)
            made.body.insert(0, ast.Assign([ast.Name(argument.arg, ast.Store())], value))
    free = function.__code__.co_freevars
    code = _code_of(made, filename, ["_viper_view", *free])
    cells = dict(zip(free, function.__closure__ or ()))
    cells["_viper_view"] = _VIEW
    twin = type(function)(
        code, function.__globals__, function.__name__, None,
        tuple(cells[name] for name in code.co_freevars),
    )  # fmt: skip
    twin.__doc__, twin.__wrapped__ = function.__doc__, function
    return twin


_VIEW = (lambda view: lambda: view)(view).__closure__[0]

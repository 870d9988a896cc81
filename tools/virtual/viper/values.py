# SPDX-License-Identifier: MIT
"""Expressions of the checked viper: the types MicroPython's native emitter gives them, and the
checks put in.

Types and errors follow `py/emitnative.c` of MicroPython 1.25: a literal beyond 31 bits is an
object, a subscript of a pointer is an `int`, a binary operation has its left operand's type, a
call returns an object.
"""

import ast
from typing import NamedTuple

from .ranges import INT_RANGE, UINT_RANGE

OBJECT, BOOL, INT, UINT, NONE = "object", "bool", "int", "uint", "None"
POINTERS = ("ptr", "ptr8", "ptr16", "ptr32")
NUMBERS = (INT, UINT)
LIMITS = {INT: INT_RANGE, UINT: UINT_RANGE}
LOADS = {"ptr8": (0, 255), "ptr16": (0, 65535), "ptr32": INT_RANGE, "ptr": (0, 255)}
ELEMENT = {"ptr8": 1, "ptr16": 2, "ptr32": 4}
SMALL_INT = (-(2**30), 2**30 - 1)
TEMP = "_viper_t"
_BITWISE = (ast.BitAnd, ast.BitOr, ast.BitXor)


class ViperTypeError(Exception):
    """The compiler on the board refuses this function."""


class Value(NamedTuple):
    """A translated expression: its node, viper type and, for numbers, the interval it lies in."""

    node: ast.expr
    kind: str
    range: tuple | None = None


def name(identifier):
    return ast.Name(identifier, ast.Load())


def call(function, *args):
    return ast.Call(
        name(function), [a if isinstance(a, ast.AST) else ast.Constant(a) for a in args], []
    )


def guarded(node, limits, known, failure):
    """`node` if its value lies in `limits`, else the call `failure`; only the sides not `known`
    are compared.
    """
    temp = ast.NamedExpr(ast.Name(TEMP, ast.Store()), node)
    low, high = ast.Constant(limits[0]), ast.Constant(limits[1])
    if known[0] >= limits[0]:
        test = ast.Compare(temp, [ast.LtE()], [high])
    elif known[1] <= limits[1]:
        test = ast.Compare(temp, [ast.GtE()], [low])
    else:
        test = ast.Compare(low, [ast.LtE(), ast.LtE()], [temp, high])
    return ast.IfExp(test, name(TEMP), failure)

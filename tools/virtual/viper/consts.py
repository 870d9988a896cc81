# SPDX-License-Identifier: MIT
"""Compile-time constants as MicroPython's parser sees them: `NAME = const(...)` and folded
integers.
"""

import ast
import operator

_BINARY = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
    ast.LShift: operator.lshift,
    ast.RShift: operator.rshift,
    ast.BitAnd: operator.and_,
    ast.BitOr: operator.or_,
    ast.BitXor: operator.xor,
    ast.Pow: operator.pow,
}
_UNARY = {ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Invert: operator.invert}


def fold(node, constants):
    """Return the integer that `node` is at compile time, or None when it is not constant."""
    if isinstance(node, ast.Constant) and type(node.value) is int:
        return node.value
    if isinstance(node, ast.Name):
        value, line = constants.get(node.id, (None, 0))
        return value if line <= node.lineno else None
    if isinstance(node, ast.UnaryOp) and type(node.op) in _UNARY:
        value = fold(node.operand, constants)
        return None if value is None else _UNARY[type(node.op)](value)
    if isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
        left, right = fold(node.left, constants), fold(node.right, constants)
        if left is None or right is None:
            return None
        return _fold_binary(type(node.op), left, right)
    return None


def _fold_binary(kind, left, right):
    if kind in (ast.FloorDiv, ast.Mod) and right == 0:
        return None
    if kind in (ast.LShift, ast.RShift, ast.Pow) and right < 0:
        return None
    return _BINARY[kind](left, right)


def is_const_statement(node):
    """True for `NAME = const(...)`, the only form that the parser recognises."""
    return (
        isinstance(node, ast.Assign)
        and len(node.targets) == 1
        and isinstance(node.targets[0], ast.Name)
        and isinstance(node.value, ast.Call)
        and isinstance(node.value.func, ast.Name)
        and node.value.func.id == "const"
    )


def file_constants(tree):
    """Return {name: (value, line)} of the file's integer constants, at whatever depth."""
    statements = [node for node in ast.walk(tree) if is_const_statement(node)]
    constants = {}
    for node in sorted(statements, key=lambda node: node.lineno):
        value = fold(node.value.args[0], constants)
        if value is not None:
            constants[node.targets[0].id] = (value, node.lineno)
    return constants

# SPDX-License-Identifier: MIT
"""Numbers of the checked viper: casts, arithmetic, and the checks put in."""

import ast

from .consts import fold
from .ranges import (
    INT_RANGE,
    UINT_RANGE,
    clip,
    divides_safely,
    result_range,
    within,
)
from .values import (
    BOOL,
    ELEMENT,
    INT,
    LIMITS,
    NONE,
    NUMBERS,
    OBJECT,
    POINTERS,
    TEMP,
    UINT,
    Value,
    call,
    guarded,
    name,
)

_BITWISE = (ast.BitAnd, ast.BitOr, ast.BitXor)


class Arithmetic:
    """The part of Expressions that deals in numbers."""

    def cast(self, kind, node):
        """Casts between native types reinterpret the bits; a cast of an object converts, and is
        checked.
        """
        moved = self.moved(kind, node) if kind in POINTERS else None
        if moved:
            return moved
        value = self.expr(node)
        if kind in POINTERS:
            return Value(call("_viper_pointer", value.node, kind, self.title), kind)
        if value.kind in POINTERS or value.kind == NONE or (kind == BOOL and value.kind != OBJECT):
            self.refuse(node, "cast of '%s' to '%s'" % (value.kind, kind))
        if kind == BOOL:
            return Value(call("bool", value.node), BOOL)
        if value.kind == OBJECT:
            return self.convert(value, kind, node)
        if value.kind == BOOL:
            return Value(ast.IfExp(value.node, ast.Constant(1), ast.Constant(0)), kind, (0, 1))
        return self.reinterpret(value, kind)

    def moved(self, kind, node):
        """The pointer that begins further on: kind(int(p) + bytes), p of the same kind."""
        size = ELEMENT.get(kind)
        inner = node.left if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add) else None
        if not (isinstance(inner, ast.Call) and ast.unparse(inner.func) == INT and size):
            return None
        base = inner.args[0]
        if not (isinstance(base, ast.Name) and self.locals.get(base.id) == kind):
            return None
        offset = fold(node.right, self.constants)
        if offset is None or offset < 0 or offset % size:
            self.refuse(node, "a pointer moves by a constant number of elements")
        further = ast.Slice(ast.Constant(offset // size), None, None)
        return Value(ast.Subscript(name(base.id), further, ast.Load()), kind)

    def convert(self, value, kind, node):
        if isinstance(value.node, ast.Constant) and value.range:
            bits = value.range[0] & 0xFFFFFFFF
            number = bits if kind == UINT else (bits ^ 2**31) - 2**31
            return Value(ast.Constant(number), kind, (number, number))
        text = ast.unparse(node)
        return Value(
            call("_viper_number", value.node, kind, self.title, node.lineno, text),
            kind,
            LIMITS[kind],
        )

    def reinterpret(self, value, kind):
        """The same 32 bits as the other number type."""
        if within(value.range, LIMITS[kind]):
            return Value(value.node, kind, value.range)
        if kind == UINT:
            return Value(
                ast.BinOp(value.node, ast.BitAnd(), ast.Constant(0xFFFFFFFF)), UINT, UINT_RANGE
            )
        top = ast.Constant(2**31)
        flipped = ast.BinOp(value.node, ast.BitXor(), top)
        return Value(ast.BinOp(flipped, ast.Sub(), top), INT, INT_RANGE)

    def expr_BinOp(self, node):
        return self.binary(node, self.expr(node.left), self.expr(node.right))

    def binary(self, node, left, right):
        if left.kind in NUMBERS and right.kind in NUMBERS:
            return self.arithmetic(node, left, right)
        if left.kind == OBJECT and right.kind == OBJECT:
            if isinstance(node.op, ast.Div):
                self.refuse(node, "a float in viper")
            return Value(ast.BinOp(left.node, node.op, right.node), OBJECT)
        self.refuse(node, "can't do binary op between '%s' and '%s'" % (left.kind, right.kind))

    def arithmetic(self, node, left, right):
        op = node.op
        if isinstance(op, (ast.Div, ast.Pow, ast.MatMult)):
            self.refuse(node, "binary op not implemented")
        if isinstance(op, (ast.FloorDiv, ast.Mod)):
            if left.kind != INT:
                self.refuse(node, "div/mod not implemented for uint")
            right = self.reinterpret(right, INT)
            if isinstance(op, ast.FloorDiv) and not divides_safely(left.range, right.range):
                return self.divided(node, left, right)
        elif isinstance(op, _BITWISE):
            right = self.reinterpret(right, left.kind)
        elif isinstance(op, (ast.LShift, ast.RShift)):
            right = self.shift_count(node, right)
        exact = result_range(op, left.range, right.range)
        return self.checked(ast.BinOp(left.node, op, right.node), left.kind, exact, node)

    def divided(self, node, left, right):
        """A floor division of which the board's routine may overflow, checked by a call."""
        text = self.text(node)
        divide = call("_viper_divide", left.node, right.node, self.title, node.lineno, text)
        exact = result_range(node.op, left.range, right.range)
        return Value(divide, INT, clip(exact, INT_RANGE))

    def shift_count(self, node, count):
        if within(count.range, (0, 31)):
            return count
        failure = call(
            "_viper_overflow", name(TEMP), self.title, node.lineno, self.text(node), call("locals")
        )
        return Value(
            guarded(count.node, (0, 31), count.range, failure),
            count.kind,
            clip(count.range, (0, 31)),
        )

    def text(self, node):
        if isinstance(node, ast.AugAssign):
            return "%s" % ast.unparse(node)
        return ast.unparse(node)

    def checked(self, result, kind, exact, source):
        """`result` with the check that its type's 32 bits hold it, when its interval does not
        prove that.
        """
        limits = LIMITS[kind]
        if not within(exact, limits):
            failure = call(
                "_viper_overflow",
                name(TEMP),
                self.title,
                source.lineno,
                self.text(source),
                call("locals"),
            )
            result = guarded(result, limits, exact, failure)
        return Value(result, kind, clip(exact, limits))

    def expr_UnaryOp(self, node):
        value = self.expr(node.operand)
        if isinstance(node.op, ast.Not):
            self.refuse(node, "unary op not implemented; use an if")
        if value.kind == OBJECT:
            return Value(ast.UnaryOp(node.op, value.node), OBJECT)
        if isinstance(node.operand, ast.Name) and not isinstance(node.op, ast.UAdd):
            # found on the emulated board: emit_native_unary_op works in the local's own register
            self.refuse(node, "overwrites the local in MicroPython 1.25; write 0 - x or x ^ -1")
        if value.kind not in NUMBERS:
            self.refuse(node, "unary op on '%s'" % value.kind)
        if isinstance(node.op, ast.UAdd):
            return value
        low, high = value.range or (0, 0)
        if isinstance(node.op, ast.USub):
            exact = value.range and (-high, -low)
            return self.checked(ast.UnaryOp(node.op, value.node), value.kind, exact, node)
        if value.kind == UINT:
            return Value(
                ast.BinOp(value.node, ast.BitXor(), ast.Constant(0xFFFFFFFF)), UINT, UINT_RANGE
            )
        return Value(ast.UnaryOp(node.op, value.node), INT, value.range and (~high, ~low))

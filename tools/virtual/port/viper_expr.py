# SPDX-License-Identifier: MIT
"""Expressions of the checked viper: the types MicroPython's native emitter gives them, and the checks put in.

Types and errors follow `py/emitnative.c` of MicroPython 1.25: a literal beyond 31 bits is an object, a subscript of a
pointer is an `int`, a binary operation has its left operand's type, a call returns an object.
"""

import ast
from typing import NamedTuple

from .viper_consts import fold
from .viper_ranges import INT_RANGE, UINT_RANGE, clip, result_range, union, within

OBJECT, BOOL, INT, UINT, NONE = "object", "bool", "int", "uint", "None"
POINTERS = ("ptr", "ptr8", "ptr16", "ptr32")
NUMBERS = (INT, UINT)
LIMITS = {INT: INT_RANGE, UINT: UINT_RANGE}
LOADS = {"ptr8": (0, 255), "ptr16": (0, 65535), "ptr32": INT_RANGE, "ptr": (0, 255)}
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
    """`node` if its value lies in `limits`, else the call `failure`; only the sides not `known` are compared."""
    temp = ast.NamedExpr(ast.Name(TEMP, ast.Store()), node)
    low, high = ast.Constant(limits[0]), ast.Constant(limits[1])
    if known[0] >= limits[0]:
        test = ast.Compare(temp, [ast.LtE()], [high])
    elif known[1] <= limits[1]:
        test = ast.Compare(temp, [ast.GtE()], [low])
    else:
        test = ast.Compare(low, [ast.LtE(), ast.LtE()], [temp, high])
    return ast.IfExp(test, name(TEMP), failure)


class Expressions:
    """Translates expressions; `locals` maps names to types, `ranges` to intervals, `constants` as in viper_consts."""

    def refuse(self, node, text):
        raise ViperTypeError(
            "%s, line %d: %s: %s" % (self.title, node.lineno, text, ast.unparse(node))
        )

    def expr(self, node):
        """Translate one expression to a Value."""
        constant = fold(node, self.constants_in(node))
        if constant is not None:
            small = within((constant, constant), SMALL_INT)
            return Value(ast.Constant(constant), INT if small else OBJECT, (constant, constant))
        method = getattr(self, "expr_" + type(node).__name__, None)
        if method is None:
            self.refuse(node, "not supported in viper")
        value = method(node)
        ast.copy_location(value.node, node)
        return value

    def constants_in(self, node):
        return self.constants

    def object(self, node):
        """Translate an operand that is converted to an object: an argument, an element, an attribute's value."""
        value = self.expr(node)
        return ast.Constant(None) if value.kind == NONE else value.node

    def expr_Constant(self, node):
        if isinstance(node.value, bool):
            return Value(node, BOOL)
        if node.value is None:
            return Value(node, NONE)
        if isinstance(node.value, (float, complex)):
            self.refuse(node, "a float in viper")
        return Value(node, OBJECT)

    def expr_Name(self, node):
        if node.id in self.local_names:
            if node.id not in self.locals:
                self.refuse(node, "local used before type known")
            return Value(name(node.id), self.locals[node.id], self.ranges.get(node.id))
        return Value(name(node.id), OBJECT)

    def expr_Attribute(self, node):
        base = self.expr(node.value)
        if base.kind != OBJECT:
            self.refuse(node, "attribute of '%s'" % base.kind)
        return Value(ast.Attribute(base.node, node.attr, ast.Load()), OBJECT)

    def expr_Tuple(self, node):
        return Value(type(node)([self.object(e) for e in node.elts], ast.Load()), OBJECT)

    expr_List = expr_Tuple

    def expr_Call(self, node):
        func = node.func
        if isinstance(func, ast.Name) and func.id not in self.local_names:
            if func.id in (INT, UINT, BOOL, *POINTERS):
                if len(node.args) != 1 or node.keywords:
                    self.refuse(node, "a cast takes one argument")
                return self.cast(func.id, node.args[0])
        target = self.expr(func)
        if target.kind != OBJECT:
            self.refuse(node, "calling '%s'" % target.kind)
        keywords = [ast.keyword(k.arg, self.object(k.value)) for k in node.keywords]
        return Value(ast.Call(target.node, [self.object(a) for a in node.args], keywords), OBJECT)

    def cast(self, kind, node):
        """Casts between native types reinterpret the bits; a cast of an object converts, and is checked."""
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
        elif isinstance(op, _BITWISE):
            right = self.reinterpret(right, left.kind)
        elif isinstance(op, (ast.LShift, ast.RShift)):
            right = self.shift_count(node, right)
        exact = result_range(op, left.range, right.range)
        return self.checked(ast.BinOp(left.node, op, right.node), left.kind, exact, node)

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
        """`result` with the check that its type's 32 bits hold it, when its interval does not prove that."""
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

    def expr_Compare(self, node):
        values = [self.expr(e) for e in (node.left, *node.comparators)]
        kinds = {value.kind for value in values}
        if len(kinds) > 1:
            both = kinds == {INT, UINT}
            what = (
                "comparison of int and uint"
                if both
                else "can't compare %s" % " and ".join(sorted(kinds))
            )
            self.refuse(node, what)
        kind = kinds.pop()
        if kind not in (INT, UINT, OBJECT):
            self.refuse(node, "can't compare '%s'" % kind)
        if kind != OBJECT and any(
            isinstance(op, (ast.Is, ast.IsNot, ast.In, ast.NotIn)) for op in node.ops
        ):
            self.refuse(node, "binary op not implemented")
        compare = ast.Compare(values[0].node, node.ops, [value.node for value in values[1:]])
        return Value(compare, OBJECT if kind == OBJECT else BOOL)

    def condition(self, node):
        """Translate the test of an if, while, assert or conditional expression."""
        if isinstance(node, ast.BoolOp):
            return ast.copy_location(
                ast.BoolOp(node.op, [self.condition(v) for v in node.values]), node
            )
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
            return ast.copy_location(ast.UnaryOp(node.op, self.condition(node.operand)), node)
        value = self.expr(node)
        if value.kind in POINTERS:
            self.refuse(node, "can't implicitly convert '%s' to 'bool'" % value.kind)
        return value.node

    def same_kind(self, node, values):
        if len({value.kind for value in values}) > 1:
            self.refuse(node, "the branches have different types")
        span = values[0].range
        for value in values[1:]:
            span = union(span, value.range)
        return values[0].kind, span

    def expr_BoolOp(self, node):
        values = [self.expr(v) for v in node.values]
        kind, span = self.same_kind(node, values)
        return Value(ast.BoolOp(node.op, [value.node for value in values]), kind, span)

    def expr_IfExp(self, node):
        test = self.condition(node.test)
        values = [self.expr(node.body), self.expr(node.orelse)]
        kind, span = self.same_kind(node, values)
        return Value(ast.IfExp(test, values[0].node, values[1].node), kind, span)

    def index(self, node):
        """Translate a pointer's index: a number that must not be negative."""
        value = self.expr(node)
        if value.kind not in NUMBERS:
            self.refuse(node, "can't index with '%s'" % value.kind)
        if within(value.range, (0, UINT_RANGE[1])):
            return value.node
        failure = call("_viper_index", name(TEMP), self.title, node.lineno)
        return guarded(value.node, (0, UINT_RANGE[1]), value.range, failure)

    def expr_Subscript(self, node):
        base = self.expr(node.value)
        if base.kind in POINTERS:
            index = self.index(node.slice)
            return Value(ast.Subscript(base.node, index, ast.Load()), INT, LOADS[base.kind])
        if base.kind != OBJECT:
            self.refuse(node, "can't load from '%s'" % base.kind)
        return Value(ast.Subscript(base.node, self.object(node.slice), ast.Load()), OBJECT)

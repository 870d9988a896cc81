# SPDX-License-Identifier: MIT
"""Expressions of the checked viper, with the types that MicroPython's native emitter gives."""

import ast

from .arith import Arithmetic
from .consts import fold
from .ranges import UINT_RANGE, union, within
from .values import (
    BOOL,
    INT,
    LOADS,
    NONE,
    NUMBERS,
    OBJECT,
    POINTERS,
    SMALL_INT,
    TEMP,
    UINT,
    Value,
    ViperTypeError,
    call,
    guarded,
    name,
)


class Expressions(Arithmetic):
    """Translates expressions; `locals` maps names to types, `ranges` to intervals, `constants` as
    in consts.py.
    """

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
        """Translate an operand that is converted to an object: an argument, an element, an
        attribute's value.
        """
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
        plain = isinstance(func, ast.Name) and func.id not in self.local_names
        if plain and func.id in (INT, UINT, BOOL, *POINTERS):
            if len(node.args) != 1 or node.keywords:
                self.refuse(node, "a cast takes one argument")
            return self.cast(func.id, node.args[0])
        target = self.expr(func)
        if plain and func.id == "OSError" and len(node.args) == 1:
            target = Value(name("_viper_oserror"), OBJECT)
        if target.kind != OBJECT:
            self.refuse(node, "calling '%s'" % target.kind)
        keywords = [ast.keyword(k.arg, self.object(k.value)) for k in node.keywords]
        return Value(ast.Call(target.node, [self.object(a) for a in node.args], keywords), OBJECT)

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

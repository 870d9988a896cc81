# SPDX-License-Identifier: MIT
"""Assignments of the checked viper: types of locals, stores through pointers."""

import ast

from .consts import is_const_statement
from .expr import Expressions
from .ranges import union, within
from .values import (
    BOOL,
    INT,
    LIMITS,
    NUMBERS,
    OBJECT,
    POINTERS,
    UINT,
    Value,
    call,
    guarded,
    name,
)

_STORES = {"ptr": (-128, 255, 0xFF), "ptr8": (-128, 255, 0xFF), "ptr16": (-32768, 65535, 0xFFFF)}


class Stores(Expressions):
    """Translates assignments; `store` puts a Value into a name, an element or an attribute."""

    def do_Assign(self, statement):
        if is_const_statement(statement):
            return []
        if len(statement.targets) == 1 and isinstance(statement.targets[0], ast.Tuple):
            return self.unpack(statement.targets[0], statement.value)
        value = self.expr(statement.value)
        if len(statement.targets) == 1:
            return [self.store(statement.targets[0], value, statement)]
        self.locals["_viper_v"] = value.kind
        first = ast.Assign([ast.Name("_viper_v", ast.Store())], value.node)
        copy = Value(name("_viper_v"), value.kind, value.range)
        return [first] + [self.store(target, copy, statement) for target in statement.targets]

    def do_AnnAssign(self, statement):
        if statement.value is None:
            return []
        return [self.store(statement.target, self.expr(statement.value), statement)]

    def unpack(self, target, source):
        """`a, b = c, d` and its form with three keep native types; every other one goes through
        objects.
        """
        pairs = (
            isinstance(source, ast.Tuple)
            and len(source.elts) == len(target.elts)
            and len(target.elts) in (2, 3)
        )
        if not pairs:
            value = self.expr(source)
            if value.kind != OBJECT:
                self.refuse(source, "can't unpack '%s'" % value.kind)
            names = [ast.Name("_viper_v%d" % i, ast.Store()) for i in range(len(target.elts))]
            assign = ast.Assign([ast.Tuple(names, ast.Store())], value.node)
            values = [Value(name(n.id), OBJECT) for n in names]
        else:
            values = [self.expr(element) for element in source.elts]
            names = [ast.Name("_viper_v%d" % i, ast.Store()) for i in range(len(values))]
            assign = ast.Assign(
                [ast.Tuple(names, ast.Store())], ast.Tuple([v.node for v in values], ast.Load())
            )
            values = [Value(name(n.id), v.kind, v.range) for n, v in zip(names, values)]
        return [assign] + [self.store(t, v, source) for t, v in zip(target.elts, values)]

    def do_AugAssign(self, statement):
        target = statement.target
        before = []
        if isinstance(target, ast.Subscript) and not isinstance(
            target.slice, (ast.Constant, ast.Name)
        ):
            index = self.expr(target.slice)
            before = [self.store(ast.Name("_viper_i", ast.Store()), index, statement)]
            self.local_names.add("_viper_i")
            target = ast.Subscript(
                target.value, ast.copy_location(name("_viper_i"), target), ast.Store()
            )
        load = ast.copy_location(type(target)(**{**vars(target), "ctx": ast.Load()}), statement)
        operation = ast.copy_location(ast.BinOp(load, statement.op, statement.value), statement)
        return [*before, self.store(target, self.expr(operation), statement)]

    def store(self, target, value, source):
        """Assign a translated value to a name, an element or an attribute."""
        if isinstance(target, ast.Name):
            return self.store_name(target.id, value, source)
        if isinstance(target, ast.Attribute):
            base = self.expr(target.value)
            if base.kind != OBJECT or value.kind in POINTERS:
                self.refuse(
                    source, "can't store '%s' in an attribute of '%s'" % (value.kind, base.kind)
                )
            return ast.Assign([ast.Attribute(base.node, target.attr, ast.Store())], value.node)
        if isinstance(target, ast.Subscript):
            return self.store_element(target, value, source)
        self.refuse(source, "can't assign")

    def store_name(self, identifier, value, source):
        if identifier in self.local_names or identifier.startswith("_viper_"):
            known = self.locals.setdefault(identifier, value.kind)
            if known != value.kind and not identifier.startswith("_viper_"):
                text = "local '%s' has type '%s' but source is '%s'" % (
                    identifier,
                    known,
                    value.kind,
                )
                self.refuse(source, text)
            self.locals[identifier] = value.kind
            self.grow(identifier, value)
        return ast.Assign([ast.Name(identifier, ast.Store())], value.node)

    def grow(self, identifier, value):
        if value.kind in NUMBERS:
            wider = union(self.ranges.get(identifier), value.range)
            if self.widen and wider != self.ranges.get(identifier):
                wider = LIMITS[value.kind]
            self.ranges[identifier] = wider

    def store_element(self, target, value, source):
        base = self.expr(target.value)
        if base.kind not in POINTERS:
            if base.kind != OBJECT:
                self.refuse(source, "can't store to '%s'" % base.kind)
            element = ast.Subscript(base.node, self.object(target.slice), ast.Store())
            return ast.Assign([element], value.node)
        if value.kind not in (INT, UINT, BOOL):
            self.refuse(source, "can't store '%s'" % value.kind)
        element = ast.Subscript(base.node, self.index(target.slice), ast.Store())
        return ast.Assign([element], self.narrowed(base.kind, value, source))

    def narrowed(self, pointer, value, source):
        """What is stored: the low bits; a value that they cannot stand for raises."""
        if value.kind == BOOL:
            return value.node
        if pointer == "ptr32":
            return self.reinterpret(value, INT).node
        low, high, mask = _STORES[pointer]
        node = value.node
        if not within(value.range, (low, high)):
            text = "store of %s" % ast.unparse(source)
            failure = call(
                "_viper_overflow",
                name("_viper_t"),
                self.title,
                source.lineno,
                text,
                call("locals"),
            )
            node = guarded(node, (low, high), value.range, failure)
        if value.range is None or value.range[0] < 0:
            node = ast.BinOp(node, ast.BitAnd(), ast.Constant(mask))
        return node

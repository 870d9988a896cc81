# SPDX-License-Identifier: MIT
"""Statements of the checked viper: translates one function definition into plain Python with the
checks in it.
"""

import ast

from .consts import fold
from .stores import Stores
from .values import BOOL, INT, LIMITS, NONE, OBJECT, POINTERS, UINT, Value, call, name

_FORBIDDEN = (
    ast.Yield, ast.YieldFrom, ast.Await, ast.Lambda, ast.ListComp, ast.DictComp, ast.SetComp,
    ast.GeneratorExp, ast.FunctionDef, ast.ClassDef, ast.NamedExpr, ast.Starred,
)  # fmt: skip
_PASSES = 6  # after so many the intervals still growing are taken for the whole type


class Function(Stores):
    """One viper function: `translate()` gives its checked twin as a FunctionDef without
    decorators.
    """

    def __init__(self, definition, constants, title):
        self.definition = definition
        self.constants = constants
        self.title = title
        self.ranges = {}
        self.widen = False

    def translate(self):
        self.check_form()
        for turn in range(_PASSES + 40):
            self.widen = turn >= _PASSES
            before = dict(self.ranges)
            body = self.one_pass()
            if before == self.ranges:
                return ast.fix_missing_locations(body)
        raise AssertionError("intervals do not settle")

    def check_form(self):
        args = self.definition.args
        if args.vararg or args.kwarg or args.kwonlyargs or args.defaults:
            self.refuse(
                self.definition.args.args[0], "viper takes positional arguments without defaults"
            )
        for statement in self.definition.body:
            for node in ast.walk(statement):
                if isinstance(node, _FORBIDDEN):
                    self.refuse(node, "not supported in viper")

    def one_pass(self):
        self.locals = {}
        self.local_names = self.find_locals()
        arguments = self.definition.args.args
        body = [check for argument in arguments for check in self.argument(argument)]
        self.returns = self.annotation(self.definition.returns)
        body += self.block(self.definition.body)
        body.append(ast.Return(ast.Constant(self.default_return())))
        plain = ast.arguments([], [ast.arg(a.arg) for a in arguments], None, [], [], None, [])
        function = ast.FunctionDef(self.definition.name, plain, body, [])
        return ast.copy_location(function, self.definition)

    def find_locals(self):
        stored = {argument.arg for argument in self.definition.args.args}
        shared = set()
        for node in ast.walk(self.definition):
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
                stored.add(node.id)
            elif isinstance(node, ast.ExceptHandler) and node.name:
                stored.add(node.name)
            elif isinstance(node, (ast.Global, ast.Nonlocal)):
                shared.update(node.names)
        return stored - shared - set(self.constants)

    def annotation(self, node):
        if node is None:
            return OBJECT
        known = (OBJECT, BOOL, INT, UINT, *POINTERS)
        if not isinstance(node, ast.Name) or node.id not in known:
            self.refuse(node, "unknown type")
        return node.id

    def argument(self, argument):
        """Conversion of one argument from its object, as code at the start of the function."""
        kind = self.locals[argument.arg] = self.annotation(argument.annotation)
        target = ast.Name(argument.arg, ast.Store())
        if kind == OBJECT:
            return []
        value = name(argument.arg)
        if kind == BOOL:
            return [ast.Assign([target], call("bool", value))]
        if kind in POINTERS:
            return [ast.Assign([target], call("_viper_pointer", value, kind, self.title))]
        limits = self.ranges[argument.arg] = LIMITS[kind]
        line, text = argument.lineno, "argument " + argument.arg
        failure = call("_viper_number", value, kind, self.title, line, text)
        is_int = ast.Compare(
            ast.Attribute(value, "__class__", ast.Load()), [ast.Is()], [name("int")]
        )
        low, high = (ast.Constant(limit) for limit in limits)
        fits = ast.Compare(low, [ast.LtE(), ast.LtE()], [value, high])
        bad = ast.UnaryOp(ast.Not(), ast.BoolOp(ast.And(), [is_int, fits]))
        return [ast.If(bad, [ast.Assign([target], failure)], [])]

    def default_return(self):
        return {OBJECT: None, BOOL: False}.get(self.returns, 0)

    def block(self, statements):
        result = []
        for statement in statements:
            method = getattr(self, "do_" + type(statement).__name__, None)
            if method is None:
                self.refuse(statement, "not supported in viper")
            for new in method(statement):
                result.append(ast.copy_location(new, statement))
        return result or [ast.Pass()]

    def keep(self, statement):
        return [statement]

    do_Pass = do_Break = do_Continue = do_Global = do_Nonlocal = do_Import = do_ImportFrom = keep

    def do_Expr(self, statement):
        if isinstance(statement.value, ast.Constant):
            return []
        return [ast.Expr(self.expr(statement.value).node)]

    def do_If(self, statement):
        test = self.condition(statement.test)
        body, orelse = self.block(statement.body), statement.orelse
        return [ast.If(test, body, self.block(orelse) if orelse else [])]

    def do_While(self, statement):
        test = self.condition(statement.test)
        body, orelse = self.block(statement.body), statement.orelse
        return [ast.While(test, body, self.block(orelse) if orelse else [])]

    def do_For(self, statement):
        values, iterator = self.range_call(statement.iter)
        if values is None:
            value = self.expr(statement.iter)
            if value.kind != OBJECT or not isinstance(statement.target, ast.Name):
                self.refuse(statement, "can't iterate over '%s'" % value.kind)
            iterator, item = value.node, Value(None, OBJECT)
        else:
            item = self.range_item(statement, values)
        self.store_name(statement.target.id, item, statement)
        target = ast.Name(statement.target.id, ast.Store())
        body, orelse = self.block(statement.body), statement.orelse
        return [ast.For(target, iterator, body, self.block(orelse) if orelse else [])]

    def range_call(self, node):
        is_range = (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id == "range"
        )
        if not is_range or "range" in self.local_names or node.keywords:
            return None, None
        if len(node.args) == 3 and fold(node.args[2], self.constants) in (None, 0):
            self.refuse(node, "the step of a range must be a constant")
        values = [self.expr(argument) for argument in node.args]
        return values, ast.copy_location(
            ast.Call(name("range"), [v.node for v in values], []), node
        )

    def range_item(self, statement, values):
        zero, one = Value(None, INT, (0, 0)), Value(None, INT, (1, 1))
        start, stop = (zero, values[0]) if len(values) == 1 else values[:2]
        step = values[2] if len(values) == 3 else one
        if start.kind != INT or stop.kind != INT:
            self.refuse(statement, "a range of '%s' and '%s'" % (start.kind, stop.kind))
        if start.range is None or stop.range is None:
            return Value(None, INT, None)
        if step.range[0] > 0:
            return Value(None, INT, (start.range[0], max(start.range[0], stop.range[1] - 1)))
        return Value(None, INT, (min(start.range[1], stop.range[0] + 1), start.range[1]))

    def do_Return(self, statement):
        if statement.value is None:
            return [ast.Return(ast.Constant(self.default_return()))]
        value = self.expr(statement.value)
        if value.kind == NONE:
            return [ast.Return(ast.Constant(self.default_return()))]
        if value.kind != self.returns or value.kind in POINTERS:
            self.refuse(
                statement, "return expected '%s' but got '%s'" % (self.returns, value.kind)
            )
        return [ast.Return(value.node)]

    def do_Raise(self, statement):
        value = statement.exc and self.expr(statement.exc)
        if value and value.kind != OBJECT:
            self.refuse(statement, "must raise an object")
        return [ast.Raise(value and value.node, None)]

    def do_Assert(self, statement):
        message = statement.msg and self.object(statement.msg)
        return [ast.Assert(self.condition(statement.test), message)]

    def do_Try(self, statement):
        body = self.block(statement.body)
        handlers = []
        for handler in statement.handlers:
            if handler.name:
                self.store_name(handler.name, Value(None, OBJECT), handler)
            kind = handler.type and self.object(handler.type)
            handlers.append(ast.ExceptHandler(kind, handler.name, self.block(handler.body)))
        orelse = self.block(statement.orelse) if statement.orelse else []
        final = self.block(statement.finalbody) if statement.finalbody else []
        return [ast.Try(body, handlers, orelse, final)]

# SPDX-License-Identifier: MIT
"""The checks that interval analysis leaves out are never needed: random programs against an
interpreter that checks every single operation.
"""

import ast
import operator
import random

import pytest

from host_tests.virtual.viper_snippets import define
from tools.virtual.viper.ranges import INT_RANGE, UINT_RANGE, divides_safely, result_range

_OPERATORS = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "//": operator.floordiv,
    "%": operator.mod, "&": operator.and_, "|": operator.or_, "^": operator.xor,
    "<<": operator.lshift, ">>": operator.rshift,
}  # fmt: skip
_NODES = {
    "+": ast.Add, "-": ast.Sub, "*": ast.Mult, "//": ast.FloorDiv, "%": ast.Mod, "&": ast.BitAnd,
    "|": ast.BitOr, "^": ast.BitXor, "<<": ast.LShift, ">>": ast.RShift,
}  # fmt: skip
_VALUES = [0, 1, -1, 3, -7, 255, 4096, 32767, -32768, 65535, 2**24, 2**30, -(2**31), 2**31 - 1]


class Trouble(Exception):
    """An operation that the board would do wrong."""


def _apply(symbol, a, b, limits):
    if symbol in ("<<", ">>") and not 0 <= b <= 31:
        raise Trouble
    if symbol in ("//", "%") and b == 0:
        raise Trouble
    if symbol == "//" and _board_division(a, b) != a // b:
        raise Trouble
    value = _OPERATORS[symbol](a, b)
    if not limits[0] <= value <= limits[1]:
        raise Trouble
    return value


def _board_division(a, b):
    """mp_small_int_floor_divide in 32 bits."""
    if (a >= 0) != (b >= 0):
        a += -b - 1 if a >= 0 else -b + 1
        a = ((a + 2**31) % 2**32) - 2**31
    quotient = abs(a) // abs(b) * (1 if (a < 0) == (b < 0) else -1)
    return ((quotient + 2**31) % 2**32) - 2**31


def _random_expression(rng, depth, names):
    """(text, function of the variables that evaluates it with every check)."""
    if depth == 0 or rng.random() < 0.15:
        if rng.random() < 0.5:
            value = rng.choice([v for v in _VALUES if -(2**30) <= v < 2**30])
            return "(%d)" % value, lambda variables: value
        name = rng.choice(names)
        return name, lambda variables: variables[name]
    symbol = rng.choice(list(_OPERATORS))
    left_text, left = _random_expression(rng, depth - 1, names)
    right_text, right = _random_expression(rng, depth - 1, names)
    if symbol in ("<<", ">>") and rng.random() < 0.8:
        count = rng.randrange(20)
        right_text, right = str(count), lambda variables: count
    folded = _folded(left_text, right_text)

    def evaluate(variables):
        limits = (-(2**200), 2**200) if folded else INT_RANGE
        return _apply(symbol, left(variables), right(variables), limits)

    return "(%s %s %s)" % (left_text, symbol, right_text), evaluate


def _folded(*texts):
    """True for what the compiler folds; such an operand is kept out of the programs."""
    return not any(letter.isalpha() for text in texts for letter in text)


def _random_program(rng):
    """A function of a and b with locals x and y, and a loop that changes x."""
    steps, lines = [], []
    names = ["a", "b"]
    for target in ("x", "y", "x", "y"):
        while True:
            text, evaluate = _random_expression(rng, rng.randrange(1, 4), names)
            if not _has_constant_part(text):
                break
        lines.append("%s = %s" % (target, text))
        steps.append((target, evaluate))
        names = names if target in names else [*names, target]
    body = "\n".join("        " + line for line in lines[2:])
    source = "def f(a: int, b: int) -> int:\n    %s\n    %s\n    for i in range(3):\n%s\n" % (
        lines[0], lines[1], body,
    )  # fmt: skip
    return source + "    return x ^ y\n", steps


def _has_constant_part(text):
    tree = ast.parse(text, mode="eval")
    for node in ast.walk(tree):
        if isinstance(node, ast.BinOp) and _folded(ast.unparse(node)):
            return True
    return isinstance(tree.body, (ast.Constant, ast.UnaryOp))


def _reference(steps, a, b):
    variables = {"a": a, "b": b}
    for target, evaluate in steps[:2] + steps[2:] * 3:
        variables[target] = evaluate(variables)
    return variables["x"] ^ variables["y"]


@pytest.mark.parametrize("seed", range(60))
def test_random_programs(seed):
    rng = random.Random(seed)
    source, steps = _random_program(rng)
    function = define("random %d" % seed, source)
    for _ in range(60):
        a, b = rng.choice(_VALUES), rng.choice([*_VALUES, rng.randrange(-(2**31), 2**31)])
        try:
            expected = _reference(steps, a, b)
        except Trouble:
            with pytest.raises((OverflowError, ZeroDivisionError)):
                function(a, b)
            continue
        assert function(a, b) == expected, source


@pytest.mark.parametrize("symbol", _OPERATORS)
def test_an_interval_holds_every_result(symbol):
    rng = random.Random(symbol)
    for _ in range(300):
        spans = [tuple(sorted(rng.choice(_VALUES) for _ in range(2))) for _ in range(2)]
        found = result_range(_NODES[symbol](), *spans)
        for _ in range(10):
            a, b = (rng.randint(*span) for span in spans)
            if symbol in ("<<", ">>") and not 0 <= b <= 31:
                continue
            if symbol in ("//", "%") and b == 0:
                continue
            assert found[0] <= _OPERATORS[symbol](a, b) <= found[1]


def test_safe_divisions_are_those_that_the_board_does_right():
    for a in _VALUES:
        for b in _VALUES:
            if b:
                right = _board_division(a, b) == a // b
                assert divides_safely((a, a), (b, b)) <= right, (a, b)
    assert divides_safely((-(10**9), 10**9), (1, 10**9))
    assert not divides_safely(INT_RANGE, (7, 7))
    assert UINT_RANGE == (0, 2**32 - 1)

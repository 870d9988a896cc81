# SPDX-License-Identifier: MIT
"""Interval arithmetic for the checked viper: which results need no check because they cannot
overflow.
"""

import ast

INT_RANGE = (-(2**31), 2**31 - 1)
UINT_RANGE = (0, 2**32 - 1)


def union(a, b):
    """Smallest interval that holds both; None is the empty one."""
    if a is None or b is None:
        return a or b
    return min(a[0], b[0]), max(a[1], b[1])


def within(a, limits):
    """True when interval `a` lies inside `limits`; the empty one does."""
    return a is None or (limits[0] <= a[0] and a[1] <= limits[1])


def clip(a, limits):
    """Part of `a` inside `limits`: what is left after a check let it pass."""
    if a is None or a[1] < limits[0] or a[0] > limits[1]:
        return None
    return max(a[0], limits[0]), min(a[1], limits[1])


def _corners(function, a, b):
    values = [function(x, y) for x in a for y in b]
    return min(values), max(values)


def divides_safely(a, b):
    """True when the board's floor division of an `a` by a `b` is exact.

    mp_small_int_floor_divide adds the divisor less one to the dividend when the signs differ,
    and that sum wraps when the two are large; and the least int by -1 has no 32-bit result.
    """
    if a is None or b is None:
        return True
    down = b[0] >= 0 or a[1] < 0 or a[1] - b[0] - 1 <= INT_RANGE[1]
    up = a[0] >= 0 or b[1] < 0 or a[0] - b[1] + 1 >= INT_RANGE[0]
    return down and up and not (a[0] == INT_RANGE[0] and b[0] <= -1 <= b[1])


def _divide(a, b):
    if b[0] <= 0 <= b[1]:
        largest = max(abs(a[0]), abs(a[1]))
        return -largest, largest
    return _corners(lambda x, y: x // y, a, b)


def _modulo(a, b):
    low = min(b[0] + 1, 0)
    high = max(b[1] - 1, 0)
    if a[0] >= 0 and b[0] > 0:
        high = min(high, a[1])
    return low, high


def _shift(function):
    def shifted(a, b):
        b = clip(b, (0, 31))
        return b and _corners(function, a, b)

    return shifted


def _signed_bits(a, b):
    bits = max(value.bit_length() for value in (*a, *b))
    return (0 if a[0] >= 0 and b[0] >= 0 else -(1 << bits)), (1 << bits) - 1


def _and(a, b):
    tops = [x[1] for x in (a, b) if x[0] >= 0]
    return (0, min(tops)) if tops else _signed_bits(a, b)


_RULES = {
    ast.Add: lambda a, b: (a[0] + b[0], a[1] + b[1]),
    ast.Sub: lambda a, b: (a[0] - b[1], a[1] - b[0]),
    ast.Mult: lambda a, b: _corners(lambda x, y: x * y, a, b),
    ast.FloorDiv: _divide,
    ast.Mod: _modulo,
    ast.LShift: _shift(lambda x, y: x << y),
    ast.RShift: _shift(lambda x, y: x >> y),
    ast.BitAnd: _and,
    ast.BitOr: _signed_bits,
    ast.BitXor: _signed_bits,
}


def result_range(operator, a, b):
    """Interval of the exact result of `a operator b`; empty when an operand is empty."""
    if a is None or b is None:
        return None
    return _RULES[type(operator)](a, b)

# SPDX-License-Identifier: MIT
"""Viper functions and arguments for the proofs that the checked viper equals the board's, bit for
bit.
"""

import itertools
import linecache
import random

# values of the first and second argument; a grid's calls are their products
_EDGES = [0, 1, -1, 7, -32768, 65535, 2**30, 2**31 - 1, -(2**31)]
_SECOND = [1, -1, 7, -2, 31, 65535, 2**31 - 1, -(2**31)]
_rng = random.Random(12)
_WIDE = [_rng.randrange(-(2**31), 2**31) for _ in range(4)]
_PAIRS = (_EDGES + _WIDE, _SECOND)
_SHIFTS = (_EDGES + _WIDE, [0, 1, 5, 15, 30, 31])
_UNSIGNED = tuple([value & 0xFFFFFFFF for value in column] for column in _PAIRS)
_SINGLE = (_EDGES + _WIDE, [0])
_HALVES = ([a >> 1 for a in _PAIRS[0]], [b >> 1 for b in _PAIRS[1]])
_SMALL_GAINS = (_HALVES[0], [b >> 17 for b in _PAIRS[1]])

# name: (source of the function, grid) or (source, rows of literal arguments)


def _binary(operator, kind="int"):
    return "def f(a: %s, b: %s) -> %s:\n    return a %s b\n" % (kind, kind, kind, operator)


def _compare(operator, kind="int"):
    return "def f(a: %s, b: %s) -> bool:\n    return a %s b\n" % (kind, kind, operator)


SNIPPETS = {
    "add": (_binary("+"), _PAIRS),
    "subtract": (_binary("-"), _PAIRS),
    "multiply": (_binary("*"), _PAIRS),
    "floor_divide": (_binary("//"), _PAIRS),
    "modulo": (_binary("%"), _PAIRS),
    "and": (_binary("&"), _PAIRS),
    "or": (_binary("|"), _PAIRS),
    "xor": (_binary("^"), _PAIRS),
    "shift_left": (_binary("<<"), _SHIFTS),
    "shift_right": (_binary(">>"), _SHIFTS),
    "less": (_compare("<"), _PAIRS),
    "greater_equal": (_compare(">="), _PAIRS),
    "uint_add": (_binary("+", "uint"), _UNSIGNED),
    "uint_shift_right": (
        "def f(a: uint, b: uint) -> uint:\n    return a >> (b & 31)\n",
        _UNSIGNED,
    ),
    "uint_less": (_compare("<", "uint"), _UNSIGNED),
    "uint_multiply_high_masked": (
        "def f(a: uint, b: uint) -> uint:\n    return (a & 0xFFFF) * (b & 0xFFFF) >> 16\n",
        _UNSIGNED,
    ),
    "reinterpret": (
        "def f(a: int, b: int) -> int:\n    return int(uint(a) >> 4) ^ int(uint(b) & -16)\n",
        _PAIRS,
    ),
    "negate_invert": ("def f(a: int, b: int) -> int:\n    return -(~(a >> 1)) ^ +a\n", _SINGLE),
    "mixed_types": (
        "def f(a: int, b: int) -> int:\n    u = uint(b)\n    return (a ^ u) & ~1 | u >> 31\n",
        _PAIRS,
    ),
    "bool_to_int": (
        "def f(a: int, b: int) -> int:\n    return int(a < b) * 2 + int(not_equal(a, b))\n\n"
        "def not_equal(a, b):\n    return a != b\n",
        _PAIRS,
    ),
    "wide_literal": (
        "def f(a: int, b: int) -> int:\n"
        "    return (a & int(0x80000000)) | (b & int(0xFFFF0000))\n",
        _PAIRS,
    ),
    "constants": (
        "_N = const(3)\n_M = const(1 << _N)\ndef f(a: int, b: int) -> int:\n"
        "    return (a >> _N) * _M + (a & (_M - 1))\n",
        _SINGLE,
    ),
    "branches": (
        "def f(a: int, b: int) -> int:\n    x = 0\n    if a > b and not a == 7 or b == 31:\n"
        "        x = a >> 1\n    elif a:\n        x = 5 if b < 0 else 6\n    else:\n"
        "        x = -1\n"
        "    return x\n",
        _PAIRS,
    ),
    "loops": (
        "def f(n: int, step: int) -> int:\n    s = 0\n    for i in range(n):\n        if i == 7:\n"
        "            continue\n        s += i * step\n    for i in range(20, 0, -3):\n"
        "        s ^= i\n    while n:\n        n -= 1\n        if n == 2:\n            break\n"
        "        s = s * 3 % 1009\n    return s\n",
        [(n, s) for n in (0, 1, 2, 5, 9, 30) for s in (1, -3, 1000)],
    ),
    "swap": (
        "def f(a: int, b: int) -> int:\n    a, b = b, a\n    c = d = a\n"
        "    return (c ^ b) + (d & 1)\n",
        _HALVES,
    ),
    "returns_nothing": ("def f(a: int) -> int:\n    if a > 3:\n        return a\n", [(1,), (9,)]),
    "five_arguments": (
        "def f(a: int, b: int, c: int, d: int, e: int) -> int:\n    return a - b + c - d + e\n",
        [(1, 2, 3, 4, 5), (-9, 8, -7, 6, -5)],
    ),
    "objects": (
        "def f(a: int, text) -> int:\n    return a + int(len(text)) + int(text[0] + text[1])\n",
        [(3, b"ab"), (-100, b"\xff\x01")],
    ),
    "ptr8": (
        "def f(p: ptr8, i: int) -> int:\n    p[i] = p[0] + p[i]\n    p[3] = -2\n"
        "    return p[i] << 8 | p[3]\n",
        [(bytearray(range(100, 108)), i) for i in range(8)],
    ),
    "ptr16": (
        "def f(p: ptr16, i: int) -> int:\n    x = p[i]\n    if x > 32767:\n        x -= 65536\n"
        "    p[0] = x >> 1\n    p[i] += 0\n    return p[0] * 7 + x\n",
        [("array('h', (-32768, -1, 0, 1, 32767))", i) for i in range(5)],
    ),
    "ptr32": (
        "def f(p: ptr32, i: int) -> int:\n    p[0] = uint(p[i]) >> 1\n    return p[i] ^ p[0]\n",
        [("array('i', (5, -1, -2147483648, 2147483647))", i) for i in range(4)],
    ),
    "ptr_recast": (
        "def f(p: ptr32, i: int) -> int:\n    b = ptr8(p)\n    h = ptr16(p)\n"
        "    return b[i] | h[i] << 8\n",
        [("array('i', (-559038737, 19088743))", i) for i in range(4)],
    ),
    "ptr_further_on": (
        "def f(p: ptr32, i: int) -> int:\n    at = 1\n    if i:\n        at = i\n"
        "    q = ptr32(int(p) + 8)\n    q[0] = at - 7\n    return q[1] ^ p[3] * 5\n",
        [("array('i', (5, -1, 9, 11, -8))", i) for i in range(2)],
    ),
    "signed_product": (
        "def f(a: int, b: int) -> int:\n    return (a >> 15) * b + (((a & 0x7FFF) * b) >> 15)\n",
        _SMALL_GAINS,
    ),
}


def is_grid(arguments):
    return isinstance(arguments, tuple)


def rows(arguments):
    """All calls of a snippet, in the order in which the board makes them."""
    return list(itertools.product(*arguments)) if is_grid(arguments) else arguments


def prepare(arguments):
    """Make fresh arguments from a row: text stands for an array."""
    from array import array

    made = []
    for argument in arguments:
        if isinstance(argument, str):
            argument = eval(argument, {"array": array})
        elif isinstance(argument, bytearray):
            argument = bytearray(argument)
        made.append(argument)
    return made


def define(name, source):
    """Define a snippet under the checked viper; its source is where the decorator looks for it."""
    from micropython import const, viper

    before, at, after = source.partition("def f(")
    text = before + "@viper\n" + at + after
    filename = "<snippet %s>" % name
    linecache.cache[filename] = (len(text), None, text.splitlines(True), filename)
    space = {"viper": viper, "const": const}
    exec(compile(text, filename, "exec"), space)
    return space["f"]

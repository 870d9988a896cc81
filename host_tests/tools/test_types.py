# SPDX-License-Identifier: MIT
"""lib/ and firmware/ pass a type check against the stubs of both ports."""

import pytest

from tools import typecheck


@pytest.mark.parametrize("port", typecheck.PORTS)
def test_board_code_type_checks(port):
    assert typecheck.check(port) == []


@pytest.mark.parametrize("port", typecheck.PORTS)
def test_the_check_sees_a_wrong_call(port, tmp_path):
    wrong = tmp_path / "wrong.py"
    wrong.write_text("from machine import Pin\nPin(3).value('high', 1, 2)\nx: int = 'a'\n")
    complaints = typecheck.check(port, [wrong])
    assert any("wrong.py:2" in line for line in complaints), complaints
    assert any("wrong.py:3" in line for line in complaints), complaints

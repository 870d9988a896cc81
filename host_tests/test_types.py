# SPDX-License-Identifier: MIT
"""lib/ and firmware/ pass a type check against the stubs of both ports."""

import pytest

from tools import typecheck


@pytest.mark.parametrize("port", typecheck.PORTS)
def test_board_code_type_checks(port):
    assert typecheck.check(port) == []

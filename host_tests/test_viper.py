# SPDX-License-Identifier: MIT
"""The checked viper: loud where the board is silent, refusing what the board refuses, equal elsewhere."""

from array import array

import pytest
from micropython import const, viper

from tools.virtual.port import ViperTypeError

_SHIFT = const(15)


@viper
def product(a: int, b: int) -> int:
    return (a >> _SHIFT) * b + (((a & 0x7FFF) * b) >> _SHIFT)


@viper
def add(a: int, b: int) -> int:
    return a + b


def test_values_pass_and_overflow_names_function_line_and_operands():
    assert product(1 << 28, 100) == (1 << 28) * 100 >> 15
    assert add(2**31 - 2, 1) == 2**31 - 1
    with pytest.raises(
        OverflowError, match=r"add, line 22: a \+ b gives 2147483648 \(a=2147483647, b=1\)"
    ):
        add(2**31 - 1, 1)


def test_ptr16_loads_unsigned():
    @viper
    def load(p: ptr16) -> int:  # noqa: F821
        return p[0]

    assert load(array("h", [-2])) == 65534


def test_refused_like_the_compiler():
    with pytest.raises(ViperTypeError, match="int"):

        @viper
        def mixed(a: int, b):
            return a + b

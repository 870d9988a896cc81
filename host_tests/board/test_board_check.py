# SPDX-License-Identifier: MIT
"""The check of a board, on the emulated one."""

from tools import board_check


def test_the_emulated_pico_has_nothing_to_complain_of():
    text, good = board_check.report(board_check.run_emulated(seconds=0.4))
    assert good, text
    assert "(hard)" in text and "self-test: passed" in text and " 0 of 100 failed" in text

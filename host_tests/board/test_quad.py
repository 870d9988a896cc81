# SPDX-License-Identifier: MIT
"""The quadcopter whole in the tick of the emulated RP2040 (more: python -m tools.loop.quad)."""

from tools.loop.quad import good, measure


def test_an_armed_quad_at_1_khz_loses_no_tick_while_the_foreground_collects():
    row = measure(200)
    print(row)
    assert row["collections"] >= 3 and row["expected"] >= 190
    assert good(row)

# SPDX-License-Identifier: MIT
"""The hard tick on real MicroPython at 1 kHz, and what people do beside it: all in turn, then at
random. `python -m tools.loop --upsets 10` plays them for longer."""

import random

import pytest

from tools.loop.upsets import COSTS, UPSETS, Upsetting, at_random, faults


@pytest.fixture(scope="module")
def rig():
    with Upsetting("1.26.1", 1000) as board:
        yield board


@pytest.mark.parametrize("upset", UPSETS)
def test_an_upset_reaches_neither_the_grid_nor_the_tick(rig, upset):
    for _ in range(8 if upset == "recursion" else 2):
        seen = rig.play(upset, random.Random(4))
        assert faults(seen) == []
        assert upset == "soft reset" or seen.ticks > 5
        assert upset in COSTS or seen.ticks == seen.expected


def test_a_second_of_them_at_random():
    found = at_random(1.0, seed=3)
    assert [faults(seen) for seen in found if faults(seen)] == []
    assert len({seen.upset for seen in found}) > 5

# SPDX-License-Identifier: MIT
"""The bars of the integer pipeline, measured on the emulated RP2040 at 125 MHz."""

import pytest

from tools import bench

# us, re-typed: an update or a step takes at most this, on average over its blocks
BARS_US = {
    "fixed.kalman2.update": 25,
    "fixed.attitude.update": 90,
    "step.kalman2": 520,
    "step.attitude": 590,
    "split.kalman2": 75,
    "split.attitude": 150,
}
NAMES = {*BARS_US, "bus.read14", "float.kalman.update", "float.attitude.update"}


@pytest.fixture(scope="module")
def result():
    return bench.parse(bench.run_emulated())


def test_every_row_is_there(result):
    assert {row["name"] for row in result["rows"]} == NAMES
    assert "RP2040" in result["board"]
    assert result["mhz"] == 125
    bus = next(row for row in result["rows"] if row["name"] == "bus.read14")
    assert 390 < bus["us"] < 460  # 17 bytes of 9 bits at 400 kHz are 383 us


@pytest.mark.parametrize("name", BARS_US)
def test_a_stage_keeps_its_bar_and_off_the_heap(result, name):
    row = next(row for row in result["rows"] if row["name"] == name)
    assert 10 < row["us"] < BARS_US[name]
    assert row["bytes"] == 0
    assert row["locked"]


def test_one_kilohertz_leaves_room_at_the_worst_tick(result):
    steps = [row for row in result["rows"] if row["name"].startswith(("step", "split"))]
    assert max(row["worst_us"] for row in steps) < 650


def test_float_filters_do_use_the_heap_so_the_measure_works(result):
    for row in result["rows"]:
        if row["name"].startswith("float"):
            assert row["bytes"] > 100
            assert not row["locked"]

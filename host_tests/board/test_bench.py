# SPDX-License-Identifier: MIT
"""The bars of the integer pipeline, measured on the emulated RP2040 at 125 MHz."""

import pytest

from tools import bench

# us, re-typed: an update or a step takes at most this, on average over its blocks
BARS_US = {
    "fixed.kalman2.step": 22,
    "fixed.kalman2.update": 32,
    "fixed.attitude.step": 61,
    "fixed.attitude.update": 71,
    "step.kalman2": 520,
    "step.attitude": 590,
    "split.kalman2": 80,
    "split.attitude": 150,
    "app.blocking": 650,
    "app.split": 128,
    "app.run": 165,
    "read.angles": 12,
}
NAMES = {*BARS_US, "bus.read14", "float.kalman.update", "float.attitude.update",
         "app.blocking.unchecked", "app.split.unchecked"}  # fmt: skip


@pytest.fixture(scope="module")
def result():
    return bench.parse(bench.run_emulated())


def test_every_row_is_there(result):
    assert {row["name"] for row in result["rows"]} == NAMES
    assert "RP2040" in result["board"]
    assert result["mhz"] == 125
    bus = next(row for row in result["rows"] if row["name"] == "bus.read14")
    assert 390 < bus["us"] < 480  # 17 bytes of 9 bits at 400 kHz are 383 us


@pytest.mark.parametrize("name", BARS_US)
def test_a_stage_keeps_its_bar_and_off_the_heap(result, name):
    row = next(row for row in result["rows"] if row["name"] == name)
    assert 5 < row["us"] < BARS_US[name]
    assert row["bytes"] == 0
    assert row["locked"]


def test_the_running_app_leaves_heap_for_the_users_program(result):
    assert result["heap"]["free"] > 50000
    assert result["heap"]["used"] + result["heap"]["free"] < 250000


def test_one_kilohertz_leaves_room_at_the_worst_tick(result):
    steps = [row for row in result["rows"] if row["name"].startswith(("step", "split"))]
    assert max(row["worst_us"] for row in steps) < 650


def test_float_filters_do_use_the_heap_so_the_measure_works(result):
    for row in result["rows"]:
        if row["name"].startswith("float"):
            assert row["bytes"] > 100
            assert not row["locked"]


def test_judging_a_burst_costs_at_most_five_percent_of_a_step(result):
    us, share = bench.checks(result)["blocking"]
    print(f"judging: {us:.1f} us a step, {share:.1f} %")
    assert 5 < us < 0.05 * 480  # what step.kalman2, the shortest, may take
    assert share < 5
    assert bench.checks(result)["split"][0] < 24  # the same work; the share is that of less


def test_the_app_leaves_most_of_the_processor_to_the_program_beside_it(result):
    assert result["left"]["250"] > 0.9
    assert result["left"]["1000"] > 0.7

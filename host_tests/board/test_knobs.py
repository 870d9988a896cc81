# SPDX-License-Identifier: MIT
"""Knobs in a fast turn on the emulated RP2040: what they cost in ticks, time and yaw."""

import ast
from math import cos, radians, sin

import pytest

from tools.loop.run import START, board_for

_SETTLE = """
time.sleep_ms(600)  # the turn begins within
def change(changes, pause_ms):
    rows = []
    for name, value in changes:
        lost, first = app.stats()["lost"], app.sample()
        began = time.ticks_us()
        app.set(name, value)
        while not app.fresh:
            pass
        took = time.ticks_diff(time.ticks_us(), began)
        lost = app.stats()["lost"] - lost
        time.sleep_ms(pause_ms)
        last = app.sample()
        us = time.ticks_diff(last.t_us, first.t_us)
        rows.append((name, took, lost, last.yaw_deg - first.yaw_deg, us, last.uncertain))
    return rows
"""


class Spin:
    """Still, and from begin_s on a turn about the vertical that swells within 50 ms."""

    duration_s = None

    def __init__(self, rate_dps, begin_s=0.75):
        self.rate_dps, self.begin_s = rate_dps, begin_s

    def at(self, t):
        share = min(max((t - self.begin_s) / 0.05, 0.0), 1.0)
        return (0.0, 0.0, 1.0, 0.0, 0.0, self.rate_dps * share, 25.0)

    def truth(self, t):
        since = max(t - self.begin_s, 0.0)
        turned = since**2 / 0.1 if since < 0.05 else since - 0.025
        half = radians(self.rate_dps * turned) / 2
        return (cos(half), 0.0, 0.0, sin(half))


def rows_of(rate_dps, changes, pause_ms):
    """(name, us of set() and until a good sample, ticks lost, degrees of yaw off) of each."""
    board, _ = board_for("1.26.1", Spin(rate_dps))
    with board:
        board.exec(START + _SETTLE, 60)
        out = board.exec("print('=', change(%r, %d))" % (changes, pause_ms), 120)
    found = []
    for name, took, lost, turned, us, doubt in ast.literal_eval(out.partition("=")[2].strip()):
        assert not doubt
        off = (turned - rate_dps * us * 1e-6 + 180) % 360 - 180
        print("%-20s %7d us %3d lost %+.3f deg" % (name, took, lost, off))
        found.append((name, took, lost, off))
    return found


def test_twelve_filter_knobs_at_200_dps_lose_no_tick_and_a_tenth_of_a_degree():
    changes = [(name, value) for value in (3.0, 2.0, 1.0, 1.5) for name in (
        "attitude_tau_s", "attitude_rest_tau_s", "attitude_bias_tau_s")]  # fmt: skip
    found = rows_of(200.0, changes, 12)
    assert len(found) == 12
    assert all(lost == 0 for _, _, lost, _ in found)
    assert max(abs(off) for *_, off in found) < 0.1


@pytest.mark.parametrize("rate_dps, changes", [
    (100.0, [("gyro_dps", 1000), ("dlpf_hz", 94), ("rate_hz", 500)]),
    (60.0, [("filter", "float.attitude"), ("filter", "attitude")]),
])  # fmt: skip
def test_set_up_knobs_and_another_filter_cost_100_ms_and_half_a_degree_each(rate_dps, changes):
    for _, took, _, off in rows_of(rate_dps, changes, 30):
        assert took < 100000 and abs(off) < 0.5

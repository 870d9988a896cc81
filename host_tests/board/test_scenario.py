# SPDX-License-Identifier: MIT
"""One scenario of faults on both sides: CPython's virtual board and the real firmware. The tick is
hard: a soft one waits for what mends the fault, and a lost tick counts none.
"""

import ast

from tools.faults.scenario import play
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import load_scenario
from tools.virtual.motion import FreeMotion
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040.flash import ROOT

FILE = ROOT / "tools" / "data" / "scenario.json"
UNTIL_MS = 6000


def test_both_sides_count_the_same_faults_and_recover():
    said = []
    here = play(load_scenario(FILE), "rp2 hard", say=said.append)
    bus = Bus(MPU6050Chip(FreeMotion(0, rest_s=2.0), seed=1), faults=load_scenario(FILE))
    with VirtualPico(bus=bus, root=True, main=False, micropython="1.26.1") as pico:
        pico.exec(
            "from firmware.app import App\napp = App()\napp.set('rest_s', 0.1)\napp.start()"
        )
        assert pico.nanos < 3.9e9  # before the first fault
        pico.run_ms(UNTIL_MS - pico.nanos / 1e6)
        there = ast.literal_eval(pico.exec("print(app.stats())"))
    print(here, there, *said, sep="\n")
    for cause in ("nack", "fill", "saturated", "register"):
        assert here[cause] > 0
        assert abs(here[cause] - there[cause]) <= 2  # where a tick meets a fault's edge
    for stats in (here, there):
        assert stats["tick"] == "hard" and stats["lost"] == 0
        assert not stats["stale"] and stats["errors"] == 0 and stats["age_ms"] <= 4
    assert here["uncaught"] == 0
    assert sum("stale" in line for line in said) >= 1 and said[-1].split()[2] == "good"

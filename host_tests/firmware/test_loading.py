# SPDX-License-Identifier: MIT
"""The code of a filter is loaded flat, and what of it nobody needs is forgotten."""

import importlib.machinery
import sys

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.motion import Still

FILTERS = ("attitude", "kalman2", "float.attitude", "float.kalman", "float.complementary")
WITHIN = "attitude.fixed.attitude."  # a package, whose files its own __init__ imports


@pytest.fixture
def fresh(monkeypatch):
    """As on a board that has just started: none of the filters' code is there."""
    for name in list(sys.modules):
        if name.split(".")[0] in ("attitude", "calibration", "mpu6050", "firmware"):
            monkeypatch.delitem(sys.modules, name)


@pytest.mark.parametrize("name", FILTERS)
def test_no_import_of_a_filters_code_is_within_another_one(name, fresh, monkeypatch):
    depth, nested = [], []
    execute = importlib.machinery.SourceFileLoader.exec_module

    def watched(self, module):
        if module.__name__.split(".")[0] == "attitude":
            if depth and not module.__name__.startswith(WITHIN):
                nested.append((depth[-1], module.__name__))
            depth.append(module.__name__)
        execute(self, module)
        if depth and depth[-1] == module.__name__:
            depth.pop()

    from firmware.loading import load

    loaded = {}
    monkeypatch.setattr(importlib.machinery.SourceFileLoader, "exec_module", watched)
    load(name, loaded, {})
    kind, of = loaded[name]
    assert kind.timed == name.startswith("float.")
    assert len(of) == (name in ("float.kalman", "float.complementary"))
    compiled = [("attitude.fixed", "attitude.fixed.compiler_check")]
    assert [pair for pair in nested if pair not in compiled] == []


@pytest.mark.parametrize("running", FILTERS)
def test_code_of_filters_that_nobody_runs_is_forgotten_and_found_again(running, tmp_path):
    with Rig(next(iter(BOARDS)), Still(), tmp_path) as rig:
        app = rig.app
        app.start()
        from firmware import filters
        from firmware.loading import PARTS

        for name in FILTERS:
            app.set("filter", name)
            app.set("filter", running)
        filters.forget_unused()
        for name in FILTERS:
            there = PARTS[name][-1] in sys.modules
            assert there == (name in ("attitude", running)), name
        for name in FILTERS:
            app.set("filter", name)
            rig.port.run_ms(50)
            assert app.running and not app.stale and app.config.filter == name
        app.stop()


def test_without_room_for_its_code_a_filter_is_refused_and_nothing_of_it_stays(
    tmp_path, monkeypatch
):
    with Rig(next(iter(BOARDS)), Still(), tmp_path) as rig:
        app = rig.app
        app.start()
        from firmware import filters

        was = app.filter
        monkeypatch.setattr(filters.gc, "mem_free", lambda: 8_000)
        for name in FILTERS[1:]:
            with pytest.raises(MemoryError, match=f"no room for {name} beside what is loaded"):
                app.set("filter", name)
            rig.port.run_ms(50)
            assert app.config.filter == "attitude" and app.filter is was
            assert app.running and not app.stale
        monkeypatch.undo()
        app.set("filter", "kalman2")
        app.stop()

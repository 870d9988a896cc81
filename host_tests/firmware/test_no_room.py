# SPDX-License-Identifier: MIT
"""A heap that has no room for another filter: the one that runs goes on."""

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.motion import Still

FILTERS = ("attitude", "kalman2", "float.attitude", "float.kalman", "float.complementary")


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("running", ["attitude", "kalman2", "float.kalman"])
def test_the_loop_goes_on_as_it_was(running, board, tmp_path, monkeypatch):
    with Rig(board, Still(), tmp_path) as rig:
        app = rig.app
        app.start()
        app.set("filter", running)
        rig.port.run_ms(300)
        from firmware import filters

        def full(*_):
            raise MemoryError

        was, ticks = app.filter, app.stats()["ticks"]
        with monkeypatch.context() as patch:
            patch.setattr(filters, "make", full)
            for knob, value in [("filter", name) for name in FILTERS] + [("rate_hz", 500)]:
                if value != running:
                    with pytest.raises(MemoryError):
                        app.set(knob, value)
                rig.port.run_ms(100)
                assert app.running and not app.stale and app.filter is was
                assert app.config.filter == running and app.config.rate_hz == 250
        assert app.stats()["ticks"] > ticks + 100
        app.set("rate_hz", 500)
        rig.port.run_ms(100)
        assert app.running and not app.stale
        app.stop()

# SPDX-License-Identifier: MIT
"""A heap that has no room for another filter: the one that runs goes on."""

import pytest

from firmware.filters import SETTINGS
from host_tests.firmware.test_gaps import BOARDS, SWING, Rig

KNOBS = [("filter", name) for name in SETTINGS] + [
    ("rate_hz", 500), ("gyro_dps", 2000), ("gyro_dps", 250), ("accel_g", 2), ("accel_g", 16),
    ("dlpf_hz", 260), ("dlpf_hz", 21), ("sensor_hz", 500), ("drive", "data-ready"),
]  # fmt: skip


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("running", ["attitude", "kalman2", "float.kalman"])
def test_the_loop_goes_on_as_it_was_and_so_do_the_sensors_ranges(
    running, board, tmp_path, monkeypatch
):
    with Rig(board, SWING, tmp_path, rest_s=0.1, filter=running) as rig:
        app = rig.app
        app.start()
        rig.port.run_ms(1500)
        from firmware import filters

        def full(*_):
            raise MemoryError

        was, ticks = app.filter, app.stats()["ticks"]
        with monkeypatch.context() as patch:
            patch.setattr(filters, "make", full)
            for knob, value in KNOBS:
                kept = getattr(app.config, knob)
                if value != kept:
                    with pytest.raises(MemoryError):
                        app.set(knob, value)
                assert getattr(app.config, knob) == kept
                for _ in range(20):
                    rig.port.run_ms(5)
                    assert app.running and not app.stale and app.filter is was
                    assert rig.roll_error() < 1.0, knob
        assert app.stats()["ticks"] > ticks + 100
        app.set("rate_hz", 500)
        rig.port.run_ms(100)
        assert app.running and not app.stale
        app.stop()

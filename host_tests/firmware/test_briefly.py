# SPDX-License-Identifier: MIT
"""What is wanted for a moment is loaded for it and forgotten, and found again the next time."""

import sys

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.motion import Still

BRIEF = {
    "calibration.fields", "calibration.rest", "firmware.beginning", "firmware.calibration",
    "firmware.chips", "firmware.first", "firmware.levelling", "firmware.loading",
    "firmware.pinouts", "firmware.report", "firmware.startup", "firmware.store", "firmware.texts",
    "mpu6050.selftest",
}  # fmt: skip
boards = pytest.mark.parametrize("board", BOARDS)


def kept():
    return BRIEF & set(sys.modules)


@boards
def test_nothing_of_a_start_a_file_or_a_text_stays(board, tmp_path, capsys):
    with Rig(board, Still(), tmp_path) as rig:
        app = rig.app
        for _ in range(2):
            app.start()
            rig.port.run_ms(100)
            assert kept() == set()
            app.save()
            app.show()
            app.help()
            app.report()
            app.self_test()
            app.level_here()
            with pytest.raises(ValueError, match="80 to 1000 Hz"):
                app.set("rate_hz", 1)
            with pytest.raises(ValueError, match="did you mean rate_hz"):
                app.set("rate", 1)
            app.stop()
            assert kept() == set()
        assert "rate of the loop" in capsys.readouterr().out


@boards
def test_what_somebody_else_has_loaded_stays_his(board, tmp_path):
    with Rig(board, Still(), tmp_path) as rig:
        from calibration.rest import NotStill

        rig.app.start()
        assert kept() == {"calibration.rest"}
        assert sys.modules["calibration.rest"].NotStill is NotStill


def test_a_module_that_fails_while_it_is_loaded_is_forgotten_too(tmp_path, monkeypatch):
    from firmware.briefly import Briefly

    house = tmp_path / "briefly_house"
    house.mkdir()
    (house / "__init__.py").write_text("")
    (house / "bad.py").write_text("import sys\nsys.modules[__name__] = sys\n1 // 0\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    for _ in range(2):
        with pytest.raises(ZeroDivisionError), Briefly("briefly_house.bad"):
            import briefly_house.bad  # noqa: F401
        assert "briefly_house.bad" not in sys.modules


@boards
def test_collections_are_frequent_only_while_what_stays_is_loaded(board, tmp_path, monkeypatch):
    with Rig(board, Still(), tmp_path) as rig:
        app, asked = rig.app, []
        app.start()
        rig.port.run_ms(100)
        from firmware import briefly

        class Collector:
            now = 12340  # somebody's own

            @classmethod
            def threshold(cls, *amount):
                if not amount:
                    return cls.now
                cls.now = amount[0]
                asked.append(cls.now)

        monkeypatch.setattr(briefly, "gc", Collector)
        verbs = app.stats, lambda: app.stream, lambda: app.set("filter", "kalman2")
        for verb in verbs:
            for first in (True, False):
                asked.clear()
                verb()
                often = first and (board == "hard" or verb is verbs[2])  # soft ticks would wait
                assert (min(asked, default=0) == 8192) is often
                assert Collector.now == 12340

# SPDX-License-Identifier: MIT
"""What is wanted for a moment is loaded for it and forgotten, and found again the next time."""

import sys

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.motion import Still

BRIEF = {
    "calibration.fields", "calibration.rest", "firmware.beginning", "firmware.calibration",
    "firmware.chips", "firmware.pinouts", "firmware.startup", "firmware.store", "firmware.texts",
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

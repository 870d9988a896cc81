# SPDX-License-Identifier: MIT
"""What the bench makes of a board's words."""

import json

import pytest

from tools import bench

PRINTED = """board Raspberry_Pi_Pico_with_RP2040 125
module mpu6050 42500 7984
empty 15.85
row bus.read14 441.6 449.1 0.0 1
row float.kalman.update 430.0 590.0 464.0 0
row step.attitude 500.0 541.0 0.0 1
row app.blocking 612.0 900.0 0.0 1
row app.blocking.unchecked 600.0 700.0 0.0 1
row app.split 150.0 300.0 0.0 1
row app.split.unchecked 120.0 200.0 0.0 1
left 250 0.925
heap 124000 73000
"""


@pytest.fixture()
def board(monkeypatch):
    monkeypatch.setattr(bench, "run_emulated", lambda: PRINTED)


def test_the_figures_are_kept_as_they_came(board, tmp_path):
    bench.main(["--json", str(tmp_path / "new" / "bench.json")])
    result = json.loads((tmp_path / "new" / "bench.json").read_text())
    assert result["board"] == "Raspberry Pi Pico with RP2040"
    assert result["mhz"] == 125
    read, kalman, step, *app = result["rows"]
    assert len(app) == 4
    assert result["left"] == {"250": 0.925}
    assert result["heap"] == {"used": 124000, "free": 73000}
    assert (read["name"], read["us"], read["bytes"]) == ("bus.read14", 441.6, 0.0)
    assert (kalman["us"], kalman["bytes"], kalman["locked"]) == (430.0, 464.0, False)
    assert step["worst_us"] == 541.0
    assert step["locked"] is True
    assert result["modules"] == [{"name": "mpu6050", "import_ms": 42.5, "ram_bytes": 7984}]


def test_the_table_shows_bars_and_margins(board, capsys):
    bench.main([])
    lines = capsys.readouterr().out.splitlines()
    words = [" ".join(line.split()) for line in lines]
    assert "step.attitude 500.0 541.0 650 0 may be locked" in words
    assert "step.attitude 12.5 % 25.0 % 50.0 %" in words
    assert "blocking 12.0 2.0 %" in words  # of 600 us
    assert "heap of the running app, copied: 124000 bytes; free: 73000" in words
    assert "split 30.0 25.0 %" in words
    assert any("float.kalman.update" in line and "is used" in line for line in lines)


def test_a_board_that_fails_is_named(monkeypatch):
    class Failed:
        returncode, stdout, stderr = 1, "", "no device found"

    monkeypatch.setattr(bench.subprocess, "run", lambda *args, **kwargs: Failed)
    with pytest.raises(SystemExit, match=r"(?s)ttyX.*no device found.*make deploy"):
        bench.main(["--port", "/dev/ttyX"])

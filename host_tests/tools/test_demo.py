# SPDX-License-Identifier: MIT
"""The demo: main.py's own code against the optical truth, its table and its picture."""

import io

import pytest

from tools.demo import __main__ as demo
from tools.demo.picture import draw


@pytest.fixture(scope="module")
def recorded():
    screen = io.StringIO()
    out = demo.run("rp2", demo.MOTION, 20.0, screen)
    out["printed"] = screen.getvalue()
    return out


def test_the_live_line_shows_angles_truth_and_progress(recorded):
    lines = [x for x in recorded["printed"].splitlines() if "roll_deg:" in x]
    assert len(lines) >= 2 and all("truth" in x and "[" in x for x in lines)
    assert recorded["printed"].startswith("# roll, pitch and yaw in degrees")


def test_the_app_beats_each_single_sensor_on_the_same_samples(recorded):
    errors = {
        name: demo.rms(demo.error_deg(up, recorded["up"]))
        for name, up in recorded["estimates"].items()
    }
    assert set(errors) == set(demo.FILTERS)
    assert errors["fixed.attitude"] < 0.7
    assert errors["fixed.attitude"] < errors["accelerometer alone"] / 2
    assert errors["fixed.attitude"] < errors["gyro integral"] / 2
    assert errors["fixed.attitude"] == pytest.approx(errors["attitude"], abs=0.05)


def test_the_loop_lost_nothing(recorded):
    stats = recorded["stats"]
    assert stats["lost"] == stats["overruns"] == stats["errors"] == 0
    assert 4900 <= len(recorded["t_s"]) <= 5200
    assert "overruns" in demo.timing(stats, "here")


def test_table_and_picture(recorded, tmp_path):
    table = demo.report(recorded, demo.MOTION)
    assert all(name in table for name in demo.FILTERS) and "main.py's own" in table
    draw(recorded, tmp_path / "new" / "demo.png")
    assert (tmp_path / "new" / "demo.png").read_bytes().startswith(b"\x89PNG")


def test_a_settings_file_is_what_the_board_reads(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "config.txt").write_bytes(demo.settings_file(rest_s=0.1, rate_hz=500))
    from firmware.config import Config

    config = Config()
    assert config.load() == []
    assert (config.rest_s, config.rate_hz) == (0.1, 500)

# SPDX-License-Identifier: MIT
"""The experiments' own figures, their measures by hand, the gallery; and Table I's bar."""

import json

import numpy as np
import pytest

from tools.experiments import __main__ as command
from tools.experiments import gallery, p000_filters, p001_imu, p002_step, record
from tools.experiments.outcome import Outcome, Picture
from tools.virtual.motion import Still


def test_a_record_is_what_the_sensor_says():
    rec = record.record(Still(10.0, -20.0), 50, 250, noise=False, gyro_bias_dps=(1.0, 0, 0))
    assert rec.counts.shape == (50, 7) and rec.t_s[1] == pytest.approx(0.004)
    assert rec.roll_deg == pytest.approx(10.0) and rec.pitch_deg == pytest.approx(-20.0)
    # +-8 g: 4096 LSB per g; +-500 deg/s: 65.5 LSB per deg/s
    assert rec.counts[-1][0] == pytest.approx(4096 * np.sin(np.radians(20)), abs=2)
    assert rec.counts[-1][4] == pytest.approx(65.5, abs=1)
    assert np.array(rec.roll_rows())[:, 0] == pytest.approx(10.0, abs=0.05)
    assert np.abs(rec.bias_corrected(50).gyro_dps).max() < 0.02
    assert rec.offset(50).gyro_bias_dps[0] == pytest.approx(1.0, abs=0.02)


def test_overshoot_rise_and_smoothness_by_hand():
    """A ramp of 20 degrees in 0.5 s with a peak of 22: 10 to 90 % takes 0.4 s."""
    angle = np.zeros(1500)
    angle[300:351] = np.linspace(0, 20, 51)
    angle[351:] = 20
    angle[360] = 22
    overshoot, rise, smoothness = p002_step.measure(angle)
    assert overshoot == pytest.approx(10)
    assert rise == pytest.approx(0.4, abs=1e-6)
    assert smoothness == pytest.approx(np.std(np.diff(angle)))


def test_table_1_ours_against_its_best_row():
    """Better than complementary alpha 0.95 in overshoot, rise time and smoothness at once."""
    runs = [p002_step.one(seed) for seed in range(4)]
    mean = {name: np.mean([r[name] for r in runs], axis=0) for name in runs[0]}
    best, truth = mean["complementary 0.95"], mean["truth"]
    for name in p002_step.OURS:
        assert (mean[name] < best).all(), name
        assert mean[name][0] < 2.0
        assert mean[name][1] == pytest.approx(truth[1], abs=0.002)
    # the paper's order of the accelerometer's share, and the moving average's own rise time
    shares = [mean[f"complementary {alpha}"][2] for alpha in (0.95, 0.5, 0.05)]
    assert shares == sorted(shares)
    assert mean["moving average"][1] == pytest.approx(0.42, abs=0.03)
    assert mean["kalman as printed"][0] > mean["kalman"][0]


def test_more_gyro_is_smoother_and_more_r_is_slower():
    """What paper 000's Figs. 3 and 9 show."""
    rec = p000_filters.raw_record(4)
    rows = rec.roll_rows()
    jitter = [np.std(np.diff(p000_filters.complementary(rows, rec.dt_s, p)))
              for p in (0.95, 0.5, 0.0)]
    assert jitter == sorted(jitter)
    jitter = [np.std(np.diff(p000_filters.single(rows, r=r))) for r in (40, 10, 2)]
    assert jitter == sorted(jitter)


def test_yaw_transfer_is_what_makes_the_gyro_sum_usable():
    rec = p001_imu.flight()
    columns = p001_imu.estimates(rec)
    truth = np.column_stack([rec.roll_deg, rec.pitch_deg])
    error = {name: record.rms(angles - truth) for name, angles in columns.items()}
    assert error["gyro sum"] > 10 > 10 * error["gyro sum, yaw transfer"] / 1.5
    assert error["attitude"] < error["blend 0.9996"] < error["accelerometer"]


def test_the_gallery_opens_from_a_file(tmp_path):
    outcome = Outcome("A <title>", "paper", header=("a", "b"), rows=[("x", 1.23456)])
    picture = Picture("p")
    picture.line([0, 1], [1, 2], "line", 0)
    assert picture.axes[0].get_xlabel() == "time (s)"
    picture.save(outcome, tmp_path, "one", "caption", ["angle (deg)"])
    gallery.write(tmp_path / "index.html", [outcome])
    page = (tmp_path / "index.html").read_text()
    assert 'src="one.png"' in page and (tmp_path / "one.png").stat().st_size > 1000
    assert "A &lt;title&gt;" in page and "1.23" in page and "http" not in page
    assert gallery.as_text(outcome).splitlines() == ["a     b", "x  1.23"]


def test_one_command_writes_pictures_page_and_results(tmp_path, capsys):
    out = tmp_path / "gallery"
    assert command.main(["--out", str(out), "--only", "p001_gps"]) == 0
    assert (out / "p001_gps.png").exists() and (out / "index.html").exists()
    assert json.loads((out / "results.json").read_text()) == {}
    assert "KalmanND" in capsys.readouterr().out

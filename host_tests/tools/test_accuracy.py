# SPDX-License-Identifier: MIT
"""Reading recordings, the error measure, and what the accuracy command writes."""

import json
import math

import numpy as np
import pytest
from scipy.io import savemat

from tools import recordings
from tools.accuracy import __main__ as accuracy
from tools.accuracy.filters import FILTERS


def quaternions(axis, degrees):
    """Rotations about one axis, (n x 4)."""
    half = np.radians(np.asarray(degrees, float)) / 2
    quat = np.zeros((len(half), 4))
    quat[:, 0] = np.cos(half)
    quat[:, 1 + axis] = np.sin(half)
    return quat


def small(n=400):
    """Turned about x from level to 40 degrees, two samples lost by the cameras."""
    angles = np.linspace(0, 40, n)
    quat = quaternions(0, angles)
    quat[5:7] = np.nan
    accel = np.stack([0 * angles, np.sin(np.radians(angles)), np.cos(np.radians(angles))], 1)
    gyro = np.zeros((n, 3))
    gyro[:, 0] = np.radians(40 / n * 100)
    return {"acc_m_s2": accel * 9.80665, "gyr_rad_s": gyro, "quat_wxyz": quat,
            "movement": np.arange(n) >= 3, "rate_hz": 100.0}


@pytest.fixture
def folder(tmp_path):
    np.savez(tmp_path / "b_turn.npz", **small())
    data = small(300)
    savemat(tmp_path / "a_turn.mat", {
        "imu_acc": data["acc_m_s2"], "imu_gyr": data["gyr_rad_s"], "imu_mag": data["acc_m_s2"],
        "opt_quat": data["quat_wxyz"], "movement": data["movement"][:, None],
        "sampling_rate": 100.0})
    return tmp_path


def test_both_formats(folder):
    paths = recordings.files(folder)
    assert [p.name for p in paths] == ["a_turn.mat", "b_turn.npz"]
    for path, n in zip(paths, (300, 400)):
        rec = recordings.load(path)
        assert (len(rec), rec.rate_hz, rec.name) == (n, 100.0, path.stem)
        assert rec.counted.sum() == n - 3 - 2
        roll, pitch = rec.roll_pitch_deg()
        assert roll[-1] == pytest.approx(40)
        assert pitch[-1] == pytest.approx(0, abs=1e-9)
        assert rec.gyro_dps[0, 0] == pytest.approx(40 / n * 100)


def test_true_up_has_the_sign_of_the_accelerometer_at_rest():
    up = recordings.up_from_quaternion(np.vstack([quaternions(0, [30]), quaternions(1, [30])]))
    assert up[0] == pytest.approx((0, 0.5, math.sqrt(0.75)))
    assert up[1] == pytest.approx((-0.5, 0, math.sqrt(0.75)))
    roll, pitch = recordings.roll_pitch_deg(up)
    assert roll == pytest.approx((30, 0))
    assert pitch == pytest.approx((0, 30))
    assert recordings.up_from_roll_pitch(roll, pitch) == pytest.approx(up)


def test_counts_are_the_chips(folder):
    """16.4 and 2048 LSB (PS-MPU-6000A), rounded, saturated, in register order."""
    rec = recordings.load(folder / "b_turn.npz")
    rec.accel_g[0] = (1.0, -2.5, 17.0)
    rec.gyro_dps[0] = (100.0, -50.0, -2100.0)
    counts = rec.counts()
    assert counts.dtype == np.int16
    assert counts[0].tolist() == [2048, -5120, 32767, -3920, 1640, -820, -32768]
    assert rec.counts(gyro_dps=250, accel_g=2)[0].tolist() == [
        16384, -32768, 32767, -3920, 13100, -6550, -32768]
    assert rec.samples()[0] == pytest.approx((100, -50, -32768 / 16.4, 1, -2.5, 32767 / 2048))


def test_error_is_the_angle_over_what_counts(folder):
    rec = recordings.load(folder / "b_turn.npz")
    up = rec.up.copy()
    up[np.isnan(up)] = 1.0
    assert rec.rmse_deg(up) == pytest.approx(0, abs=1e-6)
    tilted = recordings.up_from_quaternion(quaternions(0, np.linspace(0, 40, 400) + 2.0))
    tilted[:3] = (0, 0, -1)  # before the motion: does not count
    assert rec.error_deg(tilted)[10] == pytest.approx(2.0)
    assert rec.rmse_deg(tilted) == pytest.approx(2.0)


def test_what_is_missing_is_named(tmp_path):
    with pytest.raises(FileNotFoundError, match=str(tmp_path)):
        recordings.files(tmp_path)
    np.savez(tmp_path / "x.npz", rate_hz=1.0, acc_m_s2=np.zeros((2, 3)))
    with pytest.raises(ValueError, match="gyr_rad_s, quat_wxyz, movement"):
        recordings.load(tmp_path / "x.npz")
    with pytest.raises(SystemExit, match="nonsense"):
        accuracy.available(["nonsense"])


def test_excerpts_are_usable_and_small():
    paths = recordings.files()
    assert len(paths) >= 2
    assert sum(p.stat().st_size for p in paths) < 1_500_000
    for path in paths:
        rec = recordings.load(path)
        rest = rec.gyro_dps[: round(5 * rec.rate_hz)]
        assert rest.std(axis=0).max() < 0.5  # starts at rest
        assert 40 < rec.counted.sum() / rec.rate_hz < 70
    assert (paths[0].parent / "README.md").read_text().count("CC BY 4.0")


def test_a_cut_keeps_the_counts(tmp_path):
    source = recordings.files()[0]
    recordings.cut(source, tmp_path / "cut.npz", 10, 5)
    whole, piece = recordings.load(source), recordings.load(tmp_path / "cut.npz")
    first = round(10 * whole.rate_hz)
    assert np.array_equal(piece.counts(), whole.counts()[first : first + len(piece)])
    assert piece.error_deg(whole.up[first : first + len(piece)]).max() < 0.01


def test_command_writes_json_table_and_picture(folder, capsys):
    names = ["accelerometer", "kalman_tilt", "attitude", "fixed.attitude"]
    accuracy.main(["--data", str(folder), "--json", str(folder / "o" / "a.json"), "--out",
                   str(folder / "o" / "a.png"), "--filters", *names])
    data = json.loads((folder / "o" / "a.json").read_text())
    assert set(data["filters"]) == set(names)
    for result in data["filters"].values():
        assert set(result["trials"]) == {"a_turn", "b_turn"}
        assert result["mean_deg"] == pytest.approx(sum(result["trials"].values()) / 2, abs=1e-4)
    assert data["filters"]["accelerometer"]["mean_deg"] < 0.05  # the motion has no acceleration
    assert data["filters"]["attitude"]["mean_deg"] < 1.0
    assert max(data["difference_deg"].values()) < 0.1
    assert (folder / "o" / "a.png").read_bytes()[:4] == b"\x89PNG"
    out = capsys.readouterr().out
    assert "fixed.attitude" in out and "A = a_turn" in out and "a.png" in out


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_every_filter_reports_each_sample_once(folder, name):
    rec = recordings.load(folder / "b_turn.npz")
    seen = []
    up = FILTERS[name](rec, seen.append)
    assert up.shape == (400, 3)
    assert sum(seen) == 400
    assert np.linalg.norm(up, axis=1) == pytest.approx(1)
    assert rec.rmse_deg(up) < 15

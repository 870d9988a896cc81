# SPDX-License-Identifier: MIT
"""Reading recordings, the error measure, and what the accuracy command writes."""

import json
import math

import numpy as np
import pytest
from scipy.io import savemat

from tools import recordings
from tools.accuracy import __main__ as accuracy
from tools.accuracy import measure
from tools.accuracy.cases import CASES
from tools.accuracy.filters import FILTERS, SIMULATED, Estimate
from tools.accuracy.motions import Motion, by_hand, from_euler, product, up_of


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


def csv_text(motion, rows, movement=False):
    """One's own csv of a Motion and what a sensor read."""
    lines = ["# turned by hand", "t_s,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,qw,qx,qy,qz"]
    lines[1] += ",movement" * movement
    for i, (t, row, quat) in enumerate(zip(motion.t, rows, motion.quat, strict=True)):
        truth = ("", "", "", "") if i in (7, 8) else quat
        cells = [t, *row[3:], *row[:3], *truth] + [int(i > 50)] * movement
        lines.append(",".join(map(str, cells)))
    return "\n".join(lines) + "\n"


def test_ones_own_csv(tmp_path):
    motion = Motion(8, lambda t: by_hand(t, 1.0))
    rows = motion.read(noise=False)
    (tmp_path / "mine.csv").write_text(csv_text(motion, rows, True))
    rec = recordings.load(recordings.files(tmp_path)[0])
    assert (len(rec), rec.name) == (800, "mine")
    assert rec.rate_hz == pytest.approx(100)
    assert rec.gyro_dps == pytest.approx(rows[:, :3])
    assert rec.accel_g == pytest.approx(rows[:, 3:])
    assert np.isnan(rec.up[7]).all() and not rec.counted[:51].any() and rec.counted[51:].all()
    assert rec.up[100] == pytest.approx(up_of(motion.quat)[100])
    (tmp_path / "mine.csv").write_text(csv_text(motion, rows))
    first = np.argmax(recordings.load(tmp_path / "mine.csv").counted)
    assert 100 < first < 200  # when it begins to turn
    with pytest.raises(ValueError, match="qx"):
        (tmp_path / "mine.csv").write_text(csv_text(motion, rows).replace("qx", "x"))
        recordings.load(tmp_path / "mine.csv")


@pytest.mark.parametrize("mounted", [(0, 0, 0), (5, -3, 20), (90, 0, 0), (0, 80, 120)])
def test_repo_imus_truth_is_turned_into_the_sensors_axes_with_z_up(tmp_path, mounted):
    """Its cameras tell how the body has turned since the first sample, about the body's axes."""
    motion = Motion(20, lambda t: by_hand(t, 2.0))
    rows = motion.read(seed=3)
    body = product(motion.quat, np.broadcast_to(from_euler(*np.array(mounted, float)[:, None]),
                                                motion.quat.shape))
    told = product(np.broadcast_to(body[0] * (1, -1, -1, -1), body.shape), body)
    lines = ["Time (s);Vicon Orientation;;;;IMU Acceleration;;;IMU Gyroscope;;;IMU Mag;;;",
             ";W;X;Y;Z;X;Y;Z;X;Y;Z;X;Y;Z;"]
    for t, row, quat in zip(motion.t, rows, told, strict=True):
        cells = [t, *quat, *(9.80665 * row[3:]), *np.radians(row[:3]), 0.1, 0.2, 0.3]
        lines.append(";".join(f"{cell:.6g}" for cell in cells) + ";")
    (tmp_path / "stick.csv").write_text("\n".join(lines) + "\n")
    rec = recordings.load(tmp_path / "stick.csv")
    assert rec.rate_hz == pytest.approx(100, rel=1e-3)
    off = np.degrees(np.arccos(np.clip(np.sum(rec.up * up_of(motion.quat), 1), -1, 1)))
    assert off.max() < 0.5
    assert rec.counted.sum() == pytest.approx(1800, abs=120)


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
                   str(folder / "o" / "a.png"), "--filters", *names, "--parts", "recordings",
                   "scaled", "simulated", "--cases", "free fall 1 s, landing 4 g"])
    data = json.loads((folder / "o" / "a.json").read_text())
    assert set(data["filters"]) == set(names)
    for result in data["filters"].values():
        assert set(result["trials"]) == {"a_turn", "b_turn"}
        assert result["mean_deg"] == pytest.approx(sum(result["trials"].values()) / 2, abs=1e-4)
    assert data["filters"]["accelerometer"]["mean_deg"] < 0.05  # the motion has no acceleration
    assert data["filters"]["attitude"]["mean_deg"] < 1.0
    assert "slope_deg_min" in data["filters"]["attitude"]
    assert max(data["difference_deg"].values()) < 0.1
    assert list(data["scaled"]) == ["0.97", "0.99", "1.01", "1.03"]
    means = [row["fixed.attitude"] for row in data["scaled"].values()]
    assert len({*means, data["filters"]["fixed.attitude"]["mean_deg"]}) == 5
    [row] = data["simulated"].values()
    assert 0 < row["fixed.attitude"]["rms_deg"] < row["fixed.attitude"]["peak_deg"] < 0.5
    assert set(data["inside"]) == {"attitude", "fixed.attitude", "fixed.attitude, simulated"}
    assert (folder / "o" / "a.png").read_bytes()[:4] == b"\x89PNG"
    out, err = capsys.readouterr()
    assert "fixed.attitude" in out and "A = a_turn" in out and "a.png" in out
    assert "sample/s" not in err  # no terminal, no bar


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_every_filter_reports_each_sample_once(folder, name):
    rec = recordings.load(folder / "b_turn.npz")
    seen = []
    found = FILTERS[name](rec, seen.append)
    assert found.up.shape == (400, 3)
    assert sum(seen) == 400
    assert np.linalg.norm(found.up, axis=1) == pytest.approx(1)
    assert rec.rmse_deg(found.up) < 15
    if found.quat is not None:
        assert recordings.up_from_quaternion(found.quat) == pytest.approx(found.up, abs=1e-6)


def test_a_heading_and_bounds_are_scored(folder):
    rec = recordings.load(folder / "b_turn.npz")
    minutes = np.arange(400) / rec.rate_hz / 60
    yaw = from_euler(0 * minutes, 0 * minutes, 12.0 * minutes)
    true = np.where(np.isnan(rec.quat), 1.0, rec.quat)
    quat = product(yaw, true / np.linalg.norm(true, axis=1, keepdims=True))
    sigma = np.stack([np.where(minutes > minutes[300], 0.0, 1.0), 0.0 * minutes + 0.2], 1)
    scores = measure.scores(rec, Estimate(recordings.up_from_quaternion(quat), quat, sigma))
    assert scores["rms_deg"] == pytest.approx(0, abs=1e-6)
    assert scores["slope_deg_min"] == pytest.approx(12.0)
    assert scores["tilt_inside"] == pytest.approx(0.75, abs=0.02)
    assert scores["yaw_inside"] == pytest.approx(0.392 / 12 / minutes[-1], abs=0.02)


@pytest.mark.parametrize("name", sorted(set(CASES) - {"an hour at rest, drifting"}))
def test_a_simulated_case_is_what_its_truth_says(name):
    """What the sensor reads is how the truth turns, but where it lies on purpose."""
    rec = CASES[name](0)
    assert rec.counted.any() and len(rec) > 1000
    steps = product(rec.quat[:-1] * (1, -1, -1, -1), rec.quat[1:])
    rates = np.degrees(2 * steps[:, 1:] * np.sign(steps[:, :1])) * rec.rate_hz
    told = (rec.gyro_dps[1:] + rec.gyro_dps[:-1]) / 2
    off = np.abs(np.median(told - rates, axis=0)).max()
    lies = {"the same, bias 15 deg/s": (9, 16), "start in motion, first 10 s": (0.7, 1.6),
            "start in motion, 10 to 65 s": (0.7, 1.6), "warms 15 degC in 20 minutes": (2, 5)}
    low, high = lies.get(name, (0, 0.1))
    assert low <= off < high
    again = CASES[name](1)
    assert len(again) == len(rec) and not np.array_equal(again.accel_g, rec.accel_g)


def test_simulated_filters_know_the_instant():
    """Without a lead that is not there."""
    rec = CASES["by hand, 250 Hz"](0)
    for name in ("fixed.attitude", "vqf"):
        found = SIMULATED[name](rec, lambda n: None)
        assert rec.rmse_deg(found.up) < 0.3

# SPDX-License-Identifier: MIT
"""Motion sources: rates integrate to the truth, rest feels gravity, a shift its acceleration."""

import math

import numpy as np
import pytest

from tools.virtual.motion import (
    FreeMotion,
    Replay,
    Sequence,
    Sinusoid,
    Step,
    Still,
    Temperature,
    Vibration,
)
from tools.virtual.motion import quaternions as quat

G = 9.80665

TURNING = {
    "sinusoid": Sinusoid(30, 1.0, "pitch"),
    "yaw": Sinusoid(90, 0.5, "yaw"),
    "step": Step(20, at_s=0.1),
    "free": FreeMotion(1),
    "upside down": FreeMotion(2, angle_deg=(300, 85, 500), rest_s=0.5),
    "shaken": Vibration(rpm=(5000, 5100), over=FreeMotion(3)),
}


def angle_deg(p, q):
    return math.degrees(2 * math.acos(min(1.0, abs(sum(a * b for a, b in zip(p, q))))))


@pytest.mark.parametrize("name", TURNING)
def test_rates_integrate_to_the_truth(name):
    motion, h, q = TURNING[name], 2e-4, TURNING[name].truth(0.0)
    for n in range(10_000):
        rates = motion.at((n + 0.5) * h)[3:6]
        q = quat.product(q, quat.from_rotation_vector(*(math.radians(v) * h for v in rates)))
    assert angle_deg(q, motion.truth(2.0)) < 0.01
    assert max(angle_deg(motion.truth(0.0), motion.truth(t / 10)) for t in range(20)) > 10


@pytest.mark.parametrize("roll, pitch", [(0, 0), (30, 0), (0, 40), (-120, 20), (170, -60)])
def test_rest_feels_gravity(roll, pitch):
    """roll = atan2(ay, az), pitch = atan2(-ax, sqrt(ay^2 + az^2)); one g in all."""
    ax, ay, az, *rates, temp_c = Still(roll, pitch, 70, temp_c=31.0).at(5.0)
    assert math.degrees(math.atan2(ay, az)) == pytest.approx(roll, abs=1e-9)
    assert math.degrees(math.atan2(-ax, math.hypot(ay, az))) == pytest.approx(pitch, abs=1e-9)
    assert math.sqrt(ax * ax + ay * ay + az * az) == pytest.approx(1)
    assert rates == [0, 0, 0]
    assert temp_c == 31.0


def test_level_is_plus_one_g_on_z():
    assert Still().at(0)[:3] == (0, 0, 1)


@pytest.mark.parametrize("axis, at", [("roll", 1), ("pitch", 0)])
def test_turning_slowly_feels_the_rotated_gravity(axis, at):
    motion = Sinusoid(30, 0.5, axis)
    sample = motion.at(0.5)  # +30 degrees
    assert sample[at] == pytest.approx(0.5 if axis == "roll" else -0.5)
    assert sample[2] == pytest.approx(math.cos(math.radians(30)))


def test_specific_force_of_free_motion_is_gravity_and_acceleration():
    """Back in earth coordinates, minus gravity, integrated twice: the amplitude of the shift."""
    motion = FreeMotion(5, shift_m=0.1)
    h = 1e-3
    velocity, place, track = np.zeros(3), np.zeros(3), []
    for n in range(20_000):
        w, x, y, z = motion.truth(n * h)
        force = quat.to_sensor((w, -x, -y, -z), *motion.at(n * h)[:3])
        velocity = velocity + h * G * (np.array(force) - (0, 0, 1))
        place = place + h * velocity
        track.append(place)
    track = np.array(track)
    seconds = np.arange(len(track)) * h
    for axis in range(3):  # the integration's own constants make a straight line
        rest = track[:, axis] - np.polyval(np.polyfit(seconds, track[:, axis], 1), seconds)
        assert 0.02 < np.abs(rest).max() < 0.25


def test_arm_feels_centripetal_and_tangential_acceleration():
    """A sensor 0.1 m above a roll axis: -w^2 r along the arm, -alpha r across it."""
    motion = Sinusoid(30, 1.0, "roll", arm_m=(0, 0, 0.1))
    plain = Sinusoid(30, 1.0, "roll")
    w = 2 * math.pi
    top = math.radians(30) * w  # rate at zero angle, rad/s
    assert motion.at(0)[2] - plain.at(0)[2] == pytest.approx(-top * top * 0.1 / G)
    alpha = -math.radians(30) * w * w  # at the turning point
    assert motion.at(0.25)[1] - plain.at(0.25)[1] == pytest.approx(-alpha * 0.1 / G)


def test_step_is_a_servo():
    motion = Step(20, at_s=0.5, rate_limit_dps=100, natural_hz=6, damping=0.9)
    assert motion.angle_deg(0.5) == 0
    assert motion.angle_deg(3.0) == pytest.approx(20, abs=1e-3)
    rates = [motion.at(n / 1000)[3] for n in range(1500)]
    assert max(rates) == pytest.approx(100)
    peak = max(motion.angle_deg(n / 1000) for n in range(1500))
    assert 20 <= peak < 20.5


def test_vibration_has_its_lines():
    """6000 RPM is 100 Hz; amplitudes as given, the second harmonic as told."""
    motion = Vibration(6000, (0.3, 0.2, 0.1), (5, 6, 7), harmonics=((1, 1.0), (2, 0.5)))
    table = np.array([motion.at(n / 2000) for n in range(2000)])
    lines = np.abs(np.fft.rfft(table - table.mean(axis=0), axis=0)) / 1000
    assert lines[100, :6] == pytest.approx([0.3, 0.2, 0.1, 5, 6, 7], rel=1e-3)
    assert lines[200, :6] == pytest.approx([0.15, 0.1, 0.05, 2.5, 3, 3.5], rel=1e-3)
    assert table.mean(axis=0)[:3] == pytest.approx([0, 0, 1], abs=1e-6)


def test_free_motion_rests_first_and_is_its_seed():
    motion = FreeMotion(4, rest_s=1.0)
    assert motion.at(0.9) == pytest.approx((0, 0, 1, 0, 0, 0, 25))
    assert motion.at(3.0)[:6] != motion.at(0.5)[:6]
    assert FreeMotion(4).at(2.0) == FreeMotion(4).at(2.0) != FreeMotion(5).at(2.0)


def test_temperature_goes_where_it_is_told():
    motion = Temperature(Still(10), -10, 50, 60)
    assert [motion.at(t)[6] for t in (0, 30, 60, 99)] == [-10, 20, 50, 50]
    assert motion.at(30)[:6] == Still(10).at(0)[:6]


def test_sequence():
    motion = Sequence((Still(0), 1.0), (Still(90), 2.0))
    assert motion.at(0.5)[2] == pytest.approx(1)
    assert motion.at(1.5)[1] == pytest.approx(1)
    assert motion.at(99)[1] == pytest.approx(1)
    assert motion.truth(1.5) == Still(90).truth(0)
    assert motion.duration_s == 3.0


def test_unknown_axis():
    with pytest.raises(ValueError, match="pitch"):
        Sinusoid(axis="x")


# replay


def recorded(seconds=2.0, rate=200.0):
    motion = FreeMotion(7)
    times = np.arange(int(seconds * rate)) / rate
    rows = np.array([motion.at(t) for t in times])
    quats = np.array([motion.truth(t) for t in times])
    return motion, times, rows[:, :3] * G, np.radians(rows[:, 3:6]), quats


def write_npz(path, **changes):
    motion, _, acc, gyr, quats = recorded()
    data = {"acc_m_s2": acc, "gyr_rad_s": gyr, "quat_wxyz": quats, "rate_hz": 200.0, **changes}
    np.savez(path, **{key: value for key, value in data.items() if value is not None})
    return motion


def write_csv(path, with_truth=True):
    motion, times, acc, gyr, quats = recorded()
    names = ["t_s"] + [f"acc_{n}_m_s2" for n in "xyz"] + [f"gyr_{n}_rad_s" for n in "xyz"]
    columns = [times[:, None], acc, gyr]
    if with_truth:
        names += [f"quat_{n}" for n in "wxyz"]
        columns.append(quats)
    table = np.hstack(columns)
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")
    return motion


@pytest.mark.parametrize("kind", ["npz", "csv"])
def test_replay_gives_the_recorded_motion(tmp_path, kind):
    path = tmp_path / f"motion.{kind}"
    original = (write_npz if kind == "npz" else write_csv)(path)
    motion = Replay(path)
    assert motion.duration_s == pytest.approx(1.995)
    for t in (0.0, 0.5, 0.7531, 1.99):
        assert motion.at(t) == pytest.approx(original.at(t), abs=0.05)
        assert angle_deg(motion.truth(t), original.truth(t)) < 0.01
    t = 0.505  # a sample's own instant
    assert motion.at(t) == pytest.approx(original.at(t), abs=1e-4)


def test_replay_rests_before_and_after(tmp_path):
    original = write_npz(tmp_path / "m.npz")
    motion = Replay(tmp_path / "m.npz", lead_s=1.0)
    assert motion.at(0.5)[:3] == pytest.approx((0, 0, 1), abs=1e-9)
    assert motion.at(0.5)[3:6] == (0, 0, 0)
    assert motion.at(1.5) == pytest.approx(original.at(0.5), abs=0.05)
    assert motion.at(9.0)[3:6] == (0, 0, 0)
    assert motion.duration_s == pytest.approx(2.995)


def test_a_rest_before_the_recording_has_its_gyros_bias(tmp_path):
    rest = np.tile((0.01, -0.02, 0.004), (200, 1)) + np.random.default_rng(1).normal(
        0.0, 0.001, (200, 3)
    )
    write_npz(tmp_path / "m.npz", gyr_rad_s=np.vstack([rest, np.ones((200, 3))]))
    motion = Replay(tmp_path / "m.npz", lead_s=1.0)
    assert np.radians(motion.at(0.5)[3:6]) == pytest.approx((0.01, -0.02, 0.004), abs=6e-4)
    assert motion.at(9.0)[3:6] == (0, 0, 0)  # a steady turn, faster than a bias
    write_npz(tmp_path / "n.npz", gyr_rad_s=np.linspace((0, 0, 0), (1, 0, 0), 400))
    assert Replay(tmp_path / "n.npz", lead_s=1.0).at(0.5)[3:6] == (0, 0, 0)  # it begins to turn


def test_replay_of_a_piece(tmp_path):
    original = write_npz(tmp_path / "m.npz")
    motion = Replay(tmp_path / "m.npz", start_s=0.5, length_s=1.0)
    assert motion.duration_s == pytest.approx(1.0)
    assert motion.at(0.25) == pytest.approx(original.at(0.75), abs=0.05)


def test_replay_without_truth(tmp_path):
    write_csv(tmp_path / "m.csv", with_truth=False)
    motion = Replay(tmp_path / "m.csv", lead_s=1)
    assert all(math.isnan(v) for v in motion.truth(1.0))
    assert math.sqrt(sum(v * v for v in motion.at(0.2)[:3])) == pytest.approx(1)


def test_replay_says_what_is_missing(tmp_path):
    write_npz(tmp_path / "m.npz", gyr_rad_s=None)
    with pytest.raises(ValueError, match="gyr_rad_s"):
        Replay(tmp_path / "m.npz")
    (tmp_path / "m.csv").write_text("t_s,acc_x_m_s2\n0,1\n")
    with pytest.raises(ValueError, match="gyr_x_rad_s"):
        Replay(tmp_path / "m.csv")
    with pytest.raises(ValueError, match="two samples"):
        write_npz(tmp_path / "n.npz")
        Replay(tmp_path / "n.npz", start_s=100)

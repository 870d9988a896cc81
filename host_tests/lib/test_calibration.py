# SPDX-License-Identifier: MIT
"""Calibration: the procedures on chips with the datasheet's worst tolerances, against truth."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from host_tests.lib.sensor_rig import Feel, rig
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still

FACES = {
    "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0),
    "+z": (0, 0, 1), "-z": (0, 0, -1),
}  # fmt: skip
# 3 % scale, 2 % cross-axis, 80 mg: PS-MPU-6000A p. 13
WORST_MATRIX = ((1.03, 0.02, -0.02), (-0.02, 0.97, 0.02), (0.02, -0.02, 1.03))
WORST_BIAS = (0.08, -0.08, 0.08)


def _worst_chip(**more):
    return MPU6050Chip(
        seed=3, accel_bias_g=WORST_BIAS, accel_matrix=WORST_MATRIX,
        gyro_bias_dps=(20, -18, 15), **more,
    )  # fmt: skip


def _pose(r, poses, accel, seconds=1.0, temp=25.0):
    r.chip.set_motion(Feel(accel, temp=temp))
    r.wait_ms(100)
    return poses.add(seconds)


def _error_mg(cal, directions):
    """Largest error of the calibrated reading of the worst chip, in mg, over directions."""
    worst = 0.0
    for true in directions:
        reading = np.array(WORST_MATRIX) @ true + WORST_BIAS
        worst = max(worst, np.abs(np.array(cal.apply(reading, (0, 0, 0))[0]) - true).max())
    return 1000 * worst


SPHERE = Rotation.random(200, random_state=7).apply((0, 0, 1))


@pytest.mark.parametrize("order", [tuple(FACES), ("-z", "+y", "-x", "+z", "+x", "-y")])
def test_six_faces_at_the_worst_tolerance(order):
    with rig("esp32", _worst_chip()) as r:
        from calibration.poses import Poses

        imu = r.sensor(accel_g=2)
        poses = Poses(imu)
        for name in order:
            assert _pose(r, poses, FACES[name]) == name
        cal = poses.solve()
    assert cal.residual_mg < 2
    assert _error_mg(cal, SPHERE) < 2
    scale = np.diag(np.array(cal.accel_matrix).reshape(3, 3) @ WORST_MATRIX)
    assert scale == pytest.approx((1, 1, 1), abs=1e-3)
    assert cal.accel_bias_g == pytest.approx(WORST_BIAS, abs=1e-3)


def test_a_mounting_survives_a_new_calibration():
    with rig("esp32", _worst_chip()) as r:
        from calibration import Calibration, mounting
        from calibration.poses import Poses

        poses = Poses(r.sensor(accel_g=2))
        for direction in FACES.values():
            _pose(r, poses, direction, 0.2)
        cal = poses.solve(Calibration().mounted(mounting.orientation("+y", "-x")))
    reading = np.array(WORST_MATRIX) @ (-0.8, 0.6, 0.0) + WORST_BIAS
    accel, gyro = cal.apply(reading, np.array(cal.gyro_bias_dps) + (1.0, 2.0, 3.0))
    assert accel == pytest.approx((0.6, 0.0, 0.8), abs=4e-3)
    assert gyro == pytest.approx((2.0, -3.0, -1.0))


def test_missing_faces_are_named():
    with rig("esp32", _worst_chip()) as r:
        from calibration.poses import Poses

        poses = Poses(r.sensor())
        for name in ("+x", "-x", "+y", "+z", "+z"):
            _pose(r, poses, FACES[name], 0.1)
        assert poses.missing() == ["-y", "-z"]
        with pytest.raises(ValueError, match="not yet up: -y, -z"):
            poses.solve()
        poses.undo()
        poses.undo()
        assert poses.missing() == ["+z", "-y", "-z"]


def test_any_poses_by_hand():
    """Fourteen poses, none of them exact: what is left is a rotation, which mounting finds."""
    with rig("esp32", _worst_chip()) as r:
        from calibration.poses import Poses

        imu = r.sensor(accel_g=2)
        poses = Poses(imu)
        directions = Rotation.random(14, random_state=1).apply((0, 0, 1))
        for direction in directions:
            _pose(r, poses, direction)
        cal = poses.solve(faces=False)
    assert cal.residual_mg < 2
    lengths = [
        np.linalg.norm(cal.apply(np.array(WORST_MATRIX) @ d + WORST_BIAS, (0, 0, 0))[0])
        for d in SPHERE
    ]
    assert lengths == pytest.approx([1.0] * len(SPHERE), abs=2e-3)
    assert cal.accel_bias_g == pytest.approx(WORST_BIAS, abs=2e-3)


@pytest.mark.parametrize(
    "poses, why",
    [
        ([(0, 0, 1)] * 5, "5 poses: at least 6"),
        ([(0, 0, 1), (0, 1, 0)] * 4, "turn x up in some"),
        ([(3, 0, 0), (-3, 0, 0), (0, 3, 0), (0, -3, 0), (0, 0, 3), (0, 0, -3)], "at rest in each"),
    ],
)
def test_poses_that_cannot_do(poses, why):
    from calibration import solve

    with pytest.raises(ValueError, match=why):
        solve.from_rest(poses)


def test_faces_in_a_plane_cannot_do():
    from calibration import solve

    flat = [FACES[n] for n in ("+x", "-x", "+y", "-y")]
    with pytest.raises(ValueError, match="too alike"):
        solve.from_faces(flat, flat)


def test_single_precision_is_enough():
    """The solvers again with every operation in float32, as on the board."""
    from calibration import solve

    rng = np.random.default_rng(2)
    readings = [np.array(WORST_MATRIX) @ d + WORST_BIAS for d in SPHERE[:20]]
    exact = solve.from_rest([tuple(map(float, p)) for p in readings])
    short = solve.from_rest([tuple(np.float32(v) for v in p) for p in readings])
    assert np.array(short[0]) == pytest.approx(exact[0], abs=2e-5)
    assert np.array(short[1]) == pytest.approx(exact[1], abs=5e-5)
    faces = list(FACES.values())
    readings = [np.array(WORST_MATRIX) @ f + WORST_BIAS + rng.normal(0, 4e-4, 3) for f in faces]
    exact = solve.from_faces(readings, faces)
    short = solve.from_faces([p.astype(np.float32) for p in readings], faces)
    assert np.array(short[1]) == pytest.approx(exact[1], abs=2e-5)


def test_tilt_over_temperature_after_two_calibrations():
    """35 and 60 mg over 0 to 70 degC (PS p. 13): corrected from -10 to 50 degC."""
    drift = (0.035 / 70, -0.035 / 70, 0.060 / 70)
    gyro_drift = (0.16, -0.16, 0.1)  # 20 deg/s over 125 degC
    with rig("esp32", _worst_chip(accel_bias_g_per_c=drift, gyro_bias_dps_per_c=gyro_drift)) as r:
        from calibration.poses import Poses, with_slopes
        from calibration.rest import gyro_bias

        imu = r.sensor(accel_g=2)
        cals = []
        for temp in (10.0, 35.0):
            poses = Poses(imu)
            for direction in FACES.values():
                _pose(r, poses, direction, 0.5, temp)
            cals.append(poses.solve(gyro_bias(imu)))
        cal = with_slopes(*cals)
        with pytest.raises(ValueError, match=r"0\.0 degC apart"):
            with_slopes(cals[0], cals[0])
        for temp in (-10.0, 25.0, 50.0):
            for roll, pitch in ((0, 0), (30, -20), (-80, 5)):
                r.chip.set_motion(Still(roll, pitch, temp_c=temp))
                r.wait_ms(100)
                mean = np.zeros((2, 3))
                for _ in range(100):
                    imu.read()
                    now = cal.at(imu.temp_c())
                    mean += now.apply(imu.accel_g(), imu.gyro_dps()) / np.float64(100)
                    r.wait_ms(2)
                true = np.array(Still(roll, pitch).at(0)[:3])
                cosine = mean[0] @ true / np.linalg.norm(mean[0])
                assert math.degrees(math.acos(min(1, cosine))) < 0.3
                assert mean[1] == pytest.approx([0, 0, 0], abs=0.15)


def test_a_mounted_calibration_speaks_of_the_robot():
    """Sensor on its side on a worst chip; roll and pitch are then the robot's."""
    with rig("esp32", _worst_chip()) as r:
        from calibration import Calibration, mounting
        from calibration.poses import Poses
        from calibration.rest import rest

        imu = r.sensor(accel_g=2)
        poses = Poses(imu)
        for direction in FACES.values():
            _pose(r, poses, direction, 0.5)
        cal = poses.solve(Calibration())
        turn = Rotation.random(random_state=11).as_matrix()

        def feel(true):
            r.chip.set_motion(Feel(turn.T @ true))
            r.wait_ms(100)
            return cal.apply(rest(imu, 0.3).accel_g, (0, 0, 0))[0]

        level = feel((0, 0, 1))
        nose_up = feel((math.sin(0.5), 0, math.cos(0.5)))
        cal = cal.mounted(mounting.from_tilt(level, nose_up))
        for true in ((0.6, 0.0, 0.8), (0.0, -1.0, 0.0), (-0.48, 0.6, 0.64)):
            assert feel(true) == pytest.approx(true, abs=3e-3)
    rates = cal.but(gyro_bias_dps=(0, 0, 0)).apply((0, 0, 0), turn.T @ (10.0, 20.0, -30.0))[1]
    assert rates == pytest.approx((10, 20, -30), abs=0.2)

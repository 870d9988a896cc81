# SPDX-License-Identifier: MIT
"""Calibration: the procedures on chips with the datasheet's worst tolerances, against truth."""

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from sensor_rig import BUSES, Feel, rig

from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still, Vibration

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


# ---- gyro bias and stillness


@pytest.mark.parametrize("kind", BUSES)
def test_gyro_bias_at_rest(kind):
    with rig(kind, _worst_chip()) as r:
        from mpu6050.calibrate import gyro_bias

        imu = r.sensor(dlpf_hz=44)
        cal = gyro_bias(imu, seconds=0.5)
        assert cal.gyro_bias_dps == pytest.approx((20, -18, 15), abs=0.05)
        assert cal.temp_c == pytest.approx(25, abs=0.2)
        assert cal.who_am_i == 0x68
        imu.read()
        assert cal.apply(imu.accel_g(), imu.gyro_dps())[1] == pytest.approx((0, 0, 0), abs=0.3)


class _Turn:
    """Slowly about a level axis, 1 deg/s."""

    duration_s = None

    def at(self, t_s):
        angle = math.radians(t_s)
        return (0.0, math.sin(angle), math.cos(angle), 1.0, 0.0, 0.0, 25.0)

    def truth(self, t_s):
        return (1.0, 0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "motion, why",
    [
        (Vibration(rpm=3000, accel_g=(0.0, 0.0, 0.0), gyro_dps=(0, 20, 0)), "gyro y shook by"),
        (Vibration(rpm=1500, accel_g=(0.3, 0, 0), gyro_dps=(0, 0, 0)), "accelerometer x shook by"),
        (_Turn(), "accelerometer y drifted by"),
        (Feel(gyro=(0, 0, -50)), "gyro z turns at"),
        (Feel((0.0, 0.0, 0.3)), "it feels 0.3 g instead of 1 g"),
    ],
)  # fmt: skip
def test_a_moving_sensor_is_refused_and_told_why(motion, why):
    with rig(motion=motion, noise=True) as r:
        from mpu6050.calibrate import NotStill, gyro_bias

        imu = r.sensor(dlpf_hz=260)
        with pytest.raises(NotStill, match=why):
            gyro_bias(imu)


def test_a_dead_sensor_is_not_still():
    with rig() as r:
        from mpu6050.calibrate import NotStill, rest

        imu = r.sensor()
        r.fault("filled", value=0xFF)
        with pytest.raises(NotStill, match="no data"):
            rest(imu)


@pytest.mark.parametrize("dlpf_hz", (260, 44, 5))
def test_the_sensors_own_noise_is_not_movement(dlpf_hz):
    with rig("esp32", MPU6050Chip(seed=5)) as r:
        from mpu6050.calibrate import rest

        imu = r.sensor(dlpf_hz=dlpf_hz)
        r.wait_ms(500)
        for _ in range(5):
            rest(imu, 0.5)


# ---- accelerometer


@pytest.mark.parametrize("order", [tuple(FACES), ("-z", "+y", "-x", "+z", "+x", "-y")])
def test_six_faces_at_the_worst_tolerance(order):
    with rig("esp32", _worst_chip()) as r:
        from mpu6050.calibrate import Poses

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
        from mpu6050 import mounting
        from mpu6050.calibrate import Poses
        from mpu6050.calibration import Calibration

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
        from mpu6050.calibrate import Poses

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
        from mpu6050.calibrate import Poses

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
    from mpu6050 import solve

    with pytest.raises(ValueError, match=why):
        solve.from_rest(poses)


def test_faces_in_a_plane_cannot_do():
    from mpu6050 import solve

    flat = [FACES[n] for n in ("+x", "-x", "+y", "-y")]
    with pytest.raises(ValueError, match="too alike"):
        solve.from_faces(flat, flat)


def test_single_precision_is_enough():
    """The solvers again with every operation in float32, as on the board."""
    from mpu6050 import solve

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


# ---- temperature


def test_tilt_over_temperature_after_two_calibrations():
    """35 and 60 mg over 0 to 70 degC (PS p. 13): corrected from -10 to 50 degC."""
    drift = (0.035 / 70, -0.035 / 70, 0.060 / 70)
    gyro_drift = (0.16, -0.16, 0.1)  # 20 deg/s over 125 degC
    with rig("esp32", _worst_chip(accel_bias_g_per_c=drift, gyro_bias_dps_per_c=gyro_drift)) as r:
        from mpu6050.calibrate import Poses, gyro_bias, with_slopes

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


def test_gyro_bias_over_temperature_is_learned_at_rests():
    from mpu6050.calibration import Calibration
    from mpu6050.thermal import BiasLearner

    rng = np.random.default_rng(4)
    start = Calibration(gyro_bias_dps=(9, 9, 9), gyro_slope_dps_per_c=(0.5, 0, 0))
    learner = BiasLearner(start)
    assert learner.calibration() is start

    def line(temp):
        return [1.0 + 0.1 * (temp - 25), -2.0 - 0.05 * (temp - 25), 3.0]

    learner.rested(25.0, line(25.0))
    assert learner.calibration().gyro_bias_dps == pytest.approx(line(25.0))
    assert learner.calibration().gyro_slope_dps_per_c == (0.5, 0, 0)  # one point has no slope
    for k in range(300):
        temp = 30 + 10 * math.sin(k / 20)
        learner.rested(temp, line(temp) + rng.normal(0, 0.02, 3))
    cal = learner.calibration()
    assert cal.gyro_slope_dps_per_c == pytest.approx((0.1, -0.05, 0), abs=2e-3)
    assert cal.at(50).gyro_bias_dps == pytest.approx(line(50), abs=0.1)


# ---- mounting


TURNS = Rotation.random(20, random_state=11).as_matrix()


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("tilt", (12.0, 45.0, 75.0))
def test_mounting_from_level_and_nose_up(turn, tilt):
    from mpu6050 import mounting

    level = turn.T @ (0, 0, 1)
    nose_up = turn.T @ (math.sin(math.radians(tilt)), 0, math.cos(math.radians(tilt)))
    found = mounting.from_tilt(level, nose_up)
    assert np.array(found).reshape(3, 3) == pytest.approx(turn, abs=1e-9)


@pytest.mark.parametrize("tilt", (0.0, 5.0, 85.0, 170.0))
def test_a_tilt_that_tells_nothing_is_refused(tilt):
    from mpu6050 import mounting

    with pytest.raises(ValueError, match="between 10 and 80"):
        mounting.from_tilt(
            (0, 0, 1), (math.sin(math.radians(tilt)), 0, math.cos(math.radians(tilt)))
        )


def test_all_24_orientations():
    from mpu6050 import mounting

    seen = set()
    for forward, x in FACES.items():
        for up, z in FACES.items():
            if forward[1] == up[1]:
                with pytest.raises(ValueError, match="one axis"):
                    mounting.orientation(forward, up)
                continue
            matrix = np.array(mounting.orientation(forward, up)).reshape(3, 3)
            assert np.linalg.det(matrix) == pytest.approx(1)
            assert matrix @ x == pytest.approx([1, 0, 0])
            assert matrix @ z == pytest.approx([0, 0, 1])
            seen.add(tuple(matrix.ravel()))
            small = Rotation.from_rotvec((0.1, -0.12, 0.08)).as_matrix() @ matrix
            found = mounting.nearest(tuple(small.ravel()))
            assert found[:2] == (forward, up)
            assert found[2] == pytest.approx(math.degrees(math.hypot(0.1, 0.12, 0.08)))
    assert len(seen) == 24
    with pytest.raises(ValueError, match="not one of"):
        mounting.orientation("x", "+z")


def test_a_small_rotation_from_one_level_reading():
    from mpu6050 import mounting

    rough = mounting.orientation("-y", "+x")
    true = Rotation.from_euler("xy", (4.0, -6.0), degrees=True).as_matrix()
    true = true @ np.array(rough).reshape(3, 3)
    level = true.T @ (0, 0, 1)
    exact = np.array(mounting.refine(rough, level)).reshape(3, 3)
    assert exact @ level == pytest.approx([0, 0, 1], abs=1e-9)
    assert exact == pytest.approx(true, abs=0.02)
    with pytest.raises(ValueError, match="from this orientation's up"):
        mounting.refine(mounting.orientation("+x", "+z"), level)


@pytest.mark.parametrize("headings", (2, 3, 4))
def test_a_robot_that_cannot_be_set_level(headings):
    """On a slope of 8 degrees, turned in equal steps: the slope cancels."""
    from mpu6050 import mounting

    turn = TURNS[3]
    slope = Rotation.from_euler("yx", (8.0, -3.0), degrees=True).as_matrix()
    readings = []
    for k in range(headings):
        heading = Rotation.from_euler("z", 360 * k / headings + 20, degrees=True).as_matrix()
        readings.append(turn.T @ (slope @ heading).T @ (0, 0, 1))
    assert mounting.level_of(readings) == pytest.approx(turn.T @ (0, 0, 1), abs=1e-9)
    with pytest.raises(ValueError, match="at least two"):
        mounting.level_of(readings[:1])


def test_a_mounted_calibration_speaks_of_the_robot():
    """Sensor on its side on a worst chip; roll and pitch are then the robot's."""
    with rig("esp32", _worst_chip()) as r:
        from mpu6050 import mounting
        from mpu6050.calibrate import Poses, rest
        from mpu6050.calibration import Calibration

        imu = r.sensor(accel_g=2)
        poses = Poses(imu)
        for direction in FACES.values():
            _pose(r, poses, direction, 0.5)
        cal = poses.solve(Calibration())
        turn = TURNS[5]

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


# ---- the numbers as a dict


def test_a_calibration_survives_json():
    from mpu6050.calibration import Calibration

    cal = Calibration(
        gyro_bias_dps=(1.5, -2.25, 0.5), accel_bias_g=(0.08, -0.05, 0.01), temp_c=31.5,
        accel_matrix=tuple(np.array(WORST_MATRIX).ravel()), gyro_slope_dps_per_c=(0.1, 0, -0.1),
        residual_mg=0.4, who_am_i=0x70, date="2026-03-01",
    )  # fmt: skip
    again = Calibration.from_dict(json.loads(json.dumps(cal.to_dict())))
    assert again.__dict__ == cal.__dict__
    assert Calibration.from_dict({}).__dict__ == Calibration().__dict__


BAD = [
    ([], "not a dict"),
    ({"version": 2}, "version is not known"),
    ({"gyro_bias_dps": [1, 2]}, "gyro_bias_dps is not a list of 3"),
    ({"gyro_bias_dps": "abc"}, "gyro_bias_dps is not a list of 3"),
    ({"gyro_bias_dps": [1, 2, None]}, "gyro_bias_dps holds something that is no number"),
    ({"gyro_bias_dps": [1, 2, True]}, "gyro_bias_dps holds something that is no number"),
    ({"gyro_bias_dps": [1, 2, 81]}, r"gyro_bias_dps is beyond \+-80"),
    ({"gyro_bias_dps": [1, 2, math.nan]}, r"gyro_bias_dps is beyond \+-80"),
    ({"gyro_bias_dps": [1, 2, 10**400]}, r"gyro_bias_dps is beyond \+-80"),
    ({"accel_bias_g": [0, 0, -0.6]}, r"accel_bias_g is beyond \+-0.5"),
    ({"accel_matrix": [1, 0, 0, 0, 1, 0, 0, 0, -1]}, "accel_matrix turns space inside out"),
    ({"gyro_matrix": [1, 0, 0, 0, 1, 0, 1, 0, 0]}, "gyro_matrix turns space inside out"),
    ({"accel_slope_g_per_c": [1, 0, 0]}, "accel_slope_g_per_c is beyond"),
    ({"temp_c": math.inf}, "temp_c is beyond"),
    ({"who_am_i": "0x68"}, "who_am_i holds something that is no number"),
    ({"date": 5}, "date is not a text"),
    ({"gyro_bais_dps": [0, 0, 0]}, "unknown field gyro_bais_dps"),
]


@pytest.mark.parametrize("fields, why", BAD)
def test_bad_fields_are_named(fields, why):
    from mpu6050.calibration import Calibration

    with pytest.raises(ValueError, match=why):
        Calibration.from_dict(fields)


def test_but_knows_its_fields():
    from mpu6050.calibration import Calibration

    with pytest.raises(ValueError, match="has no gyro_bias"):
        Calibration().but(gyro_bias=(0, 0, 0))


_JSON = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(st.text(max_size=5), inner),
    max_leaves=12,
)
_NAMES = ["version", "temp_c", "residual_mg", "who_am_i", "date"]
_NAMES += ["gyro_bias_dps", "accel_bias_g", "gyro_matrix", "accel_matrix"]
_NAMES += ["gyro_slope_dps_per_c", "accel_slope_g_per_c"]


@settings(max_examples=150, deadline=None)
@given(st.dictionaries(st.sampled_from(_NAMES), _JSON) | _JSON)
def test_whatever_a_file_holds(fields):
    """A usable calibration or a ValueError with text; nothing else, whatever comes."""
    from mpu6050.calibration import Calibration

    try:
        cal = Calibration.from_dict(fields)
    except ValueError as error:
        assert len(str(error)) > 10
    else:
        assert all(math.isfinite(v) for v in cal.apply((0, 0, 1), (1, 2, 3))[0])

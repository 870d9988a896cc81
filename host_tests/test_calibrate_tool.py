# SPDX-License-Identifier: MIT
"""The guided calibration, with a virtual board in place of the serial line and a script for a
person: after it the board's own start-up code loads true readings."""

import contextlib
import io
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_rig import Feel, rig

from tools.calibrate import Guide, Refused
from tools.virtual.chip import MPU6050Chip

MATRIX = ((1.03, 0.02, -0.02), (-0.02, 0.97, 0.02), (0.02, -0.02, 1.03))
FACES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)]
TURN = Rotation.random(random_state=8).as_matrix()  # robot = TURN sensor


@pytest.fixture
def board(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chip = MPU6050Chip(
        seed=4, accel_matrix=MATRIX, accel_bias_g=(0.08, -0.08, 0.08), gyro_bias_dps=(5, -4, 3)
    )
    with rig("rp2", chip) as r:
        space = {"__builtins__": r.port.importer.builtins}

        def run(code):
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(code, space)
            return printed.getvalue()

        yield r, run


def _person(r, feelings):
    """Answers each question by giving the sensor the next thing to feel."""
    feelings = iter(feelings)

    def ask(text):
        feeling = next(feelings)
        r.chip.set_motion(feeling if isinstance(feeling, Feel) else Feel(feeling))
        r.wait_ms(300)

    return ask


def _robot(true):
    return tuple(TURN.T @ true)


NOSE_UP = (math.sin(0.5), 0.0, math.cos(0.5))


def test_faces_and_mounting_end_in_true_readings(board):
    r, run = board
    said = []
    moving = Feel((1, 0, 0), (60, 0, 0))
    steps = [FACES[0], moving, *FACES[1:], (0, 0, 1), _robot((0, 0, 1)), _robot(NOSE_UP)]
    guide = Guide(run, _person(r, steps), said.append, seconds=0.5)
    guide.poses()
    guide.mounting()
    guide.save("2026-04-01")
    assert any("again: moved: gyro x turns at" in text for text in said)
    assert any("residual" in text and "mg" in text for text in said)

    from mpu6050.calibrate import rest

    from firmware.startup import load_calibration

    cal, warnings = load_calibration()
    assert (warnings, cal.date, cal.who_am_i) == ([], "2026-04-01", 0x68)
    assert cal.gyro_bias_dps == pytest.approx((5, -4, 3), abs=0.05)
    imu = r.sensor()
    for true in ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, -1.0, 0.0)):
        r.chip.set_motion(Feel(_robot(true)))
        r.wait_ms(100)
        assert cal.apply(rest(imu, 0.3).accel_g, (0, 0, 0))[0] == pytest.approx(true, abs=4e-3)


def test_any_poses_and_a_slope(board):
    r, run = board
    slope = Rotation.from_euler("yx", (8.0, -3.0), degrees=True)
    headings = [Rotation.from_euler("z", 90 * k, degrees=True) for k in range(4)]
    ground = [_robot((slope * h).inv().apply((0, 0, 1))) for h in headings]
    poses = list(Rotation.random(14, random_state=1).apply((0, 0, 1)))
    steps = [*poses, (0, 0, 1), *ground, _robot(NOSE_UP)]
    guide = Guide(run, _person(r, steps), lambda text: None, seconds=0.5, faces=False)
    guide.poses(14)
    guide.mounting(headings=4)
    guide.save("")

    from firmware.startup import load_calibration

    cal, _ = load_calibration()
    # what was felt when the sensor lay level in the robot's sense, through the worst chip
    for true in ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8)):
        reading = np.array(MATRIX) @ _robot(true) + (0.08, -0.08, 0.08)
        assert cal.apply(reading, (0, 0, 0))[0] == pytest.approx(true, abs=0.02)


def test_a_tilt_too_small_is_refused_in_words(board):
    r, run = board
    steps = [*FACES, (0, 0, 1), (0, 0, 1), (0.05, 0, 0.998)]
    guide = Guide(run, _person(r, steps), lambda text: None, seconds=0.3)
    guide.poses()
    with pytest.raises(Refused, match="between 10 and 80"):
        guide.mounting()

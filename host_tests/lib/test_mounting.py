# SPDX-License-Identifier: MIT
"""How the sensor sits in the robot: any orientation, found from readings at rest."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

FACES = {
    "+x": (1, 0, 0), "-x": (-1, 0, 0), "+y": (0, 1, 0), "-y": (0, -1, 0),
    "+z": (0, 0, 1), "-z": (0, 0, -1),
}  # fmt: skip
TURNS = Rotation.random(20, random_state=11).as_matrix()


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("tilt", (12.0, 45.0, 75.0))
def test_mounting_from_level_and_nose_up(turn, tilt):
    from calibration import mounting

    level = turn.T @ (0, 0, 1)
    nose_up = turn.T @ (math.sin(math.radians(tilt)), 0, math.cos(math.radians(tilt)))
    found = mounting.from_tilt(level, nose_up)
    assert np.array(found).reshape(3, 3) == pytest.approx(turn, abs=1e-9)


@pytest.mark.parametrize("tilt", (0.0, 5.0, 85.0, 170.0))
def test_a_tilt_that_tells_nothing_is_refused(tilt):
    from calibration import mounting

    with pytest.raises(ValueError, match="between 10 and 80"):
        mounting.from_tilt(
            (0, 0, 1), (math.sin(math.radians(tilt)), 0, math.cos(math.radians(tilt)))
        )


def test_all_24_orientations():
    from calibration import mounting

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
    from calibration import mounting

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
    from calibration import mounting

    turn = TURNS[3]
    slope = Rotation.from_euler("yx", (8.0, -3.0), degrees=True).as_matrix()
    readings = []
    for k in range(headings):
        heading = Rotation.from_euler("z", 360 * k / headings + 20, degrees=True).as_matrix()
        readings.append(turn.T @ (slope @ heading).T @ (0, 0, 1))
    assert mounting.level_of(readings) == pytest.approx(turn.T @ (0, 0, 1), abs=1e-9)
    with pytest.raises(ValueError, match="at least two"):
        mounting.level_of(readings[:1])

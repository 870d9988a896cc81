# SPDX-License-Identifier: MIT
"""The gyro's scale, learned in motion: shown, kept by stop() where it is better, taken back."""

import pytest

from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.motion import Still
from tools.virtual.motion.free_motion import FreeMotion

SCALE = (1.025, 0.982, 1.015)
WRONG = tuple(tuple(SCALE[i] * (i == j) for j in range(3)) for i in range(3))
TURNED = (0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0)  # a quarter about the vertical


def made(root, motion, **knobs):
    """(port, app), started."""
    chip = MPU6050Chip(motion, seed=3, gyro_bias_dps=(1.0, -0.5, 0.7), gyro_matrix=WRONG)
    port = Port("rp2", {0: Bus(chip)}, root=root)
    port.__enter__()
    from firmware.app import App

    app = App()
    for name, value in {"rate_hz": 100, "gyro_dps": 1000, **knobs}.items():
        app.config.set(name, value)
    app.start()
    return port, app


def stored():
    from firmware.calibration import load_calibration

    return load_calibration()[0]


def diagonal(matrix):
    return [matrix[i] for i in (0, 4, 8)]


@pytest.fixture(scope="module")
def moved(tmp_path_factory):
    """What report() says after two minutes of motion, and the folder of a board that stopped."""
    root = tmp_path_factory.mktemp("scale")
    port, app = made(root, FreeMotion(seed=2, rest_s=3.0, highest_hz=0.6))
    port.run_ms(120000)
    told = app.report()["gyro_scale"]
    app.set("gyro_dps", 2000)  # another filter
    kept = app.report()["gyro_scale"]
    app.stop()
    port.__exit__(None, None, None)
    return told, kept, root


def test_report_tells_each_axis_scale_and_how_well_it_is_known(moved):
    told, kept, _ = moved
    for (scale, sigma), true in zip(told, SCALE, strict=True):
        assert sigma < 0.003
        assert scale == pytest.approx(true, abs=0.005)
    for (scale, sigma), (before, was) in zip(kept, told, strict=True):
        assert scale == pytest.approx(before, abs=0.002) and sigma < 1.1 * was


def test_stop_keeps_it_and_a_word_takes_it_back(moved):
    *_, root = moved
    port, app = made(root, Still())
    used = [1 / m for m in diagonal(app.calibration.gyro_matrix)]
    assert used == pytest.approx(SCALE, abs=0.005)
    for scale, sigma in app.report()["gyro_scale"]:
        assert scale == pytest.approx(1, abs=1e-3) and sigma == pytest.approx(0.004, abs=1e-4)
    before = (root / "calibration.txt").read_bytes()
    app.stop()
    assert (root / "calibration.txt").read_bytes() == before  # nothing that is better
    app.start()
    bias = stored().gyro_bias_dps
    app.forget_scale()
    assert app.running
    assert diagonal(stored().gyro_matrix) == pytest.approx([1, 1, 1], abs=1e-5)
    assert stored().gyro_bias_dps == bias
    assert app.report()["gyro_scale"][0][1] == pytest.approx(0.02, abs=1e-4)
    app.stop()
    port.__exit__(None, None, None)


def test_what_is_not_known_well_or_belongs_to_another_matrix_is_not_kept(tmp_path):
    port, app = made(tmp_path, Still())
    from calibration import Calibration

    from firmware.calibration import keep_learned, scale_learned

    class Knows:
        def learned(self):
            return (), (0.001, 0.01, 0.001)

        def calibration_learned(self):
            return (0.98, 0.001, 0.0, 0.002, 1.05, 0.0, 0.0, 0.0, 1.0)

    used, rows = scale_learned(Knows(), app.calibration)
    assert tuple(rows) == (0.98, 0.001, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    Knows.calibration_learned = lambda self: (0.999, 0.001, 0.0, 0.0, 1.05, 0.0, 0.0, 0.0, 1.0)
    assert scale_learned(Knows(), app.calibration) is None
    keep_learned(None, app.imu, scale=(TURNED, rows))
    assert stored().gyro_matrix == Calibration().gyro_matrix
    keep_learned(None, app.imu, scale=(used, rows))
    assert stored().gyro_matrix == tuple(rows)
    app.stop()
    port.__exit__(None, None, None)


def test_the_mounting_is_the_same_with_a_scale_in_it():
    from calibration import Calibration, multiply

    scaled = Calibration(gyro_matrix=multiply((0.97, 0, 0, 0, 1.03, 0, 0, 0, 1.01), TURNED))
    assert scaled.rotation() == pytest.approx(TURNED, abs=1e-5)
    assert scaled.mounting().accel_matrix == scaled.rotation()
    assert Calibration(gyro_matrix=TURNED).rotation() == TURNED

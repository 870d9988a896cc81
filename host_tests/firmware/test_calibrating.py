# SPDX-License-Identifier: MIT
"""Calibration at the REPL: its bars on the worst sensor, and its steps."""

import pytest

from tools.calibrate.virtual import measure, pose
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Sinusoid
from tools.virtual.port import Port


@pytest.mark.parametrize("seed, platform", [(1, "rp2"), (6, "esp32")])
def test_the_worst_sensor_after_six_faces_at_two_temperatures(seed, platform):
    found = measure(seed, platform)
    assert found["residual_mg"] < 2
    assert found["scale"] < 0.001
    assert max(found["tilt_deg"].values()) < 0.3
    assert (found["date"], found["who_am_i"]) == ("2026-01-01", 0x68)


def test_without_calibration_the_same_sensor_is_far_off():
    """So the bars above do measure something: 80 mg are 4.6 degrees."""
    from tools.virtual.chip.tolerances import worst_case

    bias = worst_case(1)["accel_bias_g"]
    assert max(abs(b) for b in bias) == pytest.approx(0.08)


@pytest.fixture
def steps(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chip = MPU6050Chip(seed=2)
    bus = Bus(chip)
    with Port("rp2", {0: bus}) as port:
        from firmware.app import App

        app = App()
        made = app.calibrating()
        made.rig = (port, chip, bus, app.imu)
        yield made


def test_a_moved_sensor_is_refused_with_the_reason(steps):
    port, chip, bus, _ = steps.rig
    bus.advance(port.now_ns)
    chip.set_motion(Sinusoid(20.0, 1.0), restart=True)
    with pytest.raises(ValueError, match=r"moved: .*deg/s"):
        steps.gyro(0.5)
    with pytest.raises(ValueError, match="moved: "):
        steps.pose(0.5)


def test_what_is_missing_is_named(steps):
    pose(steps.rig, 0, 0, 25.0)
    assert steps.pose(0.3) == "+z is up; not yet up: +x, +y, -x, -y, -z"
    with pytest.raises(ValueError, match="not yet up: "):
        steps.solve()


def test_the_mounting_is_found_on_a_slope(steps):
    """The sensor's y points forward; the table slopes by 3 degrees."""
    for sign in (1, -1):  # the robot turned by half a turn between the two readings
        pose(steps.rig, 3.0 * sign, 0, 25.0)
        said = steps.level(2, 0.3)
    assert said.startswith("level")
    pose(steps.rig, 30.0, 0, 25.0)  # y goes up
    assert steps.nose_up(0.3).startswith("forward is +y, up is +z")
    assert steps.save("2026-02-03") == "saved"
    from firmware.calibration import load_calibration

    cal, warnings = load_calibration()
    assert warnings == [] and cal.date == "2026-02-03"
    forward = cal.apply((0.0, 1.0, 0.0), (0.0, 0.0, 0.0))[0]
    assert forward == pytest.approx((1.0, 0.0, 0.0), abs=0.02)


def stored(**fields):
    """A calibration on the flash, as an earlier day left it."""
    from calibration import Calibration

    from firmware import calibration as keeping

    keeping.save_calibration(Calibration(**fields))
    return keeping.load_calibration


def test_the_gyro_alone_leaves_the_accelerometer_at_its_own_temperature(steps):
    load = stored(
        temp_c=10.0, accel_bias_g=(0.02, 0.0, 0.0), accel_slope_g_per_c=(0.001, 0.0, 0.0),
        gyro_slope_dps_per_c=(0.1, 0.0, 0.0), residual_mg=0.5, who_am_i=0x68,
    )  # fmt: skip
    again = type(steps)(steps._imu)
    pose(steps.rig, 0, 0, 25.0)
    again.gyro(0.5)
    again.save()
    cal, _ = load()
    assert cal.temp_c == 10.0
    assert cal.accel_bias_g == pytest.approx((0.02, 0.0, 0.0), abs=1e-6)
    assert cal.at(25.0).gyro_bias_dps == pytest.approx((0.0, 0.0, 0.0), abs=0.1)
    assert cal.gyro_bias_dps[0] == pytest.approx(-1.5, abs=0.1)  # 15 degC of 0.1 deg/s each


def test_of_another_parts_calibration_only_the_mounting_is_used(steps):
    turned = (0.0, 1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    stored(
        accel_bias_g=(0.2, 0.0, 0.0), gyro_bias_dps=(9.0, 0.0, 0.0), gyro_matrix=turned,
        accel_matrix=tuple(1.02 * v for v in turned), gyro_slope_dps_per_c=(0.1, 0.0, 0.0),
        residual_mg=0.5, who_am_i=0x70,
    )  # fmt: skip
    again = type(steps)(steps._imu)
    assert any("another kind of sensor" in text for text in again.warnings)
    cal = again.cal
    assert (cal.gyro_matrix, cal.accel_matrix) == (turned, turned)
    assert (cal.accel_bias_g, cal.gyro_bias_dps) == ((0.0,) * 3, (0.0,) * 3)
    assert cal.gyro_slope_dps_per_c == (0.0,) * 3


def test_what_was_learned_does_not_replace_another_parts_calibration(steps):
    from calibration import Calibration

    from firmware import calibration as keeping

    load = stored(accel_bias_g=(0.2, 0.0, 0.0), who_am_i=0x70)
    learned = Calibration(gyro_bias_dps=(1.0, 2.0, 3.0), temp_c=30.0)
    keeping.keep_learned(learned, steps._imu)
    assert load()[0].gyro_bias_dps == (0.0, 0.0, 0.0)
    load = stored(accel_bias_g=(0.2, 0.0, 0.0), who_am_i=0x68)
    keeping.keep_learned(learned, steps._imu)
    cal = load()[0]
    assert cal.gyro_bias_dps == (1.0, 2.0, 3.0)
    assert (cal.accel_bias_g, cal.temp_c) == ((0.2, 0.0, 0.0), 25.0)


def test_poses_that_do_not_fit_are_called_doubtful(steps):
    for roll, pitch in ((0, 0), (180, 0), (90, 0), (-90, 0), (0, -90)):
        pose(steps.rig, roll, pitch, 25.0)
        steps.pose(0.3)
    pose(steps.rig, 0, 83, 25.0)  # 7 degrees from square
    assert steps.pose(0.3).endswith("all faces have been up: solve()")
    assert "much is left" in steps.solve()
    assert steps.doubtful
    assert repr(steps).startswith("gyro(), pose()")

# SPDX-License-Identifier: MIT
"""The gyro's bias at rest: measured when the sensor is still, refused with the reason when not."""

import math

import numpy as np
import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Vibration


@pytest.mark.parametrize("kind", BUSES)
def test_gyro_bias_at_rest(kind):
    with rig(kind, MPU6050Chip(seed=3, gyro_bias_dps=(20, -18, 15))) as r:
        from calibration.rest import gyro_bias

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
        from calibration.rest import NotStill, gyro_bias

        imu = r.sensor(dlpf_hz=260)
        with pytest.raises(NotStill, match=why):
            gyro_bias(imu)


def test_a_dead_sensor_is_not_still():
    with rig() as r:
        from calibration.rest import NotStill, rest

        imu = r.sensor()
        r.fault("filled", value=0xFF)
        with pytest.raises(NotStill, match="no data"):
            rest(imu)


@pytest.mark.parametrize("dlpf_hz", (260, 44, 5))
def test_the_sensors_own_noise_is_not_movement(dlpf_hz):
    with rig("esp32", MPU6050Chip(seed=5)) as r:
        from calibration.rest import rest

        imu = r.sensor(dlpf_hz=dlpf_hz)
        r.wait_ms(500)
        for _ in range(5):
            rest(imu, 0.5)


def test_gyro_bias_over_temperature_is_learned_at_rests():
    from calibration import Calibration
    from calibration.thermal import BiasLearner

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

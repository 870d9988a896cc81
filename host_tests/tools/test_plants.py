# SPDX-License-Identifier: MIT
"""The plants obey physics, and the apps steer them: closed loop in virtual time."""

import math

import numpy as np
import pytest

from tools.plants import closed_loop
from tools.plants.balance import Balance, Robot
from tools.plants.platform import Base, Platform, ServoMotor
from tools.plants.quad import MOTORS, Quad

G = 9.80665


class Silent:
    """A Port whose pins carry nothing."""

    class _Pin:
        pwm = None

    def pin(self, _number):
        return self._Pin()


class Fixed(Silent):
    """A Port whose pins carry pulses of these microseconds at 400 Hz."""

    def __init__(self, pulses):
        self._pulses = pulses

    def pin(self, number):
        pin = self._Pin()
        u16 = self._pulses[number] * 400 * 65535 / 1e6

        class Pwm:
            history = ((0, 400, u16),)

        pin.pwm = Pwm()
        return pin


# --- physics ---


def energy(robot):
    """Kinetic and potential energy of the frictionless, unpowered robot, J."""
    m, length, r = robot.BODY_KG, robot.LENGTH_M, robot.WHEEL_M
    vx = robot.v + length * math.cos(robot.p) * robot.q
    vz = -length * math.sin(robot.p) * robot.q
    slip = robot.v / r - robot.q
    return (
        0.5 * m * (vx * vx + vz * vz) + 0.5 * robot.INERTIA * robot.q**2
        + 0.5 * robot.WHEELS_KG * robot.v**2 + 0.5 * robot.ROTORS * slip**2
        + m * G * length * math.cos(robot.p)
    )  # fmt: skip


def test_a_robot_without_motors_keeps_its_energy_as_it_falls(monkeypatch):
    monkeypatch.setattr(Robot, "torque", lambda self, drive: 0.0)
    robot = Robot(lean_deg=1.0)
    before = energy(robot)
    for _ in range(8000):
        robot.step(0.0, 1e-4)
    assert robot.p > math.radians(20)
    assert energy(robot) == pytest.approx(before, abs=2e-3)


def test_a_motor_on_the_stand_has_its_data_sheet_speed_and_torque():
    robot = Robot()
    assert robot.torque(1.0) == pytest.approx(2 * (1.4 - 0.03))
    robot.v = 330 / 60 * 2 * math.pi * 0.04
    assert robot.torque(1.0) == pytest.approx(-2 * 0.03)


def test_a_servo_takes_a_fifth_of_a_second_for_60_degrees_and_keeps_its_dead_band():
    servo = ServoMotor()
    for _ in range(20):
        servo.step(1502, 0.0005)
    assert servo.angle_deg == 0.0
    times = 0
    while servo.angle_deg < 40 and times < 2000:
        servo.step(2000, 0.0005)
        times += 1
    assert times * 0.0005 == pytest.approx(40 / 300, abs=0.03)
    at = servo.angle_deg
    for _ in range(400):
        servo.step(0, 0.0005)  # no pulse
    assert servo.angle_deg == pytest.approx(at, abs=4)


def test_the_base_moves_as_the_experiment_says():
    base = Base()
    angles = np.array([base.angles(4 + k / 200) for k in range(1000)])
    assert angles.max(axis=0) == pytest.approx([15, 15], abs=0.1)
    with_knock = [base.angles(9 + k / 200)[0] - Base(knock_deg=0).angles(9 + k / 200)[0]
                  for k in range(120)]
    assert max(with_knock) == pytest.approx(20, abs=0.1)


def test_the_plate_feels_gravity_and_turns_as_its_rates_say():
    plate = Platform(Silent(), (0, 1), Base(knock_deg=0), arm_m=0.0)
    angle = 0.0
    for k in range(1, 4001):
        ax, ay, az, gx, _, _, _ = plate.at(k / 1000)
        angle += gx / 1000
    assert math.hypot(math.hypot(ax, ay), az) == pytest.approx(1.0, abs=1e-6)
    roll, pitch = plate._base.angles(4.0)
    assert math.degrees(math.atan2(ay, az)) == pytest.approx(roll, abs=0.05)
    assert math.degrees(math.asin(-ax)) == pytest.approx(pitch, abs=0.05)


def test_a_quad_hovers_at_its_weight_and_feels_thrust_not_gravity():
    hover = math.sqrt(0.8 * G / 4 / 5.0)
    quad = Quad(Fixed([1000 + 1000 * hover * 1.05] * 4), range(4))
    quad.SHAKE_G = quad.SHAKE_DPS = quad.DRAG = 0.0
    sample = quad.at(1.0)
    assert quad.height_m > 0.1
    assert sample[:3] == pytest.approx((0, 0, 1.05**2), abs=0.02)
    resting = Quad(Fixed([1000 + 1000 * hover * 0.9] * 4), range(4))
    resting.SHAKE_G = 0.0
    assert resting.at(0.5)[2] == pytest.approx(1.0) and resting.height_m == 0.0


@pytest.mark.parametrize("motor", range(4))
def test_a_faster_motor_turns_the_frame_as_its_place_says(motor):
    pulses = [1700.0] * 4
    pulses[motor] = 1750.0
    quad = Quad(Fixed(pulses), range(4))
    quad.SHAKE_G = quad.SHAKE_DPS = 0.0
    _, _, _, gx, gy, gz, _ = quad.at(0.12)
    x, y, sense = MOTORS[motor]
    assert math.copysign(1, gx) == y and math.copysign(1, gy) == -x
    assert math.copysign(1, gz) == sense


# --- closed loops ---


def test_the_platform_holds_its_top_level_through_sway_and_knock():
    plant, _, stats = closed_loop.run(
        "platform", lambda port, pins: Platform(port, pins, Base(knock_at_s=4.5)), 5.5, seed=2,
        gyro_bias_dps=(1, -1, 2),
    )  # fmt: skip
    log = plant.log()
    counted = log["t_s"] > 3.5
    assert np.abs(log["base_roll"][counted]).max() > 15
    for name in ("top_roll", "top_pitch"):
        assert np.sqrt(np.mean(log[name][counted] ** 2)) < 1.0
        assert np.abs(log[name][counted]).max() < 4.0
    assert stats["output_errors"] == stats["errors"] == 0


def test_the_robot_stands_and_takes_a_push_of_ten_degrees():
    scale = ((1.02, 0, 0), (0, 1.02, 0), (0, 0, 1.02))
    plant, _, _ = closed_loop.run(
        "balance", lambda port, pins: Balance(port, pins, push=(4.0, 10.0, 0.06)), 7.8, seed=3,
        gyro_matrix=scale, accel_bias_g=(0.05,) * 3,
    )  # fmt: skip
    log = plant.log()
    pushed = (log["t_s"] > 4.0) & (log["t_s"] < 4.2)
    assert log["lean_deg"][pushed].max() > 9.5
    assert np.abs(log["lean_deg"]).max() < 20
    assert np.abs(log["lean_deg"][log["t_s"] > 7.2]).max() < 3


def test_the_robot_switches_off_when_it_has_fallen():
    plant, app, _ = closed_loop.run(
        "balance", lambda port, pins: Balance(port, pins, push=(2.5, 60.0, 0.3)), 3.5, seed=3
    )
    assert plant.fallen and not app.balance.running
    assert plant.log()["drive"][-1] == 0


def test_the_quad_flies_and_stops_without_a_pilot():
    seen = {}

    def pilot(app, t_s):
        quad = app.quad
        if t_s < 1.1:
            quad.command(300)
            return
        if "refused" not in seen:
            with pytest.raises(ValueError, match="throttle"):
                quad.arm(app)
            seen["refused"] = True
            quad.command(0)
            quad.arm(app)
        if t_s < 2.2:
            quad.command(680, roll_mdeg=10000 if t_s > 1.7 else 0)

    plant, app, _ = closed_loop.run("quad", Quad, 3.0, drive=pilot, seed=4)
    log = plant.log()
    flying = (log["t_s"] > 2.1) & (log["t_s"] < 2.3)
    assert log["roll_deg"][flying].mean() == pytest.approx(10, abs=2)
    assert abs(log["pitch_deg"][flying].mean()) < 2
    assert app.quad.link_lost == 1 and not app.quad.escs.armed
    assert log["m1"][-1] < 0.05

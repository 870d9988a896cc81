# SPDX-License-Identifier: MIT
"""The applications on the real firmware: cost of a step, heap, and the platform in closed loop."""

import numpy as np

from tools.experiments import on_board
from tools.plants.on_pico import PicoPins
from tools.plants.platform import Base, Platform
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico

OUTPUTS = (16, 17, 18, 19)  # servos and ESCs of a Pico, README's wiring

# the apps' updates with a real sensor and filter, but no loop under them
STEPS = """
import machine
from machine import PWM, Pin
from attitude.fixed import Attitude
from control import Escs, HBridge, Servo
from firmware.apps import balance, platform, quad
from firmware.config import Config
from mpu6050 import MPU6050

class App:
    imu = MPU6050(machine.I2C(0, scl=Pin(5), sda=Pin(4), freq=400000))
    filter = Attitude(rate_hz=1000)
    angles_mdeg, rates_mdps = filter.angles_mdeg, filter.rates_mdps
    period_us = 4000
    config = Config()

app = App()
pwms = [PWM(Pin(n)) for n in (16, 17, 18, 19)]
servos = platform.Platform(app, [Servo(p) for p in pwms[:2]])
servos._wait = 0
robot = balance.Balance(app, (HBridge(pwms[0], pwms[1]), HBridge(pwms[2], pwms[3])))
robot.armed = robot.running = True
app.period_us = 1000
copter = quad.Quad(app, Escs(pwms))
copter.command(500)
copter.escs.armed = True

def step():
    app.imu.read()
    app.filter.step(app.imu.counts)
    copter.update(app)

rows = [measure(step, 4)]
for part in (servos, robot):
    rows.append(measure(lambda: part.update(app), 4))
print(rows)
"""


def test_a_full_quad_step_in_less_than_900_us_and_no_app_allocates(pico):
    (step_us, used), *others = on_board.run(pico, STEPS)
    print(f"quad: burst, attitude, cascades, mixer, four PWM writes: {step_us} us")
    assert step_us < 900 and used == 0
    for name, (us, used) in zip(("platform", "balance"), others, strict=True):
        print(f"{name}.update: {us} us")
        assert used == 0 and us < 1000


def test_the_platform_in_closed_loop_on_the_emulated_board():
    chip = MPU6050Chip(seed=1, gyro_bias_dps=(1.0, -1.0, 0.5))
    with VirtualPico(bus=Bus(chip, log_length=1), root=True, main=False) as board:
        board.exec("from firmware.apps import platform\napp = platform.start()")
        moves_s = board.nanos * 1e-9 + 1.0  # for so long the platform lets the attitude settle
        base = Base(knock_deg=0, frequency_hz=0.8, rest_s=moves_s)
        plant = Platform(PicoPins(board), OUTPUTS, base)
        chip.set_motion(plant)
        board.run_ms(2600)
        stats = board.exec("print(app.stats()['errors'], app.outputs.failed)").split()
    log = plant.log()
    counted = log["t_s"] > moves_s
    assert np.abs(log["base_roll"][counted]).max() > 10
    assert np.abs(log["servo_roll"][counted]).max() > 10
    for name in ("top_roll", "top_pitch"):
        assert np.sqrt(np.mean(log[name][counted] ** 2)) < 1.0
        assert np.abs(log[name][counted]).max() < 4.0
    assert stats == ["0", "0"]

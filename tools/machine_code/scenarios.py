# SPDX-License-Identifier: MIT
"""Programs on a virtual board that make the project's viper and native functions work.

Filters get rest, motion and what no sensor should give; the app flies through faults; functions
of numbers and pointers get numbers and buffers at random as well.
"""

import contextlib
import os
import random
import tempfile
from array import array

from . import functions
from .at_random import at_random
from .recorder import Recorder
from .virtual import Bus, L3GD20Chip, LSM303Chip, MPU6050Chip, Port, faults, motion

LOW, HIGH = -32768, 32767
_FAULTS = ("nack", "stuck_data", "bit_flip", "filled", "saturation", "brown_out")


class Pwm:
    """What machine.PWM offers to motors and servos."""

    def __init__(self, pin=None, **_settings):
        self.hz = self.ns = self.u16 = 0

    def freq(self, hz):
        self.hz = hz

    def duty_ns(self, ns):
        self.ns = ns

    def duty_u16(self, u16):
        self.u16 = u16


class Skewed:
    """A calibration at the datasheet's worst, mounted askew."""

    gyro_bias_dps = (20.0, -20.0, 20.0)
    accel_bias_g = (0.08, -0.05, 0.08)
    gyro_matrix = accel_matrix = (-0.57, 0.02, 0.84, 0.84, 0.02, 0.59, 0.02, 1.03, -0.02)


def counts(rng, n):
    """n rows of ax ay az temp gx gy gz: rest, a turn, full scale in every way, noise."""
    rest = [[rng.randint(-3, 3), 40, 4096 + rng.randint(-3, 3), 0, 9, -9, 5] for _ in range(n)]
    turn = [[i % 4096, -i % 2048, 4096 - i % 4096, 0, 3 * i % 9000, -i, 900] for i in range(n)]
    spin = [[0, 0, 32700, 0, *[rng.choice((LOW + 20, HIGH - 20)) for _ in range(3)]]] * (n // 2)
    corners = [[rng.choice((LOW, HIGH, 0)) for _ in range(7)] for _ in range(n // 2)]
    noise = [[rng.randint(LOW, HIGH) for _ in range(7)] for _ in range(n // 2)]
    over = [[0, 0, LOW, 0, 0, 0, 0]] * n
    return rest + turn + rest + spin + corners + noise + over


def feed(filt, rows):
    words = array("h", [0] * 7)
    for row in rows:
        words[:] = array("h", row)
        filt.update(words)


def attitudes(port):
    """The filters of three axes, at their slowest and fastest, calibrated and not."""
    from attitude.fixed import Attitude, KalmanTilt2

    rng = random.Random(3)
    for make in (Attitude, KalmanTilt2):
        for rate_hz, gyro_dps, accel_g in ((80, 250, 2), (250, 500, 8), (1000, 2000, 16)):
            filt = make(rate_hz, gyro_dps, accel_g)
            feed(filt, counts(rng, 300))
            filt.calibrate(Skewed)
            filt.period_us = 1.04e6 / rate_hz
            filt.relevel()
            feed(filt, counts(rng, 120))
            words = array("h", [0, 0, 4096, 0, 50, -30, 20])
            for n in range(60):
                filt.update(words, 1000 * (n % 9 + 1))


def scalars(port):
    """The filters of one number, and those of the counts."""
    from attitude import fixed

    rng = random.Random(4)
    rows = counts(rng, 60)
    feed(fixed.LowPass(40, 1000), rows)
    feed(fixed.Notch(120, 1000, 0.5), rows)
    feed(fixed.AdaptiveNotch(40, 240, 1000, 20), rows)
    filters = fixed.Complementary(tau_s=0.5, rate_hz=250), fixed.Complementary(0.9, rate_hz=10)
    kalman, mean = fixed.Kalman1D(), fixed.MovingAverage(5)
    for row in rows:
        for filt in filters:
            filt.update(row[0] * 5, row[4] * 100)
        kalman.update(row[0] * 5, row[4])
        mean.update(row[0] * 100)


def control(port):
    """Controllers, mixer and motors."""
    from control import Escs, HBridge, Servo
    from control.fixed import PID, QuadControl

    rng = random.Random(5)
    escs = Escs([Pwm() for _ in range(4)])
    bridge, servo = HBridge(Pwm(), Pwm()), Servo(Pwm(), slew_dps=600.0)
    gains = [(1.5, 2.0, 0.02)] * 2 + [(3.0, 1.0, 0.0)]
    pids = [PID(2.0, 1.0, 0.1, 900), PID(-0.3, 0.0, 2.0, (0, 255), 1000, 4000, 0.01)]
    quad = QuadControl([6.0, 6.0, 3.0], gains)
    for n in range(300):
        wide = 10 ** rng.randint(1, 6)
        for pid in pids:
            pid.update(rng.randint(-wide, wide), rng.randint(-wide, wide))
        quad.target(*[rng.randint(-180000, 180000) for _ in range(3)])
        angles = array("i", [rng.randint(-180000, 180000) // (n % 7 + 1) for _ in range(3)])
        rates = array("h", [rng.randint(LOW, HIGH) // (n % 5 + 1) for _ in range(7)])
        quad.update(n * 4, angles, rates)
        if n == 100:
            escs.arm(0)
        escs.write(array("i", [rng.randint(-200, 1200) for _ in range(4)]))
        bridge.write(rng.randint(-1200, 1200))
        servo.write(rng.randint(-60000, 60000))
    bridge.stop()


def mathematics(port):
    """Integer functions where they are defined."""
    from attitude.fixed import intmath

    rng = random.Random(6)
    for n in range(400):
        size = 10 ** rng.randint(1, 4) * rng.randint(1, 6)
        x, y = rng.randint(-size, size), rng.randint(-size, size)
        intmath.atan2_mdeg(y, x * (n % 5 > 0))
        intmath.hypot(x, y)
        intmath.isqrt(rng.randrange(2 ** rng.randint(1, 31)) - 2)
        intmath.sin_q15(x * rng.randint(1, 9000))
        intmath.cos_q15(x * rng.randint(1, 9000))
        intmath.mul_q15(rng.randint(-(2**30), 2**30), rng.randint(-(2**15), 2**15))
        intmath.mul_q30(rng.randint(-(2**30), 2**30), rng.randint(-(2**30), 2**30))


def _fly(port, app):
    """Let a started app run, while the bus and the chip fail in many ways."""
    bus = next(iter(port.buses.values()))
    app.watch(1.0)
    app.zero_yaw()
    for i, name in enumerate(_FAULTS):
        at_s = port.now_ns * 1e-9 + 0.1 + 0.4 * i
        bus.faults.append(faults.make(name, at_s=at_s, for_s=0.15))
    app.watch(3.5)
    port.clock.hold(9_000_000)
    app.watch(0.5)
    app.stop()


def flight(port):
    """The app as it is, and with other knobs."""
    from firmware.app import App

    for knobs in ({}, {"filter": "kalman2", "burst": "blocking"}):
        app = App()
        for name, value in knobs.items():
            app.set(name, value)
        app.start()
        _fly(port, app)


def robots(port):
    """The three robots' controllers, on a table, with motors that take what they get."""
    port.machine.PWM = Pwm
    from firmware.apps import balance, platform, quad

    for kind in (balance, platform, quad):
        app = kind.start()
        if kind is quad:
            port.run_ms(1200)
            app.quad.arm(app)
            app.quad.command(300)
        _fly(port, app)


def queue(port):
    """The chip's own queue of samples."""
    import machine
    from mpu6050 import MPU6050
    from mpu6050.fifo import Fifo

    i2c = machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4), freq=400_000)
    for temp in (True, False):
        fifo = Fifo(MPU6050(i2c, dlpf_hz=184), temp)
        fifo.start()
        for _ in range(20):
            port.run_ms(5)
            fifo.read(lambda counts: None)


def other_chip(port):
    """Another maker's two chips."""
    import machine
    from minimu9 import MinIMU9

    i2c = machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4), freq=400_000)
    for gyro_dps, accel_g in ((250, 2), (2000, 16)):
        imu = MinIMU9(i2c, gyro_dps=gyro_dps, accel_g=accel_g)
        for _ in range(40):
            port.run_ms(3)
            imu.read()


def _one_chip(moving):
    return Bus(MPU6050Chip(moving, seed=3, gyro_bias_dps=(2.0, -1.5, 1.0)))


def _two_chips():
    return Bus(L3GD20Chip(motion.FreeMotion(4)), LSM303Chip(motion.FreeMotion(4)))


# program: what makes its board's bus, if it has one
PROGRAMS = {
    attitudes: None, scalars: None, control: None, mathematics: None, at_random: None,
    flight: lambda: _one_chip(motion.FreeMotion(2, rest_s=2.0)),
    robots: lambda: _one_chip(motion.Still(roll_deg=1.0)),
    queue: lambda: _one_chip(motion.FreeMotion(2, rest_s=2.0)),
    other_chip: _two_chips,
}  # fmt: skip


def record(programs=PROGRAMS):
    """Run programs; the Recorder that has their calls."""
    folders = {path.name for path in (functions.ROOT / "lib").iterdir()} | {"firmware", __name__}
    recorder = Recorder(folders)
    for program in programs:
        make_bus = PROGRAMS[program]
        buses = {0: make_bus()} if make_bus else {}
        with contextlib.ExitStack() as stack:
            root = stack.enter_context(tempfile.TemporaryDirectory())
            nowhere = stack.enter_context(open(os.devnull, "w"))
            stack.enter_context(contextlib.redirect_stdout(nowhere))
            port = Port("rp2", buses, wiring={0: (4, 5)}, root=root)
            recorder.attach(port)
            program(stack.enter_context(port))
            recorder.leave()
    recorder.close()
    return recorder

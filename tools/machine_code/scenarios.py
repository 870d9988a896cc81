# SPDX-License-Identifier: MIT
"""Programs on a virtual board that make the project's viper and native functions work: the app
and the robots through faults, other ways to get samples, and those of workouts and at_random.
"""

import contextlib
import importlib
import os
import tempfile

from . import functions
from .at_random import at_random
from .recorder import Recorder
from .virtual import Bus, L3GD20Chip, LSM303Chip, MPU6050Chip, Port, faults, motion
from .workouts import Pwm, attitudes, control, mathematics, scalars

_FAULTS = ("nack", "stuck_data", "bit_flip", "filled", "saturation", "brown_out")


def _fly(port, app, kinds):
    """Let a started app run, while the bus and the chip fail in some ways."""
    bus = next(iter(port.buses.values()))
    app.watch(1.0)
    app.zero_yaw()
    for i, name in enumerate(kinds):
        at_s = port.now_ns * 1e-9 + 0.1 + 0.4 * i
        bus.faults.append(faults.make(name, at_s=at_s, for_s=0.15))
    app.watch(0.4 * len(kinds) + 0.7)
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
        _fly(port, app, _FAULTS)


def _on_the_table(port, name):
    """One robot's controllers, level, with motors that take what they get."""
    port.machine.PWM = Pwm
    kind = importlib.import_module("firmware.apps." + name)
    app = kind.start()
    port.run_ms(1500)  # until it may begin
    if name == "quad":
        app.quad.arm(app)
        app.quad.command(300)
    _fly(port, app, _FAULTS[:1])


def balance(port):
    """The balancing robot."""
    _on_the_table(port, "balance")


def platform(port):
    """The stabilised platform."""
    _on_the_table(port, "platform")


def quad(port):
    """The quadcopter."""
    _on_the_table(port, "quad")


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


def _level():
    return _one_chip(motion.Still(roll_deg=1.0))


def _two_chips():
    return Bus(L3GD20Chip(motion.FreeMotion(4)), LSM303Chip(motion.FreeMotion(4)))


# program: what makes its board's bus, if it has one
PROGRAMS = {
    attitudes: None, scalars: None, control: None, mathematics: None, at_random: None,
    flight: lambda: _one_chip(motion.FreeMotion(2, rest_s=2.0)),
    balance: _level, platform: _level, quad: _level,
    queue: lambda: _one_chip(motion.FreeMotion(2, rest_s=2.0)),
    other_chip: _two_chips,
}  # fmt: skip


def record(programs=PROGRAMS):
    """Run programs; the Recorder that has their calls."""
    lib = {path.name for path in (functions.ROOT / "lib").iterdir()}
    recorder = Recorder(lib | {"firmware", Pwm.__module__})
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

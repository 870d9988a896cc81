# SPDX-License-Identifier: MIT
"""What the driver's tests on the emulated board share: a motion, set-up code, a way to ask."""

import ast
from contextlib import contextmanager
from pathlib import Path

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico

ROOT = Path(__file__).resolve().parents[2]
LIB = {
    path.relative_to(ROOT).as_posix(): path
    for package in ("calibration", "mpu6050")
    for path in (ROOT / "lib" / package).glob("*.py")
}


class Feel:
    """Always the same, with another value on each axis: g, deg/s; 31 degC."""

    duration_s = None

    def __init__(self, accel=(0.31, -1.07, 1.83), gyro=(97.0, -181.0, 239.0)):
        self.sample = (*accel, *gyro, 31.0)

    def at(self, t_s):
        return self.sample

    def truth(self, t_s):
        return (1.0, 0.0, 0.0, 0.0)


SETUP = """
import gc, time
from machine import I2C, Pin
from mpu6050 import MPU6050
i2c = I2C(0, freq=400_000, scl=Pin(5), sda=Pin(4))
imu = MPU6050(i2c)
time.sleep_ms(50)
def nop():
    pass
def us_of(function, before=nop, n=6):
    # microseconds of a call, net of an empty one
    def mean(function):
        total = 0
        for _ in range(n):
            before()
            begun = time.ticks_us()
            function()
            total += time.ticks_diff(time.ticks_us(), begun)
        return total / n
    return mean(function) - mean(nop)
def bytes_of(function, n=4):
    function()
    gc.collect()
    gc.disable()
    begun = gc.mem_alloc()
    for _ in range(n):
        function()
    used = gc.mem_alloc() - begun
    gc.enable()
    return used
"""


@contextmanager
def driver_board(micropython):
    """A board with the driver on its flash, `imu` made; its bus is `.bus`."""
    bus = Bus(MPU6050Chip(Feel(), noise=False))
    with VirtualPico(bus=bus, files=LIB, micropython=micropython) as pico:
        pico.exec(SETUP, timeout_s=5)
        yield pico


def value(board, code, last):
    """Run code on the board; the value of the expression `last`."""
    return ast.literal_eval(
        board.exec(code + "\nprint(repr((" + last + ")))", timeout_s=3).strip()
    )

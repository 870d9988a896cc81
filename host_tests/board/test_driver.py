# SPDX-License-Identifier: MIT
"""The driver under the real firmware on the emulated RP2040: values, microseconds, heap."""

import ast
from pathlib import Path

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.pico import VirtualPico

ROOT = Path(__file__).resolve().parents[2]
LIB = {path.relative_to(ROOT).as_posix(): path for path in (ROOT / "lib" / "mpu6050").glob("*.py")}


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


@pytest.fixture(scope="module")
def board():
    bus = Bus(MPU6050Chip(Feel(), noise=False))
    with VirtualPico(bus=bus, files=LIB) as pico:
        pico.exec(SETUP, timeout_s=5)
        pico.bus = bus
        yield pico


def value(board, code, last):
    """Run code on the board; the value of the expression `last`."""
    return ast.literal_eval(
        board.exec(code + "\nprint(repr((" + last + ")))", timeout_s=3).strip()
    )


def test_values_are_those_of_the_motion(board):
    accel, gyro, temp = value(board, "imu.read()", "imu.accel_g(), imu.gyro_dps(), imu.temp_c()")
    assert accel == pytest.approx((0.31, -1.07, 1.83), abs=1 / 4096)
    assert gyro == pytest.approx((97.0, -181.0, 239.0), abs=1 / 65.5)
    assert temp == pytest.approx(31.0, abs=1 / 340)


def test_all_ways_to_fetch_agree_in_one_transaction_each(board):
    board.bus.log.clear()
    code = """
way = []
imu.read(); way.append(list(imu.counts))
for i in range(7): imu.counts[i] = 0
imu.start(); time.sleep_ms(1); arrived = imu.collect(); way.append(list(imu.counts))
plain = bytearray(14); i2c.readfrom_mem_into(0x68, 0x3B, plain)
way.append([int.from_bytes(plain[i:i + 2], 'big') for i in range(0, 14, 2)])
way[2] = [w - 65536 if w > 32767 else w for w in way[2]]
"""
    arrived, ways = value(board, code, "(arrived, way)")
    assert arrived
    assert ways[0] == ways[1] == ways[2] != [0] * 7
    assert [(t.written, len(t.read), t.outcome) for t in board.bus.log] == [
        (b"\x3b", 14, "ok")
    ] * 3


def test_times(board):
    """The bus alone takes 386 us at 399 kHz; start() and collect() leave it to the block."""
    code = """
def done():
    time.sleep_us(600)
    imu.collect()
def begun():
    imu.start()
    time.sleep_us(600)
times = us_of(imu.read), us_of(imu.start, done), us_of(imu.collect, begun)
imu.collect()
check = us_of(imu.check)
"""
    (read, start, collect), check = value(board, code, "(times, check)")
    assert 386 < read < 450
    assert start < 13
    assert collect < 24
    assert check < 260


def test_nothing_is_allocated(board):
    code = """
def split():
    imu.start()
    while not imu.collect():
        pass
def check():
    imu.check()
    imu.plausible()
used = bytes_of(imu.read), bytes_of(split), bytes_of(check)
import micropython
micropython.heap_lock()
try:
    split(); imu.read(); check(); imu.start(); imu.check(); locked = imu.collect()
finally:
    micropython.heap_unlock()
"""
    assert value(board, code, "(used, locked)") == ((0, 0, 0), True)


def test_blocking_calls_and_a_burst_under_way(board):
    code = """
imu.start(); imu.start(); imu.check(); first = imu.collect()
imu.start(); imu.read(); second = imu.collect()
third = imu.collect(); time.sleep_ms(1); fourth = imu.collect()
imu.start(); imu.set_range(gyro_dps=1000); fifth = imu.collect()
imu.set_range(gyro_dps=500)
"""
    answers = value(board, code, "(first, second, third, fourth, fifth)")
    assert answers == (True, True, False, True, True)


FAIL = """
def errno_of(function):
    try:
        return function()
    except OSError as error:
        return -error.args[0]
imu.start(); time.sleep_ms(2)
errors = [errno_of(imu.collect), %s]
"""


def _during(board, fault, code, last, ms=40):
    """The same while a fault lasts, which is over when it returns."""
    until = board.nanos + ms * 1e6
    board.bus.faults.append(make(fault, at_s=board.nanos * 1e-9, for_s=ms * 1e-3))
    result = value(board, code, last)
    assert board.nanos < until, "the fault ended too early"
    board.run_ms((until - board.nanos) * 1e-6 + 1)
    board.bus.faults.clear()
    return result


def test_a_nack_is_eio(board):
    assert _during(board, "nack", FAIL % "errno_of(imu.read)", "errors") == [-5, -5]
    assert value(board, "imu.start(); time.sleep_ms(1)", "imu.collect()")


def test_a_stuck_bus_is_etimedout(board):
    assert _during(board, "timeout", FAIL % "", "errors") == [-110]
    assert value(board, "imu.read(); imu.start(); time.sleep_ms(1)", "imu.collect()")


def test_construction_names_what_is_wrong(board):
    code = """
def text_of(**settings):
    try:
        MPU6050(i2c, **settings)
    except (OSError, ValueError) as error:
        return error.args[-1]
"""
    wrong = value(board, code, "text_of(address=0x69)")
    assert "no answer at 0x69 (EIO)" in wrong
    assert "answers at 0x68: AD0 is wired low" in wrong
    assert "choose one of [250, 500, 1000, 2000]" in value(board, "", "text_of(gyro_dps=300)")
    absent = _during(board, "nack", code, "text_of()")
    assert "Nothing answers on this bus" in absent


def test_fifo_at_one_kilohertz_without_a_byte(board):
    code = """
from mpu6050.fifo import Fifo
imu.set_range(accel_g=8)
fifo = Fifo(imu)
seen = 0
def count(counts):
    global seen
    seen += 1
fifo.start()
read = fifo.read
gc.collect(); gc.disable(); used = gc.mem_alloc()
while read(count) > 1:
    pass
seen = 0; begun = time.ticks_us()
for _ in range(6):
    time.sleep_ms(4)
    read(count)
took = time.ticks_diff(time.ticks_us(), begun)
used = gc.mem_alloc() - used; gc.enable()
imu.read()
same = list(fifo.counts) == list(imu.counts)
fifo.stop()
"""
    seen, took, used, same, bad = value(
        board, code, "(seen, took, used, same, (fifo.overflows, fifo.misaligned))"
    )
    # what came during the last read waits for the next one
    assert took / 1000 - 7 < seen < took / 1000 + 1
    assert (used, same, bad) == (0, True, (0, 0))


def test_calibration_runs_on_the_board(board):
    """The small solvers in single precision, and the numbers through JSON."""
    code = """
import json
from mpu6050 import solve, mounting
from mpu6050.calibration import Calibration
faces = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
M = ((1.03, 0.02, -0.02), (-0.02, 0.97, 0.02), (0.02, -0.02, 1.03)); b = (0.08, -0.08, 0.08)
def reads(f):
    return tuple([sum([M[i][j] * f[j] for j in range(3)]) + b[i] for i in range(3)])
bias, matrix, residual = solve.from_faces([reads(f) for f in faces], faces)
cal = Calibration(accel_bias_g=bias, accel_matrix=matrix, residual_mg=1000 * residual)
cal = cal.mounted(mounting.from_tilt((0, 0, 1), (-0.5, 0, 0.8660254)))
cal = Calibration.from_dict(json.loads(json.dumps(cal.to_dict())))
try:
    Calibration.from_dict({"gyro_bias_dps": [1, 2, float("nan")]}); why = ""
except ValueError as error:
    why = str(error)
faces += [(0.6, 0.8, 0), (0, -0.6, 0.8), (-0.8, 0, -0.6), (0.48, 0.6, -0.64)]
b2, m2, r2 = solve.from_rest([reads(f) for f in faces])
"""
    got, why, found = value(board, code, "(cal.apply(reads((0.6, 0, 0.8)), (1, 2, 3)), why, b2)")
    assert got[0] == pytest.approx((-0.6, 0.0, 0.8), abs=1e-4)
    assert got[1] == pytest.approx((-1, -2, 3), abs=1e-5)
    assert "gyro_bias_dps is beyond" in why
    assert found == pytest.approx((0.08, -0.08, 0.08), abs=3e-3)


def test_gyro_bias_self_test_and_offsets_on_the_board(board):
    board.bus.devices[0].set_motion(Feel((0.0, 0.0, 1.0), (3.0, -2.0, 1.0)))
    code = """
from mpu6050 import calibrate, offsets, selftest
time.sleep_ms(50)
cal = calibrate.gyro_bias(imu, seconds=0.04)
selftest._SAMPLES = 10
axes = selftest.self_test(imu)
offsets.shift_gyro(imu, -3, 2, -1)
time.sleep_ms(50); imu.read()
"""
    last = "(cal.gyro_bias_dps, selftest.passed(axes), imu.gyro_dps())"
    bias, good, gyro = value(board, code, last)
    assert bias == pytest.approx((3.0, -2.0, 1.0), abs=0.02)
    assert good
    assert gyro == pytest.approx((0, 0, 0), abs=0.05)

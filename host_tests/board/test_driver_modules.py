# SPDX-License-Identifier: MIT
"""FIFO, calibration, self-test and offsets under the real firmware on the emulated RP2040."""

import math

import pytest

from host_tests.board.driver_rig import Feel, driver_board, value


@pytest.fixture(scope="module")
def board(micropython):
    with driver_board(micropython) as pico:
        yield pico


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
from calibration import solve, mounting
from calibration import Calibration
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
b2, m2, r2 = solve.from_rest([reads(f) for f in faces])
"""
    got, why, found = value(board, code, "(cal.apply(reads((0.6, 0, 0.8)), (1, 2, 3)), why, b2)")
    assert got[0] == pytest.approx((-0.6, 0.0, 0.8), abs=1e-4)
    assert got[1] == pytest.approx((-1, -2, 3), abs=1e-5)
    assert "gyro_bias_dps is beyond" in why
    assert found == pytest.approx((0.08, -0.08, 0.08), abs=6e-3)


class Lying(Feel):
    """At rest; data that do not change at all are none."""

    def at(self, t_s):
        *felt, z_dps, temp_c = super().at(t_s)
        return (*felt, z_dps + 0.04 * math.sin(400 * t_s), temp_c)


def test_gyro_bias_self_test_and_offsets_on_the_board(board):
    board.bus.devices[0].set_motion(Lying((0.0, 0.0, 1.0), (3.0, -2.0, 1.0)))
    code = """
from calibration import rest, thermal
from mpu6050 import motion, offsets, selftest
time.sleep_ms(50)
cal = rest.gyro_bias(imu, seconds=0.02)
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

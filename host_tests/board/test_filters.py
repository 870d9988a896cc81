# SPDX-License-Identifier: MIT
"""The papers' filters in the board's single precision, on the real firmware."""

import numpy as np
import pytest
from attitude import KalmanTilt, accel_tilt_deg

from tools import recordings
from tools.virtual.pico import VirtualPico

NAME = "02_undisturbed_slow_rotation_B.npz"
EACH = 30  # the emulated board takes 0.02 s of a PC's time for an update
DT_S = EACH / 285.714
LSB_PER_DPS = 65.5  # +-500 dps

PROGRAM = """
from array import array
from attitude import KalmanTilt, accel_tilt_deg
filt = KalmanTilt()
row = bytearray(8)
out = array("f", bytes(4 * {n}))
import struct
with open("/minute.bin", "rb") as f:
    for k in range({n}):
        f.readinto(row)
        ax, ay, az, gx = struct.unpack("<4h", row)
        angle = accel_tilt_deg(ax / 4096, ay / 4096, az / 4096)[0]
        out[k] = filt.update(angle, gx / 65.5, {dt})
import binascii
for k in range(0, len(out), 64):
    print(binascii.hexlify(out[k:k + 64]).decode())
print(filt.bias_dps)
"""


def minute():
    """(ax, ay, az, gx) counts of a recorded minute, every EACHth sample."""
    counts = recordings.load(recordings.EXCERPTS / NAME).counts(gyro_dps=500, accel_g=8)
    return np.ascontiguousarray(counts[: 60 * 286 : EACH, [0, 1, 2, 4]], dtype="<i2")


@pytest.fixture(scope="module")
def recorded():
    return minute()


@pytest.fixture(scope="module")
def pico(recorded):
    with VirtualPico(root=True, main=False, files={"/minute.bin": recorded.tobytes()}) as board:
        yield board


def reference(rows):
    """KalmanTilt in double precision, as matrices (paper 000, eqs. 6-14), in numpy."""
    f, b = np.array([[1, -DT_S], [0, 1]]), np.array([DT_S, 0])
    h, q = np.array([[1.0, 0.0]]), np.diag([0.001, 0.003]) * DT_S
    x, p, out = np.zeros(2), np.zeros((2, 2)), []
    for _, ay, az, gx in rows.astype(float):
        x = f @ x + b * gx / LSB_PER_DPS
        p = f @ p @ f.T + q
        k = p @ h.T / (p[0, 0] + 0.03)
        miss = np.degrees(np.arctan2(ay, az)) - x[0]
        x = x + k[:, 0] * ((miss + 180) % 360 - 180)
        x[0] = (x[0] + 180) % 360 - 180
        p = (np.eye(2) - k @ h) @ p
        out.append(x)
    return np.array(out)


def test_kalman_tilt_over_a_minute_within_a_hundredth_of_a_degree(pico, recorded):
    n = len(recorded)
    lines = pico.exec(PROGRAM.format(n=n, dt=DT_S), timeout_s=60).split()
    got = np.frombuffer(bytes.fromhex("".join(lines[:-1])), dtype="<f4")
    expected = reference(recorded)
    assert len(got) == n and np.ptp(expected[:, 0]) > 60
    difference = np.abs((got - expected[:, 0] + 180) % 360 - 180)
    print("largest difference %.6f deg" % difference.max())
    assert difference.max() < 0.01
    assert float(lines[-1]) == pytest.approx(expected[-1, 1], abs=0.01)
    # the same class on the PC, for the tests that take its place
    filt = KalmanTilt()
    host = [
        filt.update(accel_tilt_deg(ax, ay, az)[0], gx / LSB_PER_DPS, DT_S)
        for ax, ay, az, gx in recorded.tolist()
    ]
    assert np.abs((host - expected[:, 0] + 180) % 360 - 180).max() < 1e-9


def test_each_name_is_there_and_a_wrong_one_is_an_attribute_error(pico):
    assert pico.exec(
        """
import attitude
names = "Complementary Kalman1D KalmanTilt MovingAverage KalmanND GyroIntegral accel_tilt_deg"
names += " tilt_asin_deg tilt_atan_deg tilt_two_axes_deg wrap_deg yaw_transfer_deg"
print([n for n in names.split() if not callable(getattr(attitude, n))])
try:
    attitude.Nonsense
except AttributeError as error:
    print(error)
"""
    ).splitlines() == ["[]", "attitude has no Nonsense"]


def test_absurd_input_in_single_precision(pico):
    assert pico.exec(
        """
from attitude import Complementary, Kalman1D, KalmanTilt, MovingAverage
from attitude import accel_tilt_deg, tilt_asin_deg, tilt_atan_deg, tilt_two_axes_deg
bad = []
for form in (accel_tilt_deg, tilt_asin_deg, tilt_atan_deg, tilt_two_axes_deg):
    if form(0.0, 0.0, 0.0) != (0, 0):
        bad.append(form)
    for k in range(40):
        roll, pitch = form(0.003 + k * 0.1, 1e-5, 0.0)
        if not -180 <= roll <= 180 or not -180 <= pitch <= 180:
            bad.append((form, k))
for make in (Complementary, KalmanTilt):
    f = make()
    for _ in range(15):
        f.update(10.0, 0.0, 0.004)
    before = f.angle_deg
    f.update(float("nan"), 0.0, 0.004)
    f.update(10.0, float("inf"), 0.004)
    if abs(f.angle_deg - before) > 0.5:
        bad.append(make)
m = MovingAverage(3)
for v in (1.0, float("nan"), 3.0):
    m.update(v)
print(bad, m.mean)
"""
    ).split() == ["[]", "2.0"]


def test_kalman_nd_on_the_board(pico):
    lines = pico.exec(
        """
from attitude import KalmanND
import time
k = KalmanND([[1.0, 0.1], [0.0, 1.0]], [[1.0, 0.0]], [[1e-4, 0.0], [0.0, 1e-3]], [[9.0]],
             B=[[0.005], [0.1]], P=[[9.0, 0.0], [0.0, 1.0]])
for i in range(6):
    k.predict([0.5])
    began = time.ticks_us()
    k.correct([float(i)])
print(k.x[0], k.x[1], time.ticks_diff(time.ticks_us(), began))
"""
    ).split()
    from attitude import KalmanND

    k = KalmanND(
        [[1.0, 0.1], [0.0, 1.0]], [[1.0, 0.0]], [[1e-4, 0.0], [0.0, 1e-3]], [[9.0]],
        B=[[0.005], [0.1]], P=[[9.0, 0.0], [0.0, 1.0]],
    )  # fmt: skip
    for i in range(6):
        k.predict([0.5])
        k.correct([float(i)])
    assert [float(x) for x in lines[:2]] == pytest.approx(k.x, rel=1e-4)
    print("correct() of two states: %s us" % lines[2])


def test_integer_controllers_equal_the_pc_and_allocate_nothing(pico):
    code = """
from array import array
from control import fixed
pid = fixed.PID(0.02, 0.05, 0.0015, 900, tau_d_s=0.01)
gains = ((1.2, 0.8, 0.02), (1.1, 0.6, 0.015), (2.0, 1.0, 0.0))
quad = fixed.QuadControl((6.0, 5.0, 3.0), gains, 900)
quad.target(10000, -20000, 179000)
counts = array("h", [0] * 7)
angle = array("i", [0] * 3)
log = array("i", [0] * {n})
x = 1
for k in range({n}):
    x = (x * 1103 + 12345) % 65536  # small ints on every machine
    for axis in range(3):
        counts[4 + axis] = ((x >> axis) & 0x3FFF) - 8192
        angle[axis] = ((x << axis) % 360000) - 180000
    lock()
    quad.update(x & 1023, angle, counts)
    out = pid.update(angle[0], counts[4])
    unlock()
    log[k] = out + quad.motors[0] * 1000 + quad.motors[3] * 7 + quad.torque[2]
print(list(log))
"""
    n = 30
    board = pico.exec(
        "from micropython import heap_lock as lock, heap_unlock as unlock\n" + code.format(n=n)
    )
    printed = []
    exec(code.format(n=n), {"lock": int, "unlock": int, "print": printed.append})
    assert board.strip() == str(printed[0])

# SPDX-License-Identifier: MIT
"""The chip's built-in self-test: it pushes its own proof masses and we compare with its memory.

response = output with the test on - output with it off; the factory stored what it measured as
5-bit codes. RM p. 9-11 for the MPU6050 (passed within 14 %, PS p. 12-13); relatives with the
formula of the MPU-6500 (its self-test note AN-MPU-6500A-02: within 50 %).
"""

import time
from collections import namedtuple

from micropython import const

_GYRO_TEST_6500 = const(0x00)  # SELF_TEST_X_GYRO and two more
_SELF_TEST_X = const(0x0D)  # XA_TEST[4-2] [7:5], XG_TEST [4:0]; y and z follow
_GYRO_CONFIG = const(0x1B)  # XG_ST YG_ST ZG_ST [7:5]
_ACCEL_CONFIG = const(0x1C)  # XA_ST YA_ST ZA_ST [7:5]

_SETTLE_MS = const(300)  # nine time constants of the slowest filter row
_SAMPLES = const(100)
_NAMES = ("ax", "ay", "az", "gx", "gy", "gz")

# response and trim in counts of the test's ranges; change = (response - trim) / trim, None when
# the chip holds no trim (code 0, a clone)
Axis = namedtuple("Axis", ("name", "response", "trim", "change", "passed"))


def self_test(imu):
    """The six Axis results of the sensor, which must be at rest; takes 1 s. OSError.

    Ranges and test bits are as before when it returns, also after an error.
    """
    gyro, accel = imu.gyro_range_dps, imu.accel_range_g
    genuine = imu.profile.motion
    try:
        imu.set_range(250, 8 if genuine else 2)
        still = _mean(imu)
        imu.set_bits(_GYRO_CONFIG, 0xE0, 0xE0)
        imu.set_bits(_ACCEL_CONFIG, 0xE0, 0xE0)
        pushed = _mean(imu)
    finally:
        imu.set_bits(_GYRO_CONFIG, 0, 0xE0)
        imu.set_bits(_ACCEL_CONFIG, 0, 0xE0)
        imu.set_range(gyro, accel)
        time.sleep_ms(_SETTLE_MS)
    trims = _trims(imu) if genuine else _trims_6500(imu)
    limit = 0.14 if genuine else 0.5
    return [
        _judge(name, on - off, trim, limit)
        for name, on, off, trim in zip(_NAMES, pushed, still, trims)
    ]


def passed(axes):
    """True when every axis has moved as the factory measured it; False without factory trim."""
    return all(axis.passed for axis in axes)


def _judge(name, response, trim, limit):
    if not trim:
        return Axis(name, response, 0.0, None, False)
    change = (response - trim) / trim
    return Axis(name, response, trim, change, abs(change) <= limit)


def _mean(imu):
    time.sleep_ms(_SETTLE_MS)
    sums = [0] * 7
    for _ in range(_SAMPLES):
        imu.read()
        for i in range(7):
            sums[i] += imu.counts[i]
        time.sleep_ms(2)
    del sums[3]
    return [s / _SAMPLES for s in sums]


def _trims(imu):
    """Factory trim in counts at 8 g and 250 dps, ax to gz."""
    x, y, z, low = _bytes(imu, _SELF_TEST_X, 4)
    accel = (
        x >> 5 << 2 | low >> 4 & 3,
        y >> 5 << 2 | low >> 2 & 3,
        z >> 5 << 2 | low & 3,
    )
    trims = [4096 * 0.34 * (0.92 / 0.34) ** ((c - 1) / 30) if c else 0.0 for c in accel]
    for sign, byte in ((25, x), (-25, y), (25, z)):
        code = byte & 0x1F
        trims.append(sign * 131 * 1.046 ** (code - 1) if code else 0.0)
    return trims


def _trims_6500(imu):
    """The same for the MPU-6500's relatives, at 2 g and 250 dps."""
    codes = list(_bytes(imu, _SELF_TEST_X, 3)) + list(_bytes(imu, _GYRO_TEST_6500, 3))
    return [2620 * 1.01 ** (code - 1) if code else 0.0 for code in codes]


def _bytes(imu, register, n):
    buffer = bytearray(n)
    imu.load(register, buffer)
    return buffer

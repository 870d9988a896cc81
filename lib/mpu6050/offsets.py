# SPDX-License-Identifier: MIT
"""The chip's offset registers: it adds them to every sample, until power-off.

For other programs' sake, or for the FIFO and motion engine, that see samples ahead of any
software; a `Calibration` does more and is kept. Units at any range: gyro 32.8 counts per deg/s,
accelerometer 2048 counts per g with bit 0 reserved (it must keep its value).
"""

from micropython import const

_XG_OFFS_USRH = const(0x13)  # y and z follow, high byte first
_GYRO_LSB_PER_DPS = const(32.8)
_ACCEL_LSB_PER_G = const(2048)


def shift_gyro(imu, x_dps, y_dps, z_dps):
    """Add these rates to all later samples (pass the negated bias). ValueError, OSError."""
    shifts = [round(v * _GYRO_LSB_PER_DPS) for v in (x_dps, y_dps, z_dps)]
    for i, shift in enumerate(shifts):
        register = _XG_OFFS_USRH + 2 * i
        _store(imu, register, _load(imu, register) + shift)


def shift_accel(imu, x_g, y_g, z_g):
    """Add these accelerations to all later samples, on top of the factory's. As shift_gyro()."""
    step = 2 if imu.profile.accel_offsets == 0x06 else 3  # 0x77, 0x7A, 0x7D on the relatives
    for i, shift in enumerate((x_g, y_g, z_g)):
        register = imu.profile.accel_offsets + step * i
        old = _load(imu, register)
        # two counts a step, so that bit 0 stays
        _store(imu, register, old + 2 * round(shift * _ACCEL_LSB_PER_G / 2))


def _load(imu, register):
    pair = bytearray(2)
    imu.load(register, pair)
    value = pair[0] << 8 | pair[1]
    return value - 65536 if value > 32767 else value


def _store(imu, register, value):
    if not -32768 <= value <= 32767:
        raise ValueError("offset %d of register 0x%02X is beyond 16 bits" % (value, register))
    imu.store(register, value >> 8 & 0xFF)
    imu.store(register + 1, value & 0xFF)
    if _load(imu, register) != value:
        raise OSError(5, "MPU6050: offset register 0x%02X did not take %d" % (register, value))

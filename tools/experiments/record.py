# SPDX-License-Identifier: MIT
"""A record of the virtual sensor: what a program would have read, and the truth beside it."""

import struct

import numpy as np
from attitude.counts import Ideal

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip, registers
from tools.virtual.motion import quaternions

LSB_PER_G = 4096  # +-8 g, papers 001 and 004
LSB_PER_DPS = 65.5  # +-500 deg/s
ADDRESS = 0x68
DLPF = {260: 0, 184: 1, 94: 2, 44: 3, 21: 4, 10: 5, 5: 6}
SETTLE_S = 0.5  # the gyro's start-up and the filters are over before the record begins


class Record:
    """t_s (n), counts (n x 7, as the registers), accel_g and gyro_dps (n x 3), roll/pitch_deg (n).

    Rows are `dt_s` apart.
    """

    def __init__(self, dt_s, counts, truth):
        self.dt_s = dt_s
        self.counts = np.array(counts, dtype=np.int16)
        self.t_s = np.arange(len(counts)) * dt_s
        self.accel_g = self.counts[:, :3] / LSB_PER_G
        self.gyro_dps = self.counts[:, 4:] / LSB_PER_DPS
        self.roll_deg, self.pitch_deg = np.array(truth).T

    def roll_rows(self):
        """(accelerometer's roll angle, gyro x) row by row, what a one-axis filter takes."""
        angle = np.degrees(np.arctan2(self.accel_g[:, 1], self.accel_g[:, 2]))
        return np.column_stack([angle, self.gyro_dps[:, 0]]).tolist()

    def bias_corrected(self, samples):
        """A copy whose gyro has the mean of its first samples taken off, as the papers do."""
        copy = Record.__new__(Record)
        copy.__dict__.update(self.__dict__)
        copy.gyro_dps = self.gyro_dps - self.gyro_dps[:samples].mean(axis=0)
        return copy

    def offset(self, samples):
        """The same as a calibration for an integer filter."""
        return _Offset(tuple(self.gyro_dps[:samples].mean(axis=0).tolist()))


class _Offset(Ideal):
    def __init__(self, gyro_bias_dps):
        self.gyro_bias_dps = gyro_bias_dps


class _Later:
    """A motion that starts after the sensor has settled."""

    def __init__(self, motion):
        self.motion = motion
        self.duration_s = motion.duration_s

    def at(self, t_s):
        return self.motion.at(max(0.0, t_s - SETTLE_S))

    def truth(self, t_s):
        return self.motion.truth(max(0.0, t_s - SETTLE_S))


def record(motion, samples, rate_hz=250, dlpf_hz=44, seed=0, **chip):
    """Read `samples` bursts at rate_hz from the chip model at +-8 g and +-500 deg/s."""
    device = MPU6050Chip(motion=_Later(motion), seed=seed, **chip)
    bus = Bus(device, log_length=1)

    def write(register, *values):
        bus.start(ADDRESS, False)
        for value in (register, *values):
            bus.write(value)
        bus.stop()

    write(registers.PWR_MGMT_1, 1)
    write(registers.CONFIG, DLPF[dlpf_hz])
    write(registers.GYRO_CONFIG, 0x08, 0x10)
    counts, truth = [], []
    for k in range(samples):
        t_s = SETTLE_S + (k + 1) / rate_hz
        bus.advance(round(t_s * 1e9))
        bus.start(ADDRESS, False)
        bus.write(registers.ACCEL_XOUT_H)
        bus.start(ADDRESS, True)
        counts.append(struct.unpack(">7h", bytes(bus.read(i == 13) for i in range(14))))
        bus.stop()
        truth.append(tilt_deg(motion.truth((k + 1) / rate_hz)))
    return Record(1 / rate_hz, counts, truth)


def tilt_deg(q):
    """(roll, pitch) in degrees of a quaternion, sensor to earth."""
    x, y, z = quaternions.gravity(q)
    return np.degrees(np.arctan2(y, z)), np.degrees(np.arctan2(-x, np.hypot(y, z)))


def rms(values):
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))

# SPDX-License-Identifier: MIT
"""What the factory burnt into one part: self-test codes and accelerometer offsets."""

import numpy as np

from tools.virtual.chip.profiles import trim_dps, trim_g
from tools.virtual.chip.registers import SELF_TEST_A, SELF_TEST_X


class FactoryTrim:
    """Codes from `seed`, or `codes` = ((gyro x, y, z), (accel x, y, z)), 0..31 on an MPU6050.

    `error` is the fraction by which the part's response differs from its trim.
    """

    def __init__(self, profile, seed=0, codes=None, error=0.0):
        random = np.random.default_rng([seed, 0x6050])
        drawn = tuple(tuple(int(c) for c in random.integers(8, 24, 3)) for _ in range(2))
        self.gyro_codes, self.accel_codes = drawn if codes is None else codes
        self.accel_offsets = tuple(int(v) for v in random.integers(-3000, 3000, 3))
        self.gyro_dps = tuple(v * (1 + error) for v in trim_dps(profile, self.gyro_codes))
        self.accel_g = tuple(v * (1 + error) for v in trim_g(profile, self.accel_codes))
        self._profile = profile

    def load(self, registers):
        """Put the factory values where a reset puts them."""
        gyro, accel = self.gyro_codes, self.accel_codes
        if self._profile.self_test == "6050":
            for axis in range(3):
                registers[SELF_TEST_X + axis] = (accel[axis] >> 2) << 5 | gyro[axis]
                registers[SELF_TEST_A] |= (accel[axis] & 3) << (4 - 2 * axis)
        else:
            registers[0:3] = bytes(gyro)
            registers[SELF_TEST_X : SELF_TEST_X + 3] = bytes(accel)
        for address, value in zip(self._profile.accel_offsets, self.accel_offsets):
            registers[address : address + 2] = (value & 0xFFFF).to_bytes(2, "big")

# SPDX-License-Identifier: MIT
"""All that comes from tools.virtual."""

from tools.virtual import Bus, MPU6050Chip, Port, faults, motion
from tools.virtual.chip.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.viper import address_space

__all__ = [
    "Bus", "L3GD20Chip", "LSM303Chip", "MPU6050Chip", "Port", "address_space", "faults", "motion",
]  # fmt: skip

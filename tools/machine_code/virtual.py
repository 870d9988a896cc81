# SPDX-License-Identifier: MIT
"""All that comes from tools.virtual, by its present places."""

from tools.virtual import faults, motion
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.port import Port
from tools.virtual.port.viper import address_space

__all__ = [
    "Bus", "L3GD20Chip", "LSM303Chip", "MPU6050Chip", "Port", "address_space", "faults", "motion",
]  # fmt: skip

# SPDX-License-Identifier: MIT
"""The robot stands level here: one pose at the REPL, app.level_here()."""

from calibration import IDENTITY, mounting
from calibration.rest import rest

from firmware.calibration import load_for


def level(imu, path):
    """The stored Calibration, its mounting turned by what the tilt still is. NotStill says how it
    moved."""
    stored = load_for(imu, path)[0]
    still = rest(imu, 1.0)
    up = stored.apply(still.accel_g, still.gyro_dps)[0]
    made = stored.mounted(mounting.refine(IDENTITY, up)).but(date="", who_am_i=imu.who_am_i)
    return made.at(stored.temp_c)

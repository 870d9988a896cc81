# SPDX-License-Identifier: MIT
"""The robot stands level here: one pose at the REPL, app.level_here()."""

import gc

from firmware.briefly import Briefly
from firmware.calibration import load_for, save_calibration


def level(imu, path):
    """Store the mounting, turned by what the tilt still is. NotStill says how it moved."""
    with Briefly("calibration.mounting", "calibration.rest"):
        made = _levelled(imu, load_for(imu, path)[0])
    gc.collect()  # a file wants a kilobyte in one piece
    save_calibration(made, path)
    return "saved"


def _levelled(imu, stored):
    from calibration import IDENTITY, mounting
    from calibration.rest import rest

    still = rest(imu, 1.0)
    up = stored.apply(still.accel_g, still.gyro_dps)[0]
    made = stored.mounted(mounting.refine(IDENTITY, up)).but(date="", who_am_i=imu.who_am_i)
    return made.at(stored.temp_c)

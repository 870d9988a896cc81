# SPDX-License-Identifier: MIT
"""Paper 004's first program: accelerometer angles as they come, 20 lines a second.

    mpremote run docs/examples/paper_004_unfiltered.py

Wire as print_angles.py.
"""

import time

from attitude import tilt_atan_deg
from mpu6050 import MPU6050

from firmware.board import find

ROWS = None  # lines to print; None: for ever

imu = MPU6050(find().i2c(), gyro_dps=500, accel_g=8, dlpf_hz=10)
row = 0
while ROWS is None or row < ROWS:
    imu.read()
    roll, pitch = tilt_atan_deg(*imu.accel_g())
    print("Roll Angle [deg]: %.2f Pitch Angle [deg]: %.2f" % (roll, pitch))
    row += 1
    time.sleep_ms(50)

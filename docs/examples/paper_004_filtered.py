# SPDX-License-Identifier: MIT
"""Paper 004's second program: gyro bias from samples at rest, 1-D Kalman per axis, 4 ms loop.

    mpremote run docs/examples/paper_004_filtered.py

Wire as print_angles.py; it rests for the first three seconds. The paper prints in each loop; at
57600 baud a line takes 8 ms, so its loop cannot keep 4 ms. Here every tenth line is printed.
"""

import time

from attitude import Kalman1D, tilt_atan_deg
from mpu6050 import MPU6050

from firmware.board import find

ROWS = None  # lines to print; None: for ever
SAMPLES = 2000  # for the bias, 1 ms apart
LOOP_US = 4000

imu = MPU6050(find().i2c(), gyro_dps=500, accel_g=8, dlpf_hz=10)
sums = [0.0, 0.0]
for _ in range(SAMPLES):
    imu.read()
    gyro = imu.gyro_dps()
    sums[0] += gyro[0]
    sums[1] += gyro[1]
    time.sleep_ms(1)
bias = [s / SAMPLES for s in sums]

axes = [Kalman1D(q=(4 * 0.004) ** 2, r=3 * 3, p=2 * 2) for _ in range(2)]
row = loops = 0
deadline = time.ticks_us()
while ROWS is None or row < ROWS:
    imu.read()
    gyro = imu.gyro_dps()
    measured = tilt_atan_deg(*imu.accel_g())
    for k in range(2):
        axes[k].update(measured[k], (gyro[k] - bias[k]) * 0.004)
    loops += 1
    if loops % 10 == 0:
        print("Roll Angle [deg]: %.2f Pitch Angle [deg]: %.2f" % (axes[0].value, axes[1].value))
        row += 1
    deadline = time.ticks_add(deadline, LOOP_US)
    while time.ticks_diff(deadline, time.ticks_us()) > 0:
        pass

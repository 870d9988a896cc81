# SPDX-License-Identifier: MIT
"""The four papers' systems by their own numbers, beside what this project recommends instead.

000  D. Das, R. R. Mary: Real Time Noise Filtering for Low Cost IMU Sensors
001  A. E. Oguz, M. E. Aydemir: A Practical Implementation of a Low-Cost 6-DOF IMU by Kalman
     Algorithm
002  G. G. Redhyka, D. Setiawan, D. Soetraprawata: Embedded Sensor Fusion and Moving-average Filter
     for IMU on the Microcontroller-based Stabilized Platform
004  Kalman Filtering for Accurate Accelerometer and Gyroscope Measurements (Arduino, MPU6050)

`python -m tools.experiments --out DIR` runs all of them; one file each, see __main__.ALL.
"""

from tools.virtual.port import install_micropython

install_micropython()

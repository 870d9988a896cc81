# SPDX-License-Identifier: MIT
"""Roll, pitch and yaw on the console, ten times a second.

Wire the MPU6050: VCC to 3V3, GND to GND, SDA to GP4, SCL to GP5 (on an ESP32: GPIO 21 and 22).
"""

import time

from firmware.app import App

app = App()
app.start()
while True:
    if app.stale:
        print("no answer from the sensor")
    else:
        angles = app.roll_deg, app.pitch_deg, app.yaw_deg
        print("roll %.2f  pitch %.2f  yaw %.2f" % angles)
    time.sleep_ms(100)

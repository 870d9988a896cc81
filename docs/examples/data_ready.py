# SPDX-License-Identifier: MIT
"""The sensor's own clock sets the pace: each new sample raises INT, and INT starts the tick.

No sample is then read twice or left out. The sensor's clock may be some percent off a crystal's;
what the board measures of it is printed beside the angle.

Wire as print_angles.py, and INT to GP6 (on an ESP32: GPIO 19).
"""

import time

from firmware.app import App

app = App()
app.set("drive", "data-ready")
app.set("rate_hz", 250)  # 1000 / n: what the sensor can make
app.start()
while True:
    time.sleep_ms(500)
    print("roll %.2f  a sample every %d us" % (app.roll_deg, app.period_us))

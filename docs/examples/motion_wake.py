# SPDX-License-Identifier: MIT
"""Asleep until it is moved: works while there is motion, sleeps after five seconds of rest.

Copy it to the board as main.py: it runs anew after each sleep. Wire as print_angles.py, and INT
to GP6 (on an ESP32 to a pin that can wake it, such as 33, and app.set("pin_int", 33)).
The sensor sleeps with 20 uA; USB is gone while a Pico sleeps deeply: Ctrl-C before it does so.
"""

import time

from firmware import sleeping
from firmware.app import App

REST_S = 5

app = App()
print("moved" if sleeping.woke(app) else "switched on")
app.start()
rested = 0
while rested < REST_S:
    time.sleep(1)
    now = app.sample()
    print("roll %.2f  pitch %.2f" % (now.roll_deg, now.pitch_deg))
    rested = rested + 1 if now.at_rest else 0
sleeping.until_moved(app, threshold_mg=64)  # does not return

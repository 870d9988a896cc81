# SPDX-License-Identifier: MIT
"""Ten seconds of angles into /log.csv on the flash, ten lines a second.

Fetch it with `mpremote cp :/log.csv .`. While the flash is written interrupts wait: the tick
bridges that. Wire as print_angles.py.
"""

import time

from firmware.app import App

LINES = 100
EVERY_MS = 100

app = App()
app.start()
with open("/log.csv", "w") as log:
    log.write("ms,roll_deg,pitch_deg,yaw_deg,stale\n")
    began = time.ticks_ms()
    for n in range(LINES):
        wait = n * EVERY_MS - time.ticks_diff(time.ticks_ms(), began)
        time.sleep_ms(max(0, wait))
        now = app.sample()
        passed = time.ticks_diff(time.ticks_ms(), began)
        values = passed, now.roll_deg, now.pitch_deg, now.yaw_deg, now.stale
        log.write("%d,%.2f,%.2f,%.2f,%d\n" % values)
print(LINES, "lines in /log.csv")

# SPDX-License-Identifier: MIT
"""The angle of a joint: two sensors on the same two wires, one on each side of it.

Wire both as in print_angles.py, and AD0 of the second one to 3V3: its address is then 0x69.
Each has knobs and a calibration of its own, kept under its name.
"""

import time

from firmware.app import App

upper = App()
upper.start()
lower = App(name="lower")
lower.set("address", 0x69)
lower.start()
while True:
    time.sleep_ms(100)
    if not (upper.stale or lower.stale):
        print("joint %.2f" % (lower.roll_deg - upper.roll_deg))

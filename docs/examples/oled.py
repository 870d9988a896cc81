# SPDX-License-Identifier: MIT
"""An artificial horizon on an OLED that shares the sensor's wires (SSD1306, 128 x 64, 0x3C).

Wire the sensor as in print_angles.py; the display's SDA and SCL go to the same two pins, its
VCC and GND to 3V3 and GND. A frame takes 23 ms of the bus; the loop predicts meanwhile.
"""

import math
import time

from firmware.app import App

OLED = 0x3C
# the control byte 0x00, then: off, multiplex 64, start at 0, charge pump, horizontal addressing,
# right way round, pins of a panel of 64 rows, contrast, as the memory says, not inverted, on
SET_UP = b"\x00\xae\xa8\x3f\xd3\x00\x40\x8d\x14\x20\x00\xa1\xc8\xda\x12\x81\x7f\xa4\xa6\xaf"
HOME = b"\x00\x21\x00\x7f\x22\x00\x07"  # all columns, all pages
frame = bytearray(1 + 1024)  # 8 pages of 128 columns; bit 0 of a byte is its top pixel


def draw(roll_deg, pitch_deg):
    """The horizon as one looks ahead: a pixel a column, half a pixel for a degree of pitch."""
    frame[:] = bytes(1025)
    frame[0] = 0x40  # data follow
    slope = math.tan(math.radians(max(-80, min(80, roll_deg))))
    for x in range(128):
        y = round(32 - pitch_deg / 2 - slope * (x - 64))
        if 0 <= y < 64:
            frame[1 + y // 8 * 128 + x] = 1 << y % 8


app = App()
app.start()
with app.bus:
    app.imu.bus.writeto(OLED, SET_UP)
while True:
    draw(app.roll_deg, app.pitch_deg)
    with app.bus:  # the sensor's tick keeps away
        app.imu.bus.writeto(OLED, HOME)
        app.imu.bus.writeto(OLED, frame)
    time.sleep_ms(100)

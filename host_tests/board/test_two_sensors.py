# SPDX-License-Identifier: MIT
"""Two Apps on one bus of the emulated Pico, at any distance of their ticks."""

import json

from tools.demo.__main__ import settings_file
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.pico import VirtualPico

PROGRAM = """
import json, time
from firmware.app import App
upper, lower = App(), App(name="lower")
upper.start()
lower.set("address", 0x69)
lower.start()
def late(distance_us):
    lower.loop.stop()
    at = upper.tick.timing.words[1]
    time.sleep_ms(9)
    while (time.ticks_us() - at) % 4000 > 20:  # a tick of the upper one
        pass
    time.sleep_us(distance_us)
    lower.loop.start()
    time.sleep_ms(60)
    was = [app.tick.words[4] - app.tick.words[23] for app in (upper, lower)]
    time.sleep_ms(60)
    now = [app.tick.words[4] - app.tick.words[23] for app in (upper, lower)]
    return [upper.tick_kind, lower.stale, upper.stale, now[0] - was[0], now[1] - was[1]]
"""  # places of firmware.tick.words: 4 PREDICTED, 23 BUSY


def test_neither_starves_the_other():
    files = {name: settings_file(rest_s=0.05) for name in ("config.txt", "lower.config.txt")}
    bus = Bus(MPU6050Chip(Still(10.0), seed=3), MPU6050Chip(Still(40.0), seed=5, address=0x69))
    with VirtualPico(bus=bus, files=files, root=True, main=False, micropython="1.26.1") as pico:
        pico.exec(PROGRAM, 60)
        for distance_us in range(0, 4000, 160):
            seen = json.loads(pico.exec(f"print(json.dumps(late({distance_us})))", 10))
            assert seen == ["hard", False, False, 0, 0], distance_us
        assert abs(float(pico.exec("print(upper.roll_deg)")) - 10.0) < 0.5
        assert abs(float(pico.exec("print(lower.roll_deg)")) - 40.0) < 0.5

# SPDX-License-Identifier: MIT
"""One board under one load: what its ticks were like at each rate."""

import ast

from tools.demo.__main__ import settings_file
from tools.virtual import motion
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.pico import VirtualPico

LOADS = ("idle", "allocating", "collecting", "repl", "faults")
RATES_HZ = (250, 500, 1000)

START = """
import gc, time
from firmware.app import App
app = App()
app.start()
def busy(ms, each=0):
    began, n = time.ticks_ms(), 0
    while time.ticks_diff(time.ticks_ms(), began) < ms:
        kept = [float(i) for i in range(20)]
        text = str(kept[-1] / 3)
        n += 1
        if each and n % each == 0:
            gc.collect()
"""
# what the board's own program does for so many milliseconds
FOREGROUND = {
    "idle": "time.sleep_ms(%d)",
    "allocating": "busy(%d)",
    "collecting": "busy(%d, 300)",
    "faults": "busy(%d)",
}
STATS = "s = app.stats()\ns['c'] = app.loop.period_us\nprint(s)"


def injected(now_s, seconds):
    """A burst of NACKs, a stuck bus and a brown-out, spread over so many seconds from now."""
    return [
        make("nack", at_s=now_s + 0.1 * seconds, for_s=0.02),
        make("sda_held", at_s=now_s + 0.4 * seconds, for_s=0.2, clocks=9),
        make("brown_out", at_s=now_s + 0.6 * seconds, for_s=0.005),
    ]


def measure(version, load, ticks, rates_hz=RATES_HZ):
    """The rows of one load on MicroPython `version`: `ticks` ticks at each rate."""
    bus = Bus(MPU6050Chip(motion.Sinusoid(20.0, 0.5, "roll"), seed=3, gyro_bias_dps=(2, -1, 1)))
    files = {"config.txt": settings_file(rest_s=0.05)}
    with VirtualPico(bus=bus, files=files, root=True, main=False, micropython=version) as board:
        board.exec(START, 30)
        return [_row(board, bus, load, ticks, rate_hz) for rate_hz in rates_hz]


def _row(board, bus, load, ticks, rate_hz):
    board.exec(f"app.set('rate_hz', {rate_hz})\ntime.sleep_ms(50)\napp.loop.start()", 10)
    seconds = ticks / rate_hz
    ends = board.nanos + seconds * 1e9
    if load == "faults":
        bus.faults[:] = injected(board.nanos * 1e-9, seconds)
    if load == "repl":
        while board.nanos < ends:
            board.exec("print(app.roll_deg, [n / 3 for n in range(9)])", 10)
    else:
        board.exec(FOREGROUND[load] % round(1000 * seconds), 10 + 3 * seconds)
    stats = ast.literal_eval(board.exec(STATS, 10))
    bus.faults.clear()
    seen = stats["ticks"] + stats["lost"]
    return {
        "rate_hz": rate_hz,
        "tick": stats["tick"],
        "load": load,
        "expected": seen,
        "ticks": stats["ticks"],
        "lost": stats["lost"],
        "late_p99_us": stats["late_p99_us"],
        "late_max_us": stats["late_max_us"],
        "step_p99_us": stats["step_p99_us"],
        "predicted": stats["predicted"],
        "errors": stats["errors"],
    }

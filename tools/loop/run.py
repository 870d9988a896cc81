# SPDX-License-Identifier: MIT
"""One board under one load: what its ticks were like at each rate."""

import ast

from tools.demo.__main__ import settings_file
from tools.virtual import motion
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040.load import under_load

LOADS = ("idle", "allocating", "collecting", "repl", "faults")
RATES_HZ = (250, 500, 1000)

START = """
import time
from firmware.app import App
app = App()
app.start()
def marks(w=app.tick.timing.words):
    # when the last tick was, how many there were, how many the loop itself calls lost
    while True:
        n = w[5]
        row = w[4], n, w[6]
        if w[5] == n:
            return row
"""
AGAIN = """
app.set("rate_hz", %d)
time.sleep_ms(30)
app.loop.start()
time.sleep_ms(20)
first = marks()
"""
LOOK = """
last = marks()
s = app.stats()
print("=", (first, last, s))
"""
# name, parameters, share of the time at which it begins, how long (s), ms until good samples
FAULTS = (
    ("nack", {}, 0.1, 0.02, 20),
    ("sda_held", {"clocks": 9}, 0.3, 0.5, 50),
    ("brown_out", {}, 0.5, 0.005, 250),
)
_LEAST_S = 0.4  # a brown-out under way is not over in less


def board_for(version, moved=None, **chip):
    """(VirtualPico with the project on it, its bus); nothing runs yet. moved: None, it swings."""
    moved = moved or motion.Sinusoid(20.0, 0.5, "roll")
    bus = Bus(MPU6050Chip(moved, seed=3, gyro_bias_dps=(2, -1, 1), **chip))
    files = {"config.txt": settings_file(rest_s=0.05)}
    return VirtualPico(bus=bus, files=files, root=True, main=False, micropython=version), bus


def measure(version, load, ticks, rates_hz=RATES_HZ):
    """The rows of one load on MicroPython `version`: `ticks` ticks at each rate."""
    board, bus = board_for(version)
    with board:
        board.exec(START, 30)
        return [row(board, bus, load, ticks, rate_hz) for rate_hz in rates_hz]


def row(board, bus, load, ticks, rate_hz):
    """The figures of `ticks` ticks at rate_hz on a board on which START ran.

    lost is counted with a clock: the periods from the first tick to the last one less the ticks;
    counted_lost is what the loop itself counted.
    """
    board.exec(AGAIN % rate_hz, 10)
    seconds = ticks / rate_hz
    recovery_ms = {}
    if load == "faults":
        recovery_ms = _with_faults(board, bus, max(seconds, _LEAST_S))
    else:
        under_load(board, load, 1000 * seconds)
    first, last, stats = ast.literal_eval(board.exec(LOOK, 10).partition("=")[2].strip())
    expected = round((last[0] - first[0]) % 2**30 * rate_hz / 1e6)
    return {
        "rate_hz": rate_hz,
        "tick": stats["tick"],
        "load": load,
        "expected": expected,
        "ticks": last[1] - first[1],
        "lost": expected - (last[1] - first[1]),
        "late_p99_us": stats["late_p99_us"],
        "late_max_us": stats["late_max_us"],
        "errors": stats["errors"],
        "step_p99_us": stats["step_p99_us"],
        "predicted": stats["predicted"],
        "counted_lost": last[2] - first[2],
        **({"recovery_ms": recovery_ms} if recovery_ms else {}),
    }


NOTE = """
from array import array
goods = array("i", [0] * 40)  # in an outage; how many are over; when each was
@micropython.native
def note(app, goods=goods, words=app.tick.words, est=app.tick.est):
    if words[3]:
        goods[0] = 1
    elif goods[0]:
        goods[0] = 0
        n = goods[1]
        if n < 38:
            goods[2 + n] = est[1]
            goods[1] = n + 1
app.outputs.add(note, hard=app.stats()["tick"] == "hard")
"""


def _with_faults(board, bus, seconds):
    """{fault: ms from its end until the samples were good again}; None where they never were.

    A held line is freed by the board's own clocks, so there it is from the fault's beginning.
    """
    board.exec("import micropython" + NOTE, 10)
    ends_us = {}
    for name, parameters, share, for_s, _ in FAULTS:
        at_s = board.nanos * 1e-9 + 0.01 + share * seconds
        bus.faults.append(make(name, at_s=at_s, for_s=for_s, **parameters))
        ends_us[name] = 1e6 * (at_s if "clocks" in parameters else at_s + for_s)
    under_load(board, "allocating", 1000 * seconds)
    goods = ast.literal_eval(board.exec("print(list(goods[2 : 2 + goods[1]]))"))
    bus.faults.clear()
    board.exec("app.outputs.clear()")
    found = {}
    for name, _, _, _, allowed_ms in FAULTS:
        end_us = ends_us[name]
        later = [at - end_us for at in goods if 0 < at - end_us < 2000 * allowed_ms]
        found[name] = round(max(later) / 1000, 1) if later else None
    return found

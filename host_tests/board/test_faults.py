# SPDX-License-Identifier: MIT
"""The key faults on the emulated RP2040: main's own app, the real firmware, the bus of wires."""

import ast
import math

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.motion import Sinusoid, Still
from tools.virtual.pico import VirtualPico

# name, parameters, seconds, counter that must move, ms allowed from its end to good samples
FAULTS = [
    ("nack", {}, 0.02, "nack", 20),
    ("sda_held", {"clocks": 9}, None, "timeout", 50),
    ("timeout", {}, 0.02, "timeout", 50),
    ("filled", {"value": 0xFF}, 0.02, "fill", 100),
    ("bit_flip", {"p": 0.5}, 0.12, "jump", 30),
    ("brown_out", {}, 0.002, "nack", 250),
    ("unplugged", {}, 0.12, "nack", 250),
    ("arbitration", {}, 0.02, "nack", 50),
    ("saturation", {"accel_g": (0.0, 0.0, 0.0)}, 0.02, "saturated", 60),
    ("stuck_data", {}, 0.12, "frozen", 300),
    ("unplugged", {"profile": "MPU6500"}, 0.12, "another", 250),
]


class Swings:
    """At rest until since_s, then rolling to and fro by up to 100 deg/s."""

    duration_s = None

    def __init__(self):
        self.since_s = 1e9
        self._swing = Sinusoid(40.0, 0.398, "roll", offset_deg=40.0, phase_deg=-90.0)

    def at(self, t):
        return self._swing.at(t - self.since_s) if t > self.since_s else Still().at(t)

    def truth(self, t):
        return self._swing.truth(max(0.0, t - self.since_s))


APP = """
import gc, time
from firmware.app import App
app = App()
app.config.set('rest_s', 0.1)
def tell():
    time.sleep_ms(8)
    age, stale, fresh = app.age_us, app.stale, app.fresh
    print((app.stats(), stale, fresh, age))
app.start()
"""


@pytest.fixture(scope="module")
def board(micropython):
    """The app at 250 Hz, its sensor at rest until it runs."""
    motion = Swings()
    bus = Bus(MPU6050Chip(motion, seed=1))
    with VirtualPico(bus=bus, root=True, main=False, micropython=micropython) as pico:
        pico.exec(APP, 30)
        motion.since_s = pico.nanos / 1e9
        pico.run_ms(400)
        yield pico


def asked(pico):
    """(stats, stale, fresh) of the app two periods after the question is compiled; the age is from
    before the stats are made. Compiling and a collection among the stats hold up soft ticks."""
    stats, stale, fresh, age_us = ast.literal_eval(pico.exec("tell()"))
    stats["age_ms"] = age_us // 1000
    return stats, stale, fresh


def roll_error_deg(pico):
    """How far the roll is off; the REPL's answer is from some instant of its milliseconds."""
    began = pico.nanos
    told = int(pico.exec("print(app.angles_mdeg[0])")) / 1000
    step = (pico.nanos - began) // 10
    return min(_off(pico.bus.devices[0].truth((began + k * step) / 1e9), told) for k in range(11))


def _off(truth, roll_deg):
    w, x, y, z = truth
    true = math.degrees(math.atan2(2 * (y * z + w * x), w * w - x * x - y * y + z * z))
    return abs((roll_deg - true + 180) % 360 - 180)


def recovered(stats, stale, fresh):
    """Good samples come again. A soft tick that the question itself has made late has none."""
    assert not stale
    if stats["tick"] == "hard":
        assert fresh and stats["age_ms"] <= 4  # a period
    else:
        assert stats["age_ms"] <= 12


@pytest.mark.parametrize("name, parameters, for_s, counter, allowed_ms", FAULTS)
def test_is_counted_and_recovered_in_time(board, name, parameters, for_s, counter, allowed_ms):
    before = asked(board)[0]
    fault = make(name, at_s=board.nanos / 1e9 + 0.005, for_s=for_s or 0.5, seed=1, **parameters)
    board.bus.faults[:] = [fault]
    board.run_ms(5 + 1000 * (for_s or 0.0) + allowed_ms - 4)  # and 4 more until it answers
    error_deg = roll_error_deg(board)
    stats, stale, fresh = asked(board)
    if for_s is None:
        assert fault.done  # the clocks freed it, not the time
    board.bus.faults.clear()
    assert stats.get(counter, 0) > before.get(counter, 0)
    assert stats["errors"] == 0
    recovered(stats, stale, fresh)
    assert error_deg < 2.0  # of several faults in a row, the start of the motion in it


def test_an_exception_in_the_users_own_function_is_counted_and_outlived(board):
    board.exec("def bad(app):\n    raise ValueError('mine')\ngc.collect()")
    board.exec("app.outputs.add(bad)")  # with a heap that needs no collection meanwhile
    board.run_ms(60)
    stats, stale, fresh = asked(board)
    board.exec("app.outputs.clear()")
    assert stats["output_errors"] >= 10 and stats["errors"] == 0
    recovered(stats, stale, fresh)


def test_the_loop_held_its_period_through_all_of_it(board):
    board.run_ms(20)
    stats = asked(board)[0]
    assert stats["running"]
    if stats["tick"] == "hard":
        assert stats["lost"] == 0
    else:  # reports through the REPL and collections cost ticks, faults hardly any
        print(f"lost {stats['lost']} of {stats['ticks']} ticks")
        assert stats["lost"] < 0.1 * stats["ticks"]


FILL = """
import gc, time
full = 0
hog = last = None
for size in (4096, 256, 16):
    try:
        while True:
            hog = [hog, bytearray(size)]
    except MemoryError:
        pass
full = gc.mem_free()
time.sleep_ms(100)
while hog:  # one by one: a pointer left on the stack shall not keep all of them
    last = hog
    hog = last[0]
    last[0] = last[1] = None
gc.collect()  # or a later question does, and makes a soft tick late
print("::", (full, app.stats(), repr(app.tick.error)))
"""


def test_a_full_heap_stops_neither_the_loop_nor_the_way_out_of_a_fault(board):
    """The user's program holds all memory while the sensor does not answer."""
    before = asked(board)[0]
    at_s = board.nanos / 1e9
    board.bus.faults[:] = [make("nack", at_s=at_s, for_s=1e9, seed=1)]
    told, _, last = board.exec(FILL, timeout_s=60).partition("::")
    free, during, error = ast.literal_eval(last.strip())
    board.bus.faults.clear()
    board.exec("import gc\ngc.collect()")  # what it held; later it would meet the question
    board.run_ms(100)
    after, stale, fresh = asked(board)
    print("full heap:", free, "bytes free,", during["errors"], "errors in the foreground")
    assert free < 1000
    assert during["nack"] > before.get("nack", 0) + 10
    assert during["running"] and during["stale"]
    if during["tick"] == "hard":
        assert error == "None" and during["lost"] == before["lost"]
    assert told.count("Traceback") <= 1  # the first error's
    assert after["errors"] == during["errors"]  # none since there is memory again
    recovered(after, stale, fresh)

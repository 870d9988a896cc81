# SPDX-License-Identifier: MIT
"""The stream on the emulated Pico: through the real mpremote transport, knobs set meanwhile."""

import json
import sys

import pytest

from tools.demo.__main__ import settings_file
from tools.virtual import motion
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico

START = """
import gc, micropython, time
from firmware.app import App
app = App()
app.start()
def idle(ms):
    gc.collect()
    gc.disable()  # a collection takes a tenth of the time, wherever it falls
    n, began = 0, time.ticks_ms()
    while time.ticks_diff(time.ticks_ms(), began) < ms:
        n += 1
    gc.enable()
    return n
class Sink:
    def __init__(self, console):
        self.ready = console.ready  # the real look
        self.write = len  # all but the line itself
"""


@pytest.fixture(scope="module", params=["1.26.1"])
def board(request):
    chip = MPU6050Chip(motion.Sinusoid(20.0, 0.5, "roll"), seed=3, gyro_bias_dps=(2, -1, 1))
    files = {"config.txt": settings_file(rest_s=0.05)}
    with VirtualPico(
        bus=Bus(chip), files=files, root=True, main=False, micropython=request.param
    ) as pico:
        pico.exec(START, 30)
        yield pico


@pytest.mark.parametrize("rate_hz", [250, 1000])
def test_two_seconds_through_mpremote_while_twenty_knobs_are_set(board, rate_hz, tmp_path):
    figures = tmp_path / "line.json"
    command = [
        sys.executable, "-m", "tools.link", "--samples", str(2 * rate_hz), "--knobs", "20",
        "--rate", str(rate_hz), "--json", str(figures),
    ]  # fmt: skip
    with board.terminal() as port:
        code, printed = port.program([*command, "--port", port.path], 1800)
    assert code == 0, printed.decode(errors="replace")
    row = json.loads(figures.read_text())
    print(row)
    assert row["samples"] >= 2 * rate_hz and row["period_us"] == 1000000 // rate_hz
    assert row["lost"] == row["lost_on_board"] == row["bad_frames"] == 0
    assert row["knobs"] == row["knobs_good"] == 20
    assert row["headers"] >= 1
    assert row["ticks_lost"] == row["tick_errors"] == 0 and row["tick"] == "hard"


DEEP = """
class Depth:
    most = frames = 0
    def __init__(self, console):
        self.ready = console.ready
    def write(self, line):
        self.most = max(self.most, micropython.stack_use())
        self.frames += 4
kept, app.telemetry.console = app.telemetry.console, Depth(app.telemetry.console)
app.stream.start(keep_s=1000)
lost = app.stats()["lost"]
def change(calls):  # in a program that is itself some calls deep
    if calls:
        return change(calls - 1)
    for k in range(12):
        app.set("attitude_rest_tau_s", 1 + k / 100)
        time.sleep_us(k * 83)
for calls in range(3):
    change(calls)
time.sleep_ms(300)
app.stream.stop()
depth, app.telemetry.console = app.telemetry.console, kept
print(depth.most, depth.frames, app.stream._ring[3], app.stats()["lost"] - lost)
del Depth, change, depth, kept, lost, calls
"""


def test_the_stream_leaves_a_tick_its_stack_where_a_program_is_deep_in_calls(board):
    """Three depths of a program that sets. A hard tick wants 2560 of the 8192 bytes, a write
    through USB a thousand."""
    board.exec("app.set('rate_hz', 1000)")
    most, frames, samples_lost, ticks_lost = map(int, board.exec(DEEP, 120).split())
    print(most, frames)
    assert frames > 2000 and most < 8192 - 2560 - 1000
    assert samples_lost == ticks_lost == 0


def test_a_frame_costs_no_byte_and_the_tick_nothing_while_nobody_listens(board):
    board.exec(
        "app.set('rate_hz', 250)\nkept = app.telemetry.console\n"
        "app.telemetry.console = Sink(kept)\n"
        "look, app.foreground._look = app.foreground._look, lambda app: None\n"  # which allocates
        "app.foreground._part = 0"  # none is under way
    )
    board.exec("app.stream.start(keep_s=1000)\nidle(600)")
    locked = (
        "errors = app.foreground.errors\nmicropython.heap_lock()\nidle(300)\n"
        "micropython.heap_unlock()\nprint(app.foreground.errors - errors, app.stream.written)"
    )
    errors, frames = map(int, board.exec(locked).split())
    assert errors == 0 and frames > 200
    board.exec("app.stream.stop()")
    assert board.exec("print(app.tick.words[19])") == "0\n"  # OUTPUTS: the tick drives nothing
    board.exec("app.telemetry.console, app.foreground._look = kept, look")


def rounds(board):
    """How often the main program goes round in a period of the motion, which the tick's own work
    follows; the counts are sent twice in it."""
    return int(board.exec("print(idle(2000))", 60))


@pytest.mark.parametrize("rate_hz", [250, 1000])
def test_the_cost_of_a_sample(board, rate_hz, record_property):
    """From the time that is left to the main program, with the real console's looks, once the
    header is sent; all but the line itself."""
    board.exec(
        f"app.set('rate_hz', {rate_hz})\napp.telemetry.console = Sink(kept)\n"
        "app.foreground._look = lambda app: None\n"  # it falls into one window and not the other
        "app.foreground._part = 0"  # none is under way
    )
    alone = rounds(board)
    board.exec("app.stream.start(keep_s=1000)\nidle(2400)", 60)
    beside = rounds(board)
    board.exec("app.stream.stop()\napp.telemetry.console, app.foreground._look = kept, look")
    board.exec("app.loop.stop()")
    free = rounds(board)
    board.exec("app.loop.start()")
    cost_us = (alone - beside) / free * 1e6 / rate_hz
    print(f"{rate_hz} Hz: a sample costs {cost_us:.0f} us")
    record_property("cost_us", cost_us)
    assert cost_us < 80


def test_names_have_room_for_the_users_before_the_heap_is_in_pieces(board):
    """MicroPython keeps names in pools of 20, 40 ... 640; the next one, of 1280, takes 9 KB in one
    piece, and is there once anything was loaded beside the app."""
    board.exec("app.set('filter', 'kalman2')\napp.set('filter', 'attitude')", 30)
    told = board.exec("micropython.qstr_info()")
    names = int(told.split("n_qstr=")[1].split(",")[0])
    assert "n_pool=7," in told and 1260 + 1280 - names > 1000

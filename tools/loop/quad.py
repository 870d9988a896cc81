# SPDX-License-Identifier: MIT
"""The quadcopter, armed, whole in the tick at 1 kHz, while the foreground collects garbage.

    python -m tools.loop.quad [--ticks N] [--micropython 1.26.1]

On the emulated RP2040 with the real MicroPython: ticks lost, how long a step takes of the
processor, how late it begins, and the heap that a second of ticks takes; exits 1 where that is
more than LOST, STEP_P99_US and BYTES say. A second of the board takes a minute.
"""

import argparse
import ast
import sys

from tools.loop.run import LOOK, START, board_for
from tools.virtual.motion import Still
from tools.virtual.rp2040.load import under_load

LOST, STEP_P99_US, BYTES = 0, 700, 0
MICROPYTHON = "1.26.1"
_FLY = """
from firmware.apps import quad
quad.start(app)
time.sleep_ms(300)
app.quad.command(0)
app.quad.arm()
app.quad.command(400)
app.quad._link_max = 1 << 29  # nobody commands while the load runs
app.loop.start()
time.sleep_ms(20)
first, predicted = marks(), app.tick.words[4]
"""
# nothing of the foreground runs between the two looks at the heap
_HEAP = """
def heap(ticks, w=app.tick.timing.words):
    import gc
    gc.collect()
    gc.disable()
    app.tick.words[12] = 1 << 29
    time.sleep_ms(5)  # what was scheduled before is over
    app.tick.words[12] = 1 << 29
    before, end = gc.mem_alloc(), w[5] + ticks
    while w[5] < end:
        pass
    after = gc.mem_alloc()
    app.tick.words[12] = 0
    gc.enable()
    return after - before
heap(2)
print("=", heap(%d), app.quad.armed, app.stale)
"""


def measure(ticks=400, version=MICROPYTHON):
    """The figures as a dict."""
    board, _ = board_for(version, Still())
    with board:
        board.exec(START + _FLY, 60)
        before = int(board.exec("print(predicted)"))
        rounds = under_load(board, "collecting", ticks)
        first, last, stats = ast.literal_eval(board.exec(LOOK, 10).partition("=")[2].strip())
        used = board.exec(_HEAP % (ticks // 4), 60).partition("=")[2].split()
    expected = round((last[0] - first[0]) % 2**30 / 1000)
    return {
        "micropython": version,
        "tick": stats["tick"],
        "armed": used[1] == "True" and used[2] == "False",
        "collections": rounds,
        "expected": expected,
        "lost": expected - (last[1] - first[1]),
        "step_p50_us": stats["step_p50_us"],
        "step_p99_us": stats["step_p99_us"],
        "step_max_us": stats["step_max_us"],
        "late_p99_us": stats["late_p99_us"],
        "errors": stats["errors"] + stats["output_errors"],
        "predicted": stats["predicted"] - before,
        "bytes": int(used[0]),
    }


def good(row):
    """Whether this is what it has to be."""
    return (
        row["tick"] == "hard" and row["armed"] and not row["errors"] and row["lost"] <= LOST
        and row["step_p99_us"] < STEP_P99_US and row["bytes"] <= BYTES
    )  # fmt: skip


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.loop.quad", description=__doc__)
    parser.add_argument("--ticks", type=int, default=1000)
    parser.add_argument("--micropython", default=MICROPYTHON)
    arguments = parser.parse_args()
    row = measure(arguments.ticks, arguments.micropython)
    for name, value in row.items():
        print("%-14s %s" % (name, value))
    return 0 if good(row) else 1


if __name__ == "__main__":
    sys.exit(main())

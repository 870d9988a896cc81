# SPDX-License-Identifier: MIT
"""Runs the injections over the cores."""

import contextlib
import io
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed

from tqdm import tqdm

from tools.faults.kinds import KINDS, WAITS_S

BOARDS = ("rp2", "rp2 hard", "esp32")
# where MicroPython's ports/esp32 differs: the chips, and the versions (docs/site/esp32.md)
ESP32 = tuple(
    f"{chip} {version}"
    for chip in ("ESP32", "ESP32S3", "ESP32C3")
    for version in ("1.24", "1.25", "1.26", "1.27", "1.29")
)


def bar_s(kind, board):
    """The longest recovery allowed of a kind, on one of BOARDS or ESP32."""
    slow = board.endswith("1.29") or board in ("ESP32S3 1.27", "ESP32C3 1.27")
    return kind.bar_s + (WAITS_S if slow else 0.0)


def run(name, board, runs, sensor="mpu6050"):
    """(outcomes, uncaught exceptions) of `runs` injections of one kind on one board."""
    from tools.faults.fifo_rig import FifoRig
    from tools.faults.rig import MinimuRig, Rig

    kind = next(kind for kind in KINDS if kind.name == name)
    rig = MinimuRig if sensor == "minimu9" else Rig
    made = (FifoRig if kind.fifo else rig)(kind, board)
    nowhere = io.TextIOWrapper(io.BytesIO())  # the app prints warnings, and the user's exceptions
    with contextlib.redirect_stdout(nowhere), contextlib.redirect_stderr(nowhere), made as rig:
        return [rig.inject(number) for number in range(runs)], rig.uncaught


def measure(names, runs, jobs=None, quiet=False, sensor="mpu6050", boards=BOARDS):
    """{name: {board: (outcomes, uncaught)}} over the cores."""
    work = [(name, board, runs, sensor) for name in names for board in boards]
    results = {name: dict.fromkeys(boards) for name in names}
    context = multiprocessing.get_context("spawn")
    bar = tqdm(total=len(work) * runs, unit="fault", disable=quiet or not sys.stderr.isatty())
    with ProcessPoolExecutor(jobs or os.cpu_count(), context) as pool, bar:
        futures = {pool.submit(run, *task): task for task in work}
        for future in as_completed(futures):
            name, board, *_ = futures[future]
            results[name][board] = future.result()
            bar.update(runs)
    return results

# SPDX-License-Identifier: MIT
"""Starts of the whole app on a poor bus, powered together with its sensor: `make starts`.

Each start has its own sensor (gyro bias within +-20 deg/s), which answers 0 to 100 ms after the
board runs; one transfer in 200 is not acknowledged. Timed from the moment the sensor answers.
"""

import argparse
import contextlib
import io
import json
import os
import random
import tempfile
from concurrent.futures import ProcessPoolExecutor

from tqdm import tqdm

from tools.faults.rig import BOARDS
from tools.virtual import Bus, MPU6050Chip, Port, faults

LATE_MS = 100
FAILING = 1 / 200
BIAS_DPS = 20.0


def start(seed, failing=FAILING, late_ms=LATE_MS):
    """{"seconds": since the sensor was there, "bias_off_dps", "warnings"} or {"error": text}."""
    chance = random.Random(seed)
    platform, version = list(BOARDS.values())[seed % len(BOARDS)]
    bias = [chance.uniform(-BIAS_DPS, BIAS_DPS) for _ in range(3)]
    chip = MPU6050Chip(seed=seed, gyro_bias_dps=bias)
    there_ns = round(chance.uniform(0, late_ms) * 1e6)
    chip.power_off()
    chip.power_on(silent_ns=there_ns)
    bus = Bus(chip, faults=[faults.make("nack", at_s=0.0, p=failing, seed=seed)])
    said = io.StringIO()
    with tempfile.TemporaryDirectory() as root:
        with Port(platform, {0: bus}, version=version, root=root) as port:
            from firmware.app import App

            app = App()
            try:
                with contextlib.redirect_stdout(said):
                    app.start()
            except OSError as error:
                return {"error": str(error)}
            seconds = (port.now_ns - there_ns) / 1e9
            off = [abs(a - b) for a, b in zip(app.calibration.gyro_bias_dps, bias)]
            app.loop.stop()
    return {"seconds": seconds, "bias_off_dps": max(off), "warnings": said.getvalue()}


def summary(results):
    """The figures of many starts."""
    good = sorted(r["seconds"] for r in results if "seconds" in r)
    within = sum(seconds <= 1.0 for seconds in good)
    return {
        "starts": len(results),
        "started": len(good),
        "within_1s": within / len(results),
        "median_s": round(good[len(good) // 2], 3),
        "slowest_s": round(good[-1], 3),
        "bias_off_max_dps": round(max(r.get("bias_off_dps", 0) for r in results), 3),
        "with_warnings": sum(bool(r.get("warnings")) for r in results),
    }


def measure(runs, jobs=None, quiet=False):
    """The results of so many starts, over the cores."""
    with ProcessPoolExecutor(jobs or os.cpu_count()) as pool:
        work = pool.map(start, range(runs), chunksize=8)
        return list(tqdm(work, total=runs, unit="start", disable=quiet))


def main():
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m tools.starts", description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    parser.add_argument("--json", metavar="FILE")
    arguments = parser.parse_args()
    results = measure(arguments.runs, quiet=None)
    figures = summary(results)
    for name, value in figures.items():
        print("%-18s %s" % (name, value))
    for text in {r["error"] for r in results if "error" in r}:
        print(text)
    if arguments.json:
        with open(arguments.json, "w") as file:
            json.dump(figures, file, indent=1)


if __name__ == "__main__":
    main()

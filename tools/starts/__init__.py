# SPDX-License-Identifier: MIT
"""Starts of the whole app at rest: on a poor bus, powered with its sensor; at every setting.

Each start has its own sensor (gyro bias within +-20 deg/s), which answers some time after the
board runs. Timed from the moment it answers.
"""

import contextlib
import io
import random
import tempfile

from tools.faults.rig import BOARDS
from tools.virtual import Bus, MPU6050Chip, Port, faults

LATE_MS = 100
FAILING = 1 / 200
BIAS_DPS = 20.0
DLPF_HZ = (260, 184, 94, 44, 21, 10, 5)
SENSOR_HZ = (4, 10, 50, 200, 1000)
PARTS = ("MPU6050", "MPU6500", "MPU9250", "MPU9255", "MPU6515", "ICM20689")


def settings():
    """[(dlpf_hz, sensor_hz, part)]: all that the chip can be set to."""
    rows = []
    for dlpf_hz in DLPF_HZ:
        for sensor_hz in SENSOR_HZ:
            if dlpf_hz != 260 or sensor_hz >= 8000 / 256:
                rows += [(dlpf_hz, sensor_hz, part) for part in PARTS]
    return rows


def start(seed, failing=FAILING, late_ms=LATE_MS, part="MPU6050", **knobs):
    """{"seconds": since the sensor was there, "bias_off_dps", "warnings"} or {"error": text}."""
    chance = random.Random(seed)
    platform, version = list(BOARDS.values())[seed % len(BOARDS)]
    bias = [chance.uniform(-BIAS_DPS, BIAS_DPS) for _ in range(3)]
    chip = MPU6050Chip(seed=seed, gyro_bias_dps=bias, profile=part)
    there_ns = round(chance.uniform(0, late_ms) * 1e6)
    chip.power_off()
    chip.power_on(silent_ns=there_ns)
    bus = Bus(chip, faults=[faults.make("nack", at_s=0.0, p=failing, seed=seed)])
    said = io.StringIO()
    port = Port(platform, {0: bus}, version=version)
    with tempfile.TemporaryDirectory() as port.root, port:
        from firmware.app import App

        app = App()
        for name, value in knobs.items():
            app.config.set(name, value)
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


def at(setting):
    """A start() at rest, on a good bus, at one of settings()."""
    dlpf_hz, sensor_hz, part = setting
    seed = settings().index(setting)
    return start(seed, 0.0, 0, part, dlpf_hz=dlpf_hz, sensor_hz=sensor_hz)

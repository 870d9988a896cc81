# SPDX-License-Identifier: MIT
"""Whether tuning helps on recordings that it has not seen: half tunes, the other half is graded.

    python -m tools.tune.trial [--data DIR] [--json FILE] [--seconds S] [--only CASE ...]

Against the optical truth, with the settings found and with the defaults, in both directions: as
recorded, at other rates, with vibration. Without --data on the project's three excerpts, two
against one.
"""

import argparse
import json
import multiprocessing
import os
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np

from tools import recordings
from tools.replay import engine, grade
from tools.track import load
from tools.tune.search import Judge, tuned

# case: (filter, rate in Hz or None, shaken)
CASES = {
    "attitude": ("attitude", None, False),
    "attitude, 100 Hz": ("attitude", 100, False),
    "attitude, 500 Hz": ("attitude", 500, False),
    "attitude, shaken": ("attitude", None, True),
    "kalman2": ("kalman2", None, False),
    "kalman2, 100 Hz": ("kalman2", 100, False),
    "kalman2, 500 Hz": ("kalman2", 500, False),
    "kalman2, shaken": ("kalman2", None, True),
    "complementary": ("float.complementary", None, False),
    "complementary, 100 Hz": ("float.complementary", 100, False),
    "complementary, 500 Hz": ("float.complementary", 500, False),
    "complementary, shaken": ("float.complementary", None, True),
}
LEAD_S = 5.0  # before the motion begins
SHAKEN_HZ, SHAKEN_G, SHAKEN_DPS = 47.0, 0.5, 10.0


def resampled(track, rate_hz):
    """The same motion in samples of another rate; what would alias is averaged away before."""
    length = int((len(track) - 1) / track.rate_hz * rate_hz)
    at = np.arange(length) * track.rate_hz / rate_hz
    wide = max(1, round(track.rate_hz / rate_hz))
    counts = track.counts.astype(float)
    if wide > 1:
        kernel = np.ones(wide) / wide
        counts = np.apply_along_axis(np.convolve, 0, counts, kernel, mode="same")
    before = np.arange(len(track))
    new = np.transpose([np.interp(at, before, column) for column in counts.T])
    up = np.transpose([np.interp(at, before, column) for column in track.up.T])
    counted = track.counted[np.round(at).astype(int)] & ~np.isnan(up).any(axis=1)
    return replace(
        track, counts=np.round(new).astype(np.int16), t_s=np.arange(length) / rate_hz,
        rate_hz=float(rate_hz), counted=counted, up=up,
    )  # fmt: skip


def shaken(track):
    """A motor shakes the sensor."""
    some = np.random.default_rng(5)
    phase = some.uniform(0, 2 * np.pi, 7)
    wave = np.sin(2 * np.pi * SHAKEN_HZ * track.t_s[:, None] + phase)
    size = np.zeros(7)
    size[:3] = SHAKEN_G * recordings.ACCEL_LSB_PER_G[track.settings["accel_g"]]
    size[4:] = SHAKEN_DPS * recordings.GYRO_LSB_PER_DPS[track.settings["gyro_dps"]]
    counts = np.clip(np.round(track.counts + wave * size), -32768, 32767)
    return replace(track, counts=np.ascontiguousarray(counts.astype(np.int16)))


def prepared(path, rate_hz, shake, seconds):
    track = load(path)
    begin = max(0, int(np.argmax(track.counted)) - int(LEAD_S * track.rate_hz))
    track = track.part(slice(begin, begin + int(seconds * track.rate_hz)))
    if rate_hz:
        track = resampled(track, rate_hz)
    return shaken(track) if shake else track


def tried(case, learn, test, seconds):
    """Tuned on the files `learn`, graded on `test`: a row of figures."""
    name, rate_hz, shake = CASES[case]
    found = tuned(Judge([prepared(path, rate_hz, shake, seconds) for path in learn]), name)
    rows = {}
    for path in test:
        track = prepared(path, rate_hz, shake, seconds)
        errors = []
        for changes in ({}, found):
            settings = engine.changed(track.settings, {"filter": name, **changes})
            angles = engine.run(track, settings)
            errors.append(round(grade.rms_deg(angles, track.up, track.counted), 4))
        rows[path.stem] = errors
    ratio = float(np.exp(np.mean([np.log(after / before) for before, after in rows.values()])))
    return {"case": case, "found": found, "errors_deg": rows, "ratio": round(ratio, 4)}


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.tune.trial", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--data", help="folder of recordings with truth")
    parser.add_argument("--json", type=Path, metavar="FILE")
    parser.add_argument("--seconds", type=float, default=90.0, help="of each recording")
    parser.add_argument("--only", nargs="+", choices=CASES, default=list(CASES))
    options = parser.parse_args(arguments)
    paths = recordings.files(options.data)
    half = (len(paths) + 1) // 2
    sides = ((paths[::2], paths[1::2]), (paths[1::2], paths[::2])) if half else ()
    rows = []
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(os.cpu_count(), context) as pool:
        jobs = [
            pool.submit(tried, case, learn, test, options.seconds)
            for case in options.only
            for learn, test in sides
        ]
        for job in jobs:
            row = job.result()
            rows.append(row)
            errors = " ".join(f"{a:.2f}>{b:.2f}" for a, b in row["errors_deg"].values())
            print(f"{row['case']:24} x {row['ratio']:.3f}  {errors}  {row['found']}", flush=True)
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    main()

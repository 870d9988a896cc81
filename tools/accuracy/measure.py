# SPDX-License-Identifier: MIT
"""All filters on all recordings and simulated cases, over the processor's cores.

Not in __main__.py: a worker has to find run() by its name, and does not load the command.
"""

import multiprocessing
import os
import sys
import time
from collections import namedtuple
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from tqdm import tqdm

from tools import recordings
from tools.accuracy import cases
from tools.accuracy.motions import product
from tools.virtual.port import install_micropython

# source: a path, or the name of a simulated case; scale: what the gyro reads is times this
Job = namedtuple("Job", ("source", "filter", "scale", "seed"), defaults=(1.0, 0))
TILT_SIGMAS, YAW_SIGMAS = 2.45, 1.96  # of 95 % in two dimensions, and in one

_done = None  # samples filtered so far, shared by the workers


def _share(counter):
    """In a worker, which runs the board's code twice as fast unchecked: the tests check it."""
    global _done
    _done = counter
    install_micropython(checked=False)


def _tick(samples):
    with _done.get_lock():
        _done.value += samples


def load(job):
    """The Recording of a job."""
    if job.source in cases.CASES:
        return cases.CASES[job.source](job.seed)
    rec = recordings.load(job.source)
    rec.gyro_dps *= job.scale
    return rec


def run(job, tick=None):
    """(scores by name, up vectors, 95 % bound of the tilt in degrees or None) of one job."""
    from tools.accuracy.filters import FILTERS, SIMULATED

    simulated = job.source in cases.CASES
    rec = load(job)
    found = (SIMULATED if simulated else FILTERS)[job.filter](rec, tick or _tick)
    bound = None
    if found.sigma_deg is not None:
        bound = (TILT_SIGMAS * found.sigma_deg[:, 0]).astype(np.float32)
    return scores(rec, found), None if simulated else found.up.astype(np.float32), bound


def scores(rec, found):
    """rms_deg, peak_deg of the tilt; with a yaw, slope_deg_min of the heading; with bounds,
    tilt_inside and yaw_inside: the part of the time in which the truth is in them. All over the
    samples that count."""
    error = rec.error_deg(found.up)[rec.counted]
    out = {"rms_deg": float(np.sqrt(np.mean(error**2))), "peak_deg": float(error.max())}
    if found.quat is None:
        return out
    off = product(found.quat, rec.quat * (1, -1, -1, -1))[rec.counted]
    heading = np.degrees(np.unwrap(2 * np.arctan2(off[:, 3], off[:, 0])))
    minutes = np.flatnonzero(rec.counted) / rec.rate_hz / 60
    out["slope_deg_min"] = float(np.polyfit(minutes, heading, 1)[0])
    if found.sigma_deg is not None:
        tilt, yaw = found.sigma_deg[rec.counted].T
        out["tilt_inside"] = float(np.mean(error < TILT_SIGMAS * tilt))
        wrong = np.abs((heading - heading[0] + 180) % 360 - 180)  # a whole turn is none
        out["yaw_inside"] = float(np.mean(wrong < YAW_SIGMAS * yaw))
    return out


def measure(work, workers=None, quiet=False):
    """{job: run()'s} of all jobs, over the cores; a bar only on a terminal."""
    sizes = {}
    for job in work:
        if (job.source, job.seed) not in sizes:
            sizes[job.source, job.seed] = len(load(job))
    total = sum(sizes[job.source, job.seed] for job in work)
    # the board's code takes longest: it starts first
    work = sorted(work, key=lambda job: "fixed" not in job.filter)
    context = multiprocessing.get_context("spawn")
    counter = context.Value("q", 0)
    quiet = quiet or not sys.stderr.isatty()
    with ProcessPoolExecutor(
        workers or os.cpu_count(), context, _share, (counter,)
    ) as pool, tqdm(total=total, unit="sample", unit_scale=True, disable=quiet) as bar:
        futures = {job: pool.submit(run, job) for job in work}
        while not all(f.done() for f in futures.values()):
            time.sleep(0.2)
            bar.update(counter.value - bar.n)
        bar.update(counter.value - bar.n)
        return {job: future.result() for job, future in futures.items()}

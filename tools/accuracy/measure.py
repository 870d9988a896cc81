# SPDX-License-Identifier: MIT
"""All filters on all recordings, over the processor's cores.

Not in __main__.py: a worker has to find run() by its name, and does not load the command.
"""

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
from tqdm import tqdm

from tools import recordings
from tools.accuracy.filters import FILTERS

_done = None  # samples filtered so far, shared by the workers


def _share(counter):
    global _done
    _done = counter


def _tick(samples):
    with _done.get_lock():
        _done.value += samples


def run(path, name):
    """(rms error in degrees, up vectors) of one filter on one recording."""
    rec = recordings.load(path)
    up = FILTERS[name](rec, _tick)
    return rec.rmse_deg(up), up.astype(np.float32)


def measure(paths, names, jobs=None, quiet=False):
    """{(name, path): (error, up)} of all filters on all recordings, over the cores."""
    lengths = {path: len(recordings.load(path)) for path in paths}
    # the checked integer code takes longest: it starts first
    work = sorted(((n, p) for n in names for p in paths), key=lambda w: "fixed" not in w[0])
    context = multiprocessing.get_context("spawn")
    counter = context.Value("q", 0)
    total = sum(lengths.values()) * len(names)
    with ProcessPoolExecutor(jobs or os.cpu_count(), context, _share, (counter,)) as pool, tqdm(
        total=total, unit="sample", unit_scale=True, disable=quiet
    ) as bar:
        futures = {w: pool.submit(run, w[1], w[0]) for w in work}
        while not all(f.done() for f in futures.values()):
            time.sleep(0.2)
            bar.update(counter.value - bar.n)
        bar.update(counter.value - bar.n)
        return {w: f.result() for w, f in futures.items()}

# SPDX-License-Identifier: MIT
"""The last minute again with other settings, and tuning from it, in a process of its own."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor

import numpy as np

SECONDS = 60.0


class Past:
    """Work on a Track beside the page: Futures."""

    def __init__(self):
        context = multiprocessing.get_context("spawn")
        self._pool = ProcessPoolExecutor(1, context)
        self._pool.submit(_ready)  # the imports take a second: now, not at the first slider

    def rerun(self, track, changes):
        """Of {"angles": (n x 3), "rms_deg", "rms_now_deg", "seconds"}."""
        return self._pool.submit(_rerun, track, changes)

    def tuned(self, track):
        """Of tools.tune's figures, and the report as text."""
        return self._pool.submit(_tuned, track)

    def close(self):
        """End the process."""
        self._pool.shutdown(wait=False, cancel_futures=True)


def _ready():
    from tools.replay import grade  # noqa: F401
    from tools.tune import search  # noqa: F401


_known = {}  # the hindsight of the newest track


def _rerun(track, changes):
    import time

    from tools.replay import engine, grade

    began = time.perf_counter()
    angles = engine.run(track, engine.changed(track.settings, changes))
    key = float(track.t_s[-1]), len(track), track.counts[-1].tobytes()
    if key not in _known:
        _known.clear()
        _known[key] = grade.reference(track)[:2]
    up, counted = _known[key]
    found = {"angles": angles.astype(np.float32), "seconds": time.perf_counter() - began}
    if counted.any():
        found["rms_deg"] = grade.rms_deg(angles, up, counted)
        found["rms_now_deg"] = grade.rms_deg(track.angles_deg, up, counted)
    return found


def _tuned(track):
    import tempfile
    from pathlib import Path

    from tools.tune import report
    from tools.tune.__main__ import lines, proposed

    figures = proposed([track], [track.settings["filter"]], lambda text: None)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        report.write(path, [track], figures, lines(figures))
        return figures, path.read_text()

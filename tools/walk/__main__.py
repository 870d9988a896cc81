# SPDX-License-Identifier: MIT
"""Walks many random walks over all cores; prints the shortest that breaks a promise as a test."""

import argparse
import contextlib
import io
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed

from tqdm import tqdm

_PART = 20  # walks in one go of a process


def walked(seed, count, steps):
    """(board, steps, what broke) of the shortest walk that breaks something, or None."""
    from hypothesis import HealthCheck, Phase, settings
    from hypothesis import seed as seeded
    from hypothesis.stateful import run_state_machine_as_test

    from tools.walk.machine import Walk

    chosen = settings(
        max_examples=count, stateful_step_count=steps, deadline=None, database=None,
        suppress_health_check=list(HealthCheck), report_multiple_bugs=False,
        phases=(Phase.generate, Phase.shrink),
    )  # fmt: skip
    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            run_state_machine_as_test(seeded(seed)(Walk), settings=chosen)
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt) and not Walk.last.steps:
            raise
        return Walk.last.board, Walk.last.steps, "%s: %s" % (type(error).__name__, error)
    return None


def as_test(board, steps, what):
    """The walk as a test of host_tests/firmware/test_walked.py."""
    lines = ["def test_NAME(tmp_path):", '    """%s"""' % what.split("\n")[0][:90]]
    lines.append("    steps = [")
    for name, parameters in steps:
        told = {k: v for k, v in parameters.items() if v is not None and v is not False}
        if name == "set":
            told["value"] = parameters["value"]
        if not told.get("how"):
            told.pop("after", None)
        lines.append("        (%r, %r)," % (name, told))
    return "\n".join([*lines, "    ]", "    replay(%r, steps, tmp_path)" % board])


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.walk", description=__doc__)
    parser.add_argument("--sequences", type=int, default=2000)
    parser.add_argument("--steps", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--processes", type=int, default=os.cpu_count())
    arguments = parser.parse_args()
    parts = -(-arguments.sequences // _PART)
    found = []
    bar = tqdm(total=arguments.sequences, unit="walk", disable=None)
    with ProcessPoolExecutor(arguments.processes, max_tasks_per_child=1) as pool, bar:
        jobs = [
            pool.submit(walked, 1000 * arguments.seed + part, _PART, arguments.steps)
            for part in range(parts)
        ]
        for job in as_completed(jobs):
            bar.update(_PART)
            if job.result():
                found.append(job.result())
                bar.write(as_test(*found[-1]) + "\n")
    print("%d walks of %d steps: %d of %d parts broke a promise"
          % (parts * _PART, arguments.steps, len(found), parts))  # fmt: skip
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Walks many random walks over all cores; prints the shortest that breaks a promise as a test."""

import argparse
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed

from tqdm import tqdm

from tools.walk.search import as_test, walked

_PART = 20  # walks in one go of a process


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

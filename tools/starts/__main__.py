# SPDX-License-Identifier: MIT
"""What the app knows from its start on: how soon, how true, and whether it says so.

    python -m tools.starts [--only SCENE ...] [--runs 1000] [--json FILE]

poor_bus: starts with one transfer in 200 failing and a sensor 0 to 100 ms late; settings: every
dlpf_hz with some sensor_hz and every part, at rest; the others: switched on in motion, turns and
warmth afterwards (tools.starts.moving). A line with its bar is one figure of all its runs.
"""

import argparse
import json
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed

from tqdm import tqdm

from tools import starts
from tools.starts import moving

AT_REST = ("poor_bus", "settings")
BARS = {  # figure: the most that is allowed
    "poor_bus": {"not started": 0, "later than 1 s": 0.001},
    "settings": {"bias off, deg/s": 0.1, "with a warning": 0},
}


def figures_at_rest(results):
    """{figure: value} of many starts; prints why some failed."""
    good = sorted(r["seconds"] for r in results if "seconds" in r)
    figures = {
        "starts": len(results),
        "not started": len(results) - len(good),
        "later than 1 s": round(1 - sum(seconds <= 1.0 for seconds in good) / len(results), 4),
        "median, s": round(good[len(good) // 2], 3),
        "slowest, s": round(good[-1], 3),
        "bias off, deg/s": round(max(r.get("bias_off_dps", 0) for r in results), 3),
        "with a warning": sum(bool(r.get("warnings")) for r in results),
    }
    for text in sorted({r["error"] for r in results if "error" in r}):
        print(text)
    return figures


def work_of(names, runs):
    """[(name, function, argument)]."""
    work = []
    if "poor_bus" in names:
        work += [("poor_bus", starts.start, seed) for seed in range(runs)]
    if "settings" in names:
        work += [("settings", starts.at, setting) for setting in starts.settings()]
    for name in names:
        if name in moving.SCENES:
            scene = moving.SCENES[name]
            work += [(name, scene.run, case) for case in scene.cases]
    return work


def measure(names, runs, jobs=None):
    """{name: [(argument, result)]} over the cores."""
    work = work_of(names, runs)
    results = {name: [] for name in names}
    with ProcessPoolExecutor(jobs or os.cpu_count()) as pool:
        # long ones first
        futures = {pool.submit(function, case): (n, case) for n, function, case in work[::-1]}
        for future in tqdm(as_completed(futures), total=len(work), unit="run", disable=None):
            name, case = futures[future]
            results[name].append((case, future.result()))
    return results


def told(name, rows):
    """Print the figures of one scene; ({figure: value}, whether all are within their bars)."""
    if name in AT_REST:
        title, bars = name, BARS[name]
        figures = figures_at_rest([result for _, result in rows])
    else:
        scene = moving.SCENES[name]
        title, bars, figures = f"{name}: {scene.what}", scene.bars, {"runs": len(rows)}
        for figure in rows[0][1]:
            case, result = max(rows, key=lambda row: row[1][figure])
            figures[figure] = round(result[figure], 3)
            if result[figure] > bars.get(figure, result[figure]):
                print(f"   {name}, worst: {case}")
    print(title)
    good = True
    for figure, value in figures.items():
        bar, word = bars.get(figure), ""
        if bar is not None:
            good = good and value <= bar
            word = f"  at most {bar:g}" + ("" if value <= bar else "   <- over")
        print(f"  {figure:34}{value:10}{word}")
    return figures, good


def main(arguments=None):
    """The command; 1 when a figure is beyond its bar."""
    names = [*AT_REST, *moving.SCENES]
    parser = argparse.ArgumentParser(prog="python -m tools.starts", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--only", nargs="+", choices=names, default=names, metavar="SCENE",
                        help=", ".join(names))  # fmt: skip
    parser.add_argument("--runs", type=int, default=1000, help="of poor_bus")
    parser.add_argument("--jobs", type=int, help="processes, default: one per core")
    parser.add_argument("--json", metavar="FILE")
    options = parser.parse_args(arguments)
    results = measure(options.only, options.runs, options.jobs)
    all_told = {name: told(name, results[name]) for name in options.only}
    if options.json:
        with open(options.json, "w") as file:
            json.dump({name: figures for name, (figures, _) in all_told.items()}, file, indent=1)
    return 0 if all(good for _, good in all_told.values()) else 1


if __name__ == "__main__":
    sys.exit(main())

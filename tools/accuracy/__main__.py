# SPDX-License-Identifier: MIT
"""Tilt error of every filter on recordings with optical truth, fed as the sensor's counts.

`python -m tools.accuracy [--data DIR] [--json FILE] [--out PICTURE]`; without --data on the
project's excerpts. The error is the angle between estimated and true up, root mean square over
the samples in motion. VQF stands beside them when the package vqf is installed.
"""

import argparse
import importlib.util
import json
import sys
from pathlib import Path

import numpy as np

from tools import recordings
from tools.accuracy.filters import FILTERS
from tools.accuracy.measure import measure

TWINS = ("attitude", "fixed.attitude")


def angle_between_deg(a, b):
    """(n) angles between two sets of up vectors."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


def report(results, paths, names):
    """The results as the JSON contract has them, and the twins' difference per trial."""
    filters = {}
    for name in names:
        trials = {path.stem: round(results[name, path][0], 4) for path in paths}
        mean = round(float(np.mean(list(trials.values()))), 4)
        filters[name] = {"mean_deg": mean, "trials": trials}
    out = {"filters": filters}
    if all(name in names for name in TWINS):
        out["difference_deg"] = {
            path.stem: round(float(np.sqrt(np.mean(
                angle_between_deg(results[TWINS[0], path][1], results[TWINS[1], path][1]) ** 2
            ))), 4)
            for path in paths
        }
    return out


def table(data):
    """The report as text: a row for each filter, a column for each trial."""
    filters = data["filters"]
    trials = list(next(iter(filters.values()))["trials"])
    rows = [[n, *(f["trials"][t] for t in trials), f["mean_deg"]] for n, f in filters.items()]
    if "difference_deg" in data:
        apart = data["difference_deg"]
        mean = float(np.mean(list(apart.values())))
        rows.append(["attitude - fixed", *(apart[t] for t in trials), mean])
    lines = ["tilt error, degrees RMS"]
    lines += [f"  {chr(65 + i)} = {trial}" for i, trial in enumerate(trials)]
    heads = [chr(65 + i) for i in range(len(trials))] + ["mean"]
    lines.append(" " * 18 + "".join(f"{head:>8}" for head in heads))
    lines += [f"{row[0]:18}" + "".join(f"{x:8.3f}" for x in row[1:]) for row in rows]
    return "\n".join(lines)


def available(names=None):
    """The filters to run: all, less vqf where it is not installed."""
    unknown = sorted(set(names or ()) - set(FILTERS))
    if unknown:
        raise SystemExit(f"no filter {', '.join(unknown)}; there are {', '.join(FILTERS)}")
    installed = importlib.util.find_spec("vqf") is not None
    able = [name for name in FILTERS if installed or not name.startswith("vqf")]
    return [name for name in able if not names or name in names]


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m tools.accuracy", description=__doc__.split("\n\n")[0]
    )
    parser.add_argument("--data", help="folder of .npz or .mat recordings")
    parser.add_argument("--json", help="write the errors to this file")
    parser.add_argument("--out", default="out/accuracy.png", help="the picture")
    parser.add_argument("--filters", nargs="+", help=f"some of: {', '.join(FILTERS)}")
    parser.add_argument("--jobs", type=int, help="processes (default: one for each core)")
    args = parser.parse_args(argv)
    names = available(args.filters)
    try:
        paths = recordings.files(args.data)
        results = measure(paths, names, args.jobs)
    except (OSError, ValueError) as error:
        sys.exit(f"accuracy: {error}")
    data = report(results, paths, names)
    print(table(data))
    if args.json:
        Path(args.json).parent.mkdir(parents=True, exist_ok=True)
        Path(args.json).write_text(json.dumps(data, indent=1) + "\n")
    from tools.accuracy.picture import draw

    draw(results, paths, data, Path(args.out))
    print(f"picture: {args.out}")


if __name__ == "__main__":
    main()

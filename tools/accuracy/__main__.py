# SPDX-License-Identifier: MIT
"""Tilt error of every filter on recordings with optical truth, fed as the sensor's counts.

`python -m tools.accuracy [--data DIR] [--json FILE] [--out PICTURE]`; without --data on the
project's excerpts; --parts: the recordings, the same with a gyro whose scale is off, simulated
cases. The error is the angle between estimated and true up, root mean square over the samples in
motion. VQF stands beside them when the package vqf is installed.
"""

import argparse
import importlib.util
import json
import sys
from pathlib import Path

from tools import recordings
from tools.accuracy import report
from tools.accuracy.cases import CASES
from tools.accuracy.filters import FILTERS, SCALED, SIMULATED
from tools.accuracy.measure import Job, measure

PARTS = ("recordings", "scaled", "simulated")
FACTORS = (0.97, 0.99, 1.01, 1.03)  # the datasheet allows the gyro 3 %
SEEDS = (0, 1, 2)


def available(names=None):
    """The filters to run: all, less vqf where it is not installed."""
    known = [*FILTERS, *(name for name in SIMULATED if name not in FILTERS)]
    unknown = sorted(set(names or ()) - set(known))
    if unknown:
        raise SystemExit(f"no filter {', '.join(unknown)}; there are {', '.join(known)}")
    installed = importlib.util.find_spec("vqf") is not None
    able = [name for name in known if installed or not name.startswith("vqf")]
    return [name for name in able if not names or name in names]


def jobs(parts, paths, names, cases):
    """All that is to be run."""
    out = []
    if "recordings" in parts:
        out += [Job(path, name) for name in names if name in FILTERS for path in paths]
    if "scaled" in parts:
        out += [Job(path, name, factor) for name in SCALED if name in names
                for path in paths for factor in FACTORS]
    if "simulated" in parts:
        out += [Job(case, name, 1.0, seed) for name in SIMULATED if name in names
                for case in cases for seed in SEEDS]
    return out


def gathered(results, parts, paths, names, cases):
    """The results as tools.accuracy.report has them."""
    data = {}
    if "recordings" in parts:
        data = report.of_recordings(results, paths, [name for name in names if name in FILTERS])
    scaled = [name for name in SCALED if name in names]
    if "scaled" in parts and scaled:
        data["scaled"] = report.of_scaled(results, paths, scaled, FACTORS)
    simulated = [name for name in SIMULATED if name in names]
    if "simulated" in parts and simulated:
        data["simulated"], inside = report.of_simulated(results, cases, simulated, SEEDS)
        if inside:
            data["inside"] = {**data.get("inside", {}), **inside}
    return data


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m tools.accuracy", description=__doc__.split("\n\n")[0]
    )
    parser.add_argument("--data", help="folder of recordings: see tools.recordings")
    parser.add_argument("--json", help="write the errors to this file")
    parser.add_argument("--out", default="out/accuracy.png", help="the picture")
    parser.add_argument("--filters", nargs="+", help=f"some of: {', '.join(available())}")
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=PARTS)
    parser.add_argument("--cases", nargs="+", choices=list(CASES), default=list(CASES),
                        metavar="CASE", help="some of the simulated ones")
    parser.add_argument("--jobs", type=int, help="processes (default: one for each core)")
    args = parser.parse_args(argv)
    names = available(args.filters)
    try:
        paths = recordings.files(args.data) if set(args.parts) - {"simulated"} else []
        results = measure(jobs(args.parts, paths, names, args.cases), args.jobs)
    except (OSError, ValueError) as error:
        sys.exit(f"accuracy: {error}")
    data = gathered(results, args.parts, paths, names, args.cases)
    print(report.text(data))
    if args.json:
        Path(args.json).parent.mkdir(parents=True, exist_ok=True)
        Path(args.json).write_text(json.dumps(data, indent=1) + "\n")
    from tools.accuracy.picture import draw

    draw(results, paths, data, Path(args.out))
    print(f"picture: {args.out}")


if __name__ == "__main__":
    main()

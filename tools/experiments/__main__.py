# SPDX-License-Identifier: MIT
"""Run the papers' experiments: pictures, index.html (opens from a file) and results.json."""

import argparse
import importlib
import json
import sys
import time
from pathlib import Path

from tools.experiments import gallery

ALL = (
    "p000_filters",
    "p000_loop",
    "p001_imu",
    "p001_gps",
    "p002_step",
    "p002_platform",
    "p004_programs",
    "balance",
    "quad",
    "rates",
)


def main(argv=None):
    """Return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m tools.experiments", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/experiments"), help="folder")
    parser.add_argument("--only", nargs="+", choices=ALL, default=ALL, metavar="NAME",
                        help="some of: " + " ".join(ALL))
    parser.add_argument("--seeds", type=int, default=100, help="runs behind Table I")
    options = parser.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    outcomes, results = [], {}
    for name in options.only:
        began = time.monotonic()
        module = importlib.import_module(f"tools.experiments.{name}")
        outcome = module.run(options.out, seeds=options.seeds)
        outcomes.append(outcome)
        results |= outcome.values
        print(f"\n{outcome.title} ({name}, {time.monotonic() - began:.0f} s)")
        print(gallery.as_text(outcome), flush=True)
    gallery.write(options.out / "index.html", outcomes)
    (options.out / "results.json").write_text(json.dumps(results, indent=2) + "\n")
    print(f"\n{(options.out / 'index.html').resolve()}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

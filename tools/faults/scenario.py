# SPDX-License-Identifier: MIT
"""`python -m tools.faults.scenario FILE`: the app in motion through a scenario of faults.

FILE is a JSON list such as [{"at_s": 5.0, "fault": "nack", "for_s": 0.05}] (tools.virtual.faults
knows the names); times count from power-on. Prints each outage as the app saw it.
"""

import argparse
import sys

from tools.faults.kinds import Kind
from tools.faults.rig import Rig
from tools.virtual.faults import load_scenario

AFTER_S = 1.5  # watched after the last fault


def play(faults, platform="rp2", motion="free", say=print):
    """Run the faults; the app's stats() at the end. `say` gets a line for each change."""
    kind = Kind("scenario", (), (0, 0), (), motion=motion)
    with Rig(kind, platform) as rig:
        rig.bus.faults[:] = faults
        began = len(rig.rows)
        ends = [(fault.end_ns or fault.start_ns) / 1e9 for fault in faults]
        rig.run(max(ends, default=rig.now_s) + AFTER_S - rig.now_s)
        rows = rig.rows[began:]
        errors = rig.errors(rows)
        state, since = "good", rows[0][0]
        worst = 0.0
        for row, error in zip(rows, errors):
            now = "good" if row[1] else "predicted" if row[2] else "stale"
            if now != state:
                say(_line(since, state, row[0], worst))
                state, since, worst = now, row[0], 0.0
            worst = max(worst, error)
        say(_line(since, state, rows[-1][0], worst))
        stats = rig.stats()
        stats["uncaught"] = rig.uncaught
        return stats


def _line(since, state, until, worst):
    return f"{since:8.3f} s  {state:10}{until - since:8.3f} s   error up to {worst:.2f} deg"


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.faults.scenario", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("file", metavar="FILE")
    parser.add_argument("--board", choices=("rp2", "esp32"), default="rp2")
    parser.add_argument("--motion", choices=("free", "swing"), default="free")
    options = parser.parse_args()
    try:
        faults = load_scenario(options.file)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    print("\nstats:", play(faults, options.board, options.motion))
    return 0


if __name__ == "__main__":
    sys.exit(main())

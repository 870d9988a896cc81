# SPDX-License-Identifier: MIT
"""Every fault kind injected at random moments into the app in motion, on the virtual boards.

    python -m tools.faults [--json FILE] [--runs N] [--only KIND ...] [--out PICTURE]

A fault is detected when a counter of its cause moves, and over when samples are good again. The
error is the angle between true and estimated up: `claimed` while the app says neither stale nor
uncertain; yaw: its drift since the fault began, claimed. `hard`: on MicroPython 1.26, whose tick
is a hard interrupt.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from tools.faults.kinds import ITS_OWN, KINDS
from tools.faults.measure import BOARDS, measure


def summary(results):
    """The figures as the JSON file has them."""
    kinds = {}
    for name, boards in results.items():
        outcomes = [outcome for board in boards.values() for outcome in board[0]]
        recovered = [o.recovery_s for o in outcomes if o.recovery_s is not None]
        kinds[name] = {
            "runs": len(outcomes),
            "detected": sum(o.detected for o in outcomes),
            "recovered": len(recovered),
            "max_recovery_s": round(max(recovered, default=-1), 4),
            "max_error_deg": round(max(o.error_deg for o in outcomes), 3),
            "held_error_deg": round(max(o.during_deg for o in outcomes), 3),
            "error_1s_deg": round(max(o.after_deg for o in outcomes), 3),
            "yaw_error_deg": round(max(o.yaw_deg for o in outcomes), 3),
            "yaw_1s_deg": round(max(o.yaw_after_deg for o in outcomes), 3),
            "hard": _hard(boards.get("rp2 hard", ((), 0))[0]),
        }
    uncaught = sum(board[1] for boards in results.values() for board in boards.values())
    return {"kinds": kinds, "uncaught": uncaught}


def _hard(outcomes):
    """What the runs with the tick in a hard interrupt had."""
    recovered = [o.recovery_s for o in outcomes if o.recovery_s is not None]
    return {
        "runs": len(outcomes),
        "lost": sum(o.counts.get("lost", 0) for o in outcomes),
        "max_recovery_s": round(max(recovered, default=-1), 4),
        "max_error_deg": round(max((o.error_deg for o in outcomes), default=0.0), 3),
    }


def verdict(name, row):
    """What is wrong with a row, a text; empty when all is well."""
    kind = next(kind for kind in KINDS if kind.name == name)
    wrong = []
    if row["detected"] < row["runs"]:
        wrong.append("not detected")
    if row["recovered"] < row["runs"]:
        wrong.append("not recovered")
    if row["max_recovery_s"] > kind.bar_s:
        wrong.append(f"slower than {kind.bar_s * 1000:.0f} ms")
    if row["max_error_deg"] > kind.error_deg:
        wrong.append(f"error above {kind.error_deg:g} deg")
    if row["error_1s_deg"] > kind.after_deg:
        wrong.append(f"after 1 s above {kind.after_deg:g} deg")
    return ", ".join(wrong)


def table(data):
    """The figures as text."""
    lines = [
        f"{'fault':18}{'runs':>5}{'seen':>6}{'over':>6}{'recovery, ms':>14}{'bar':>6}"
        f"{'claimed':>10}{'any':>8}{'1 s after':>11}{'yaw':>8}{'1 s after':>11}"
        f"{'hard: lost':>12}{'error':>8}",
        f"{'':18}{'':31}{'':6}{'largest error, degrees':>29}",
    ]
    for name, row in data["kinds"].items():
        kind = next(kind for kind in KINDS if kind.name == name)
        lines.append(
            f"{name:18}{row['runs']:5}{row['detected']:6}{row['recovered']:6}"
            f"{row['max_recovery_s'] * 1000:14.1f}{kind.bar_s * 1000:6.0f}"
            f"{row['max_error_deg']:10.2f}{row['held_error_deg']:8.2f}{row['error_1s_deg']:11.2f}"
            f"{row['yaw_error_deg']:8.2f}{row['yaw_1s_deg']:11.2f}"
            f"{row['hard']['lost']:12}{row['hard']['max_error_deg']:8.2f}"
            f"  {verdict(name, row)}"
        )
    lines.append(f"\nuncaught exceptions: {data['uncaught']}")
    return "\n".join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.faults", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--runs", type=int, default=20, help="injections per kind and board")
    parser.add_argument("--only", nargs="+", choices=[k.name for k in KINDS], metavar="KIND")
    parser.add_argument(
        "--boards", nargs="+", default=BOARDS, metavar="BOARD",
        help='"rp2", "rp2 hard", "esp32", or a chip and a version of MicroPython: "ESP32S3 1.29"',
    )  # fmt: skip
    parser.add_argument("--sensor", choices=("mpu6050", "minimu9"), default="mpu6050")
    parser.add_argument("--jobs", type=int, help="processes, default: one per core")
    parser.add_argument("--out", type=Path, default=Path("out/faults.png"), help="the picture")
    options = parser.parse_args(arguments)
    began = time.monotonic()
    names = options.only or [k.name for k in KINDS]
    if options.sensor == "minimu9":
        names = [name for name in names if name not in ITS_OWN]
    results = measure(
        names, options.runs, options.jobs, sensor=options.sensor, boards=options.boards
    )
    data = summary(results)
    print(table(data))
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(data, indent=1) + "\n")
    from tools.faults.picture import draw

    draw(results, options.out)
    print(f"picture: {options.out.resolve()}   ({time.monotonic() - began:.0f} s)")
    bad = [name for name, row in data["kinds"].items() if verdict(name, row)]
    return 1 if bad or data["uncaught"] else 0


if __name__ == "__main__":
    sys.exit(main())

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
from tools.faults.measure import BOARDS, ESP32, bar_s, measure


def summary(results):
    """The figures as the JSON file has them."""
    kinds = {}
    for name, boards in results.items():
        kind = next(kind for kind in KINDS if kind.name == name)
        outcomes = [outcome for board in boards.values() for outcome in board[0]]
        recovered = [o.recovery_s for o in outcomes if o.recovery_s is not None]
        kinds[name] = {
            "runs": len(outcomes),
            "detected": sum(o.detected for o in outcomes),
            "recovered": len(recovered),
            "max_recovery_s": round(max(recovered, default=-1), 4),
            "later_s": round(_later_s(kind, boards), 4),
            "max_error_deg": round(max(o.error_deg for o in outcomes), 3),
            "held_error_deg": round(max(o.during_deg for o in outcomes), 3),
            "error_1s_deg": round(max(o.after_deg for o in outcomes), 3),
            "yaw_error_deg": round(max(o.yaw_deg for o in outcomes), 3),
            "yaw_1s_deg": round(max(o.yaw_after_deg for o in outcomes), 3),
            "hard": _hard(boards.get("rp2 hard", ((), 0))[0]),
        }
    uncaught = sum(board[1] for boards in results.values() for board in boards.values())
    return {"kinds": kinds, "uncaught": uncaught}


def _later_s(kind, boards):
    """How much later than allowed the slowest recovery was; negative: sooner."""
    late = [-1.0]
    for board, (outcomes, _) in boards.items():
        bar = bar_s(kind, board)
        late += [o.recovery_s - bar for o in outcomes if o.recovery_s is not None]
    return max(late)


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
    if row["later_s"] > 0:
        wrong.append(f"later than allowed by {row['later_s'] * 1000:.0f} ms")
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


def by_board(results):
    """A line for each board: all kinds together, and those that are beyond their bars, as text."""
    lines = [
        f"\n{'board':16}{'runs':>6}{'seen':>6}{'over':>6}{'recovery, ms':>14}{'claimed, deg':>14}"
        f"{'1 s after':>11}"
    ]
    for board in next(iter(results.values())):
        rows = summary({name: {board: boards[board]} for name, boards in results.items()})["kinds"]
        bad = [f"{name}: {verdict(name, row)}" for name, row in rows.items() if verdict(name, row)]
        rows = rows.values()
        lines.append(
            f"{board:16}{sum(r['runs'] for r in rows):6}{sum(r['detected'] for r in rows):6}"
            f"{sum(r['recovered'] for r in rows):6}"
            f"{1000 * max(r['max_recovery_s'] for r in rows):14.1f}"
            f"{max(r['max_error_deg'] for r in rows):14.2f}"
            f"{max(r['error_1s_deg'] for r in rows):11.2f}  {'; '.join(bad)}"
        )
    return "\n".join(lines)


# a sensor is as good as another within a fifth, a tick and the noise of an angle
_WITHIN, _TICK_S, _NOISE_DEG = 1.2, 0.004, 0.1


def compared(first, second):
    """(text, kinds that are worse) of another sensor's figures beside the first's."""
    lines, worse = [f"\n{'fault':18}{'recovery, ms':>20}{'claimed, degrees':>20}"], []
    for name, row in second["kinds"].items():
        before = first["kinds"][name]
        over = (
            row["max_recovery_s"] > _WITHIN * before["max_recovery_s"] + _TICK_S
            or row["max_error_deg"] > _WITHIN * before["max_error_deg"] + _NOISE_DEG
        )
        if over:
            worse.append(name)
        lines.append(
            f"{name:18}{before['max_recovery_s'] * 1000:10.1f}{row['max_recovery_s'] * 1000:10.1f}"
            f"{before['max_error_deg']:10.2f}{row['max_error_deg']:10.2f}"
            f"{'  worse' if over else ''}"
        )
    lines.append(f"\n{len(second['kinds']) - len(worse)} of {len(second['kinds'])} kinds as good")
    return "\n".join(lines), worse


def main(arguments=None):
    options = _options(arguments)
    began = time.monotonic()
    names = options.only or [k.name for k in KINDS]
    told = {}
    for sensor in ("mpu6050", "minimu9") if options.sensor == "both" else (options.sensor,):
        mine = [name for name in names if sensor == "mpu6050" or name not in ITS_OWN]
        results = measure(mine, options.runs, options.jobs, sensor=sensor, boards=options.boards)
        told[sensor] = summary(results)
        print(f"{sensor}\n{table(told[sensor])}")
        if tuple(options.boards) != BOARDS:
            print(by_board(results))
    bad = [name for data in told.values() for name, row in data["kinds"].items()
           if verdict(name, row)]  # fmt: skip
    bad += ["uncaught" for data in told.values() if data["uncaught"]]
    if options.sensor == "both":
        text, worse = compared(*told.values())
        print(text)
        bad += worse
    else:
        told = told[options.sensor]
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(told, indent=1) + "\n")
    from tools.faults.picture import draw

    draw(results, options.out)
    print(f"picture: {options.out.resolve()}   ({time.monotonic() - began:.0f} s)")
    return 1 if bad else 0


def _options(arguments):
    parser = argparse.ArgumentParser(prog="python -m tools.faults", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--runs", type=int, default=20, help="injections per kind and board")
    parser.add_argument("--only", nargs="+", choices=[k.name for k in KINDS], metavar="KIND")
    parser.add_argument(
        "--boards", nargs="+", default=BOARDS, metavar="BOARD",
        help='"rp2", "rp2 hard", "esp32", or a chip and a version of MicroPython: "ESP32S3 1.29"',
    )  # fmt: skip
    parser.add_argument(
        "--esp32", dest="boards", action="store_const", const=ESP32,
        help="ESP32, S3 and C3 with MicroPython 1.24 to 1.29; a line for each",
    )  # fmt: skip
    parser.add_argument(
        "--sensor", choices=("mpu6050", "minimu9", "both"), default="mpu6050",
        help="both: one beside the other",
    )  # fmt: skip
    parser.add_argument("--jobs", type=int, help="processes, default: one per core")
    parser.add_argument("--out", type=Path, default=Path("out/faults.png"), help="the picture")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())

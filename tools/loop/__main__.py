# SPDX-License-Identifier: MIT
"""What ordinary Python beside it does to the loop: ticks lost, lateness, errors.

    python -m tools.loop [--json FILE] [--ticks N] [--versions 1.26.1 1.25.0] [--loads ...]

The app runs on the emulated RP2040 with the real MicroPython, at 250, 500 and 1000 Hz, while the
foreground is idle, allocates, collects, answers the REPL, or allocates while the bus has faults.
From 1.26 on the tick is a hard interrupt, which has to keep the bars below; before, it is a soft
callback, whose figures are what they are, over a fifth of the ticks. Emulated code is slower than
the chip, so the whole takes long. --upsets 10 plays, in place of the loads, ten emulated seconds
of all that people do beside a loop, in any order.
"""

import argparse
import json
import multiprocessing
import os
import sys
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from tqdm import tqdm

from tools.loop import upsets
from tools.loop.run import FAULTS, LOADS, measure
from tools.virtual import images

LATE_P99_US, LATE_MAX_US = 20, 60  # what a hard tick has to keep
HARD = (1, 26)  # the first release with hard timers


def table(results):
    """The figures as text."""
    lines = []
    for result in results:
        lines.append(f"MicroPython {result['micropython']}")
        lines.append(
            f"{'load':12}{'Hz':>6}{'tick':>6}{'expected':>10}{'lost':>6}{'late p99, us':>14}"
            f"{'max':>8}{'step p99':>10}{'predicted':>11}{'errors':>8}"
        )
        for row in result["rows"]:
            lines.append(
                f"{row['load']:12}{row['rate_hz']:6}{row['tick']:>6}{row['expected']:10}"
                f"{row['lost']:6}{row['late_p99_us']:14}{row['late_max_us']:8}"
                f"{row['step_p99_us']:10}{row['predicted']:11}{row['errors']:8}"
            )
            if "recovery_ms" in row:
                lines.append("            good again, ms: " + str(row["recovery_ms"]))
    return "\n".join(lines)


def bad(row):
    """What a hard row does not keep, in words."""
    out = [f"{row['lost']} lost"] if row["lost"] else []
    out += [f"{row['errors']} errors"] if row["errors"] else []
    for name, bar in (("late_p99_us", LATE_P99_US), ("late_max_us", LATE_MAX_US)):
        if row[name] > bar:
            out.append(f"{name} {row[name]}")
    for name, _, _, _, allowed_ms in FAULTS if "recovery_ms" in row else ():
        found = row["recovery_ms"][name]
        if found is None or found > allowed_ms:
            out.append(f"{name} good after {found} ms, not {allowed_ms}")
    return out


def is_hard(version):
    """Whether this release ticks in a hard interrupt."""
    return tuple(int(part) for part in version.split(".")[:2]) >= HARD


def measured(versions, loads, ticks, jobs=None):
    """[{"micropython", "rows"}] in this order, measured over the cores."""
    rows = {version: {} for version in versions}
    context = multiprocessing.get_context("spawn")
    bar = tqdm(total=len(versions) * len(loads), unit="load", disable=not sys.stderr.isatty())
    with ProcessPoolExecutor(jobs or os.cpu_count(), context) as pool, bar:
        futures = {
            pool.submit(measure, version, load, ticks if is_hard(version) else ticks // 5): (
                version,
                load,
            )
            for version in versions
            for load in loads
        }
        for future in as_completed(futures):
            version, load = futures[future]
            rows[version][load] = future.result()
            bar.update()
    return [
        {"micropython": version, "rows": [row for load in loads for row in rows[version][load]]}
        for version in versions
    ]


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.loop", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--ticks", type=int, default=2000, help="of each row")
    parser.add_argument("--versions", nargs="+", default=sorted(images.VERSIONS, reverse=True))
    parser.add_argument("--loads", nargs="+", choices=LOADS, default=LOADS)
    parser.add_argument("--jobs", type=int, help="processes, default: one per core")
    parser.add_argument("--upsets", type=float, metavar="SECONDS", help="tools.loop.upsets")
    parser.add_argument("--seed", type=int, default=1, help="of the upsets' order")
    drives = ("timer", "data-ready")
    parser.add_argument("--drive", choices=drives, default="timer", help="of the upsets")
    options = parser.parse_args(arguments)
    if options.upsets:
        rate_hz = 1000 if options.drive == "timer" else 500  # the bursts of edges wait in the tick
        version = options.versions[0]
        found = upsets.at_random(
            options.upsets, options.seed, rate_hz, version, options.drive, say=print
        )
        print(upsets.table(found))
        return 1 if any(upsets.faults(seen) for seen in found) else 0
    for version in options.versions:
        images.rp2040_image(version)
    results = measured(options.versions, options.loads, options.ticks, options.jobs)
    print(table(results))
    if options.json:
        # the newest one's rows by themselves, the others beside them
        first, others = results[0], results[1:]
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps({**first, "others": others}, indent=1) + "\n")
    failures = 0
    for result in results:
        for row in result["rows"]:
            for text in bad(row) if row["tick"] == "hard" else ():
                print(f"{result['micropython']}, {row['load']}, {row['rate_hz']} Hz: {text}")
                failures += 1
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Puts measured figures into the site's pages: nobody types them.

`python -m tools.figures DIR` takes the results that the other commands wrote into DIR (bench.json,
accuracy.json, faults.json, results.json; those that are there) and rewrites the tables between
`<!-- NAME -->` and `<!-- end NAME -->` of docs/site, and the firmware's table of faults.
`make figures` measures and does this.
"""

import argparse
import json
from pathlib import Path

from tools import bench as measured
from tools.virtual.port import Port

SITE = Path(__file__).resolve().parent.parent / "docs" / "site"
PAGES = {"faults": "faults.md", "policy": "faults.md"}  # the others stand in numbers.md
RATES_HZ = (250, 500, 1000)


def table(head, rows):
    """A Markdown table, numbers to the right."""
    lines = ["| " + " | ".join(head) + " |", "|---" + "|---:" * (len(head) - 1) + "|"]
    lines += ["| " + " | ".join(map(str, row)) + " |" for row in rows]
    return "\n".join(lines)


def bench(result):
    """Time and heap of each stage, and the share of the period that a step takes."""
    rows = []
    for row in result["rows"]:
        is_step = row["name"].startswith(("step.", "split."))
        shares = [f"{row['us'] * hz / 1e4:.0f} %" if is_step else "" for hz in RATES_HZ]
        rows.append([f"`{row['name']}`", f"{row['us']:.0f}", f"{row['bytes']:.0f}", *shares])
    head = ["stage", "us", "heap bytes", *(f"of {hz} Hz" for hz in RATES_HZ)]
    (us, share), (split_us, split_share) = (
        measured.checks(result)[burst] for burst in ("blocking", "split")
    )
    left = ", ".join(f"{100 * part:.0f} % at {hz} Hz" for hz, part in result["left"].items())
    return (
        f"{result['board']}, {result['mhz']} MHz:\n\n{table(head, rows)}\n\n"
        "`app` is a whole tick of the app, with the burst waited for (`blocking`) or in the "
        f"background (`split`).\nIts health checks add {us:.0f} us, {share:.1f} %, to the first "
        f"and {split_us:.0f} us, {split_share:.0f} %, to the second, which is so much shorter.\n"
        f"Beside the app the processor is free for {left}."
    )


def accuracy(result):
    """Tilt error of each filter, mean and worst recording; with a gyro whose scale is off; how
    often the truth is in the bounds; simulated cases."""
    filters = sorted(result["filters"].items(), key=lambda item: item[1]["mean_deg"])
    rows = [
        (f"`{name}`", f"{f['mean_deg']:.2f}", f"{max(f['trials'].values()):.2f}",
         f"{f['slope_deg_min']:.1f}" if "slope_deg_min" in f else "")
        for name, f in filters
    ]  # fmt: skip
    head = ["filter", "mean, deg", "worst, deg", "heading, deg/min"]
    parts = [f"{len(filters[0][1]['trials'])} recordings:\n\n" + table(head, rows)]
    scaled = result.get("scaled")
    if scaled:
        names = list(next(iter(scaled.values())))
        rows = [(f"`{n}`", *(f"{row[n]:.2f}" for row in scaled.values())) for n in names]
        head = ["mean, deg", *scaled]
        parts.append("With all that the gyro reads times\n\n" + table(head, rows))
    if "inside" in result:
        rows = [
            (f"`{name}`", *(f"{part:.0%}" for kind in ("tilt", "yaw") for part in row[kind]))
            for name, row in result["inside"].items()
        ]
        head = ["", "tilt, least", "mean", "yaw, least", "mean"]
        parts.append("The truth inside the claimed 95 % bound\n\n" + table(head, rows))
    if "simulated" in result:
        names = list(next(iter(result["simulated"].values())))
        rows = [
            (case, *(f"{row[n]['rms_deg']:.2f} / {row[n]['peak_deg']:.1f}" for n in names))
            for case, row in result["simulated"].items()
        ]
        head = ["RMS / largest, deg", *(f"`{name}`" for name in names)]
        parts.append("Simulated cases\n\n" + table(head, rows))
    return "\n\n".join(parts)


def faults(result):
    """Each fault kind: runs, detected, recovered, the slowest recovery, the largest errors."""
    rows = [
        (name, k["runs"], k["detected"], k["recovered"], f"{k['max_recovery_s'] * 1000:.0f}",
         f"{k['max_error_deg']:.2f}", f"{k['error_1s_deg']:.2f}", f"{k['yaw_error_deg']:.2f}",
         f"{k['yaw_1s_deg']:.2f}", k["hard"]["lost"], f"{k['hard']['max_error_deg']:.2f}")
        for name, k in result["kinds"].items()
    ]  # fmt: skip
    head = ["fault", "runs", "detected", "recovered", "slowest, ms", "error, deg", "1 s after",
            "yaw, deg", "1 s after", "hard: ticks lost", "hard: error, deg"]  # fmt: skip
    return table(head, rows) + f"\n\nUncaught exceptions: {result['uncaught']}."


def results(result):
    """The four papers' systems in three lines."""
    rows = [
        (name, f"{r['overshoot_pct']:.1f}", f"{r['rise_s']:.3f}", f"{r['smoothness_deg']:.3f}")
        for name, r in result["table1"].items()
    ]
    step = table(["20 degree step", "overshoot, %", "rise, s", "smoothness, deg"], rows)
    platform, quad = result["platform"], result["quad"]
    return step + (
        f"\n\nPlatform: {platform['rms_deg']:.2f} deg RMS, peak {platform['peak_deg']:.2f} deg. "
        f"Balancing robot: stood {result['balance']['stood_s']:.0f} s. "
        f"Quadcopter step: {quad['step_us']:.0f} us, {quad['bytes']} bytes."
    )


SEEN = {  # how each cause of firmware.faults.policy is seen
    "nack": "the sensor does not acknowledge (EIO, ENODEV)",
    "timeout": "the bus does not move (ETIMEDOUT)",
    "fill": "temperature and gyro all equal: asleep, or a broken transfer",
    "frozen": "the same 14 bytes for longer than a sensor's noise allows",
    "jump": "a rate or force that leaps for one or two samples",
    "saturated": "a rate at its full scale: the true one is larger",
    "register": "a register, read twice, does not hold its setting",
    "another": "WHO_AM_I is that of another part",
    "clock": "the ticks' mean period is more than 1.5 % off: the filter follows",
}


def policy():
    """What the firmware does about each cause, from its own table."""
    with Port("rp2"):
        from firmware.faults import policy as health
    names = ("HOLD", "VERIFY", "REPAIR", "RESET", "RECOVER", "RING", "ADOPT")
    actions = {getattr(health, name): name.lower() for name in names}
    rows = []
    for row in health.POLICY[1:]:
        when = actions[row.action] + (f", after {row.after}" if row.after > 1 else "")
        rows.append((f"`{row.cause}`", SEEN[row.cause], when))
    lines = ["| cause in `app.stats()` | how it is seen | then |", "|---|---|---|"]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in rows])


SECTIONS = {"bench": bench, "accuracy": accuracy, "faults": faults, "results": results}


def put(text, name, body):
    """The text with the section's body replaced. ValueError when the marks are missing."""
    begin, end = f"<!-- {name} -->\n", f"<!-- end {name} -->"
    if begin not in text or end not in text:
        raise ValueError(f"the page has no section {name}")
    before, rest = text.split(begin, 1)
    return before + begin + body + "\n" + end + rest.split(end, 1)[1]


def write(name, body):
    """Put a section into its page."""
    page = SITE / PAGES.get(name, "numbers.md")
    page.write_text(put(page.read_text(), name, body))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("results", type=Path, help="folder with the commands' --json files")
    folder = parser.parse_args().results
    found = [name for name in SECTIONS if (folder / f"{name}.json").exists()]
    for name in found:
        write(name, SECTIONS[name](json.loads((folder / f"{name}.json").read_text())))
    write("policy", policy())
    print(f"{SITE}: {', '.join(found) or 'nothing'} from {folder}")


if __name__ == "__main__":
    main()

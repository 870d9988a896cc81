# SPDX-License-Identifier: MIT
"""Proposes settings from recordings: time constants, Kalman's noises; and tells of noise and
vibration.

    python -m tools.tune FILE... [--filter NAME ...] [--json OUT] [--html REPORT]

Each filter's settings are sought by their distance to the best hindsight, an acausal smoother
over the same recording (tools.replay.grade). What is no clear gain on every file is not proposed.
JSON: settings (all, with what is proposed), changed, rms_deg and rms_unchanged_deg (against the
truth where a file has it, else against the hindsight), filters, noise, vibration.
"""

import argparse
import json
import sys
from pathlib import Path

import numpy as np

from tools.replay import engine, grade
from tools.track import load
from tools.tune import noise, vibration
from tools.tune.search import SEARCHED, Judge, tuned


def graded(tracks, changes):
    """Mean error in degrees over the tracks, and against what."""
    errors, kinds = [], set()
    for track in tracks:
        up, counted, against = grade.reference(track)
        angles = engine.run(track, engine.changed(track.settings, changes))
        errors.append(grade.rms_deg(angles, up, counted))
        kinds.add(against)
    return round(float(np.mean(errors)), 4), " and ".join(sorted(kinds))


def proposed(tracks, names, tell=print):
    """The dict that --json writes; `names`: filters, the first of which the settings are for."""
    judge = Judge(tracks)
    filters = {}
    for name in names:
        changes = tuned(judge, name, tell)
        before, against = graded(tracks, {"filter": name})
        after = graded(tracks, {"filter": name, **changes})[0] if changes else before
        filters[name] = {
            "changed": changes, "rms_unchanged_deg": before, "rms_deg": after, "against": against,
        }  # fmt: skip
    own = filters[names[0]]
    return {
        "settings": {**tracks[0].settings, "filter": names[0], **own["changed"]},
        **own,
        "files": [track.name for track in tracks],
        "replays": judge.runs,
        "filters": filters,
        "noise": {track.name: noise.at_rest(track) for track in tracks},
        "vibration": {track.name: vibration.advice(track) for track in tracks},
    }


def lines(figures):
    """The Python that sets what is proposed, at the board's REPL."""
    out = [f"app.set({name!r}, {value!r})" for name, value in figures["changed"].items()]
    return [*out, "app.save()"] if out else ["# nothing to change: the defaults are as good"]


def tell(figures):
    """The figures as text."""
    for name, row in figures["filters"].items():
        change = "%.3f -> %.3f degrees (%s)" % (
            row["rms_unchanged_deg"], row["rms_deg"], row["against"],
        )  # fmt: skip
        print(f"{name}: {change}" if row["changed"] else f"{name}: defaults stay, {change}")
    for name, row in figures["noise"].items():
        if row is None:
            print(f"{name}: no ten seconds at rest, so nothing about noise")
            continue
        for kind in ("raw", "used"):
            gyro = max(row[kind]["gyro_dps"], key=lambda axis: axis["white"])
            print(
                f"{name}: gyro at rest, {kind}: {1000 * gyro['white']:.1f} mdeg/s/rtHz, "
                f"instability {3600 * gyro['instability']:.1f} deg/h at {gyro['at_s']:.1f} s"
            )
    for name, rows in figures["vibration"].items():
        for row in rows[:3]:
            print(f"{name}: {row['words']}")
    print(*lines(figures), sep="\n")


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.tune", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("files", nargs="+", type=Path, metavar="FILE")
    parser.add_argument("--filter", nargs="+", choices=list(SEARCHED), metavar="NAME",
                        help="default: that of the first recording")  # fmt: skip
    parser.add_argument("--json", type=Path, metavar="OUT")
    parser.add_argument("--html", type=Path, metavar="REPORT")
    options = parser.parse_args(arguments)
    try:
        tracks = [load(path) for path in options.files]
        names = options.filter or [tracks[0].settings["filter"]]
        figures = proposed(tracks, names, lambda text: print(text, file=sys.stderr))
    except (OSError, ValueError) as error:
        sys.exit(f"tune: {error}")
    tell(figures)
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(figures, indent=1) + "\n")
    if options.html:
        from tools.tune.report import write

        write(options.html, tracks, figures, lines(figures))
        print(f"report: {options.html}")


if __name__ == "__main__":
    main()

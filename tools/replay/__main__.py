# SPDX-License-Identifier: MIT
"""Runs the board's own filter over a recording, with other settings if you like.

    python -m tools.replay FILE [--set name=value ...] [--json OUT] [--out PICTURE]

FILE: what tools.record wrote, or a recording with optical truth. The tilt error is against that
truth where there is one, else against the best hindsight (tools.replay.grade). Beside it stands
the same for the settings of the recording; what the board itself had is drawn too.
"""

import argparse
import json
import sys
import time
from pathlib import Path

from tools.replay import engine, grade
from tools.track import load


def value_of(text):
    """A knob's value as it is typed: a number, or a word."""
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def compared(track, changes):
    """The figures, a dict, and {name: angles} to draw."""
    settings = engine.changed(track.settings, changes)
    began = time.process_time()
    angles = engine.run(track, settings)
    seconds = time.process_time() - began
    up, counted, against = grade.reference(track)
    figures = {
        "settings": settings,
        "changed": changes,
        "rms_deg": round(grade.rms_deg(angles, up, counted), 4),
        "against": against,
        "samples": len(track),
        "seconds": round(float(track.t_s[-1] - track.t_s[0]), 3),
        "times_real_time": round(float(track.t_s[-1] - track.t_s[0]) / max(seconds, 1e-3), 1),
        "gaps": len(track.gaps),
    }
    drawn = {"replayed": angles}
    if changes:
        as_was = engine.run(track, track.settings)
        figures["rms_unchanged_deg"] = round(grade.rms_deg(as_was, up, counted), 4)
        drawn["settings as recorded"] = as_was
    if track.angles_deg is not None:
        figures["rms_on_board_deg"] = round(grade.rms_deg(track.angles_deg, up, counted), 4)
        drawn["on the board"] = track.angles_deg
    return figures, drawn


def draw(path, track, drawn):
    """Roll and pitch over time, one line for each."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(2, 1, sharex=True, figsize=(11, 6), layout="constrained")
    for axis, at, name in zip(axes, (0, 1), ("roll", "pitch")):
        for (label, angles), style in zip(drawn.items(), ("-", "--", ":")):
            axis.plot(track.t_s, angles[:, at], style, label=label, linewidth=1)
        axis.set_ylabel(f"{name}, degrees")
    axes[0].legend()
    axes[1].set_xlabel("seconds")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=110)


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.replay", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("file", type=Path, metavar="FILE")
    parser.add_argument("--set", nargs="+", default=[], metavar="NAME=VALUE", help="knobs")
    parser.add_argument("--json", type=Path, metavar="OUT")
    parser.add_argument("--out", type=Path, metavar="PICTURE")
    options = parser.parse_args(arguments)
    try:
        pairs = [item.partition("=") for item in options.set]
        changes = {name: value_of(text) for name, _, text in pairs}
        track = load(options.file)
        figures, drawn = compared(track, changes)
    except (OSError, ValueError) as error:
        sys.exit(f"replay: {error}")
    shown = {name: value for name, value in figures.items() if name != "settings"}
    print(json.dumps(shown, indent=1))
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(figures, indent=1) + "\n")
    if options.out:
        draw(options.out, track, drawn)
        print(f"picture: {options.out}")


if __name__ == "__main__":
    main()

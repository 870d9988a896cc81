# SPDX-License-Identifier: MIT
"""The results as the JSON contract has them, and as text.

filters: {name: {mean_deg, trials: {trial: deg}}}, and of filters with a yaw slope_deg_min, the
mean size of the heading's slope; difference_deg: {trial: RMS angle between the twins};
scaled: {factor of the gyro: {filter: mean_deg}}; inside: {filter: {tilt, yaw}}, the least and the
mean part of the time in which the truth was in the 95 % bounds; simulated: {case: {filter:
{rms_deg, peak_deg}}}, means over the seeds.
"""

import numpy as np

from tools.accuracy.measure import Job

TWINS = ("attitude", "fixed.attitude")


def angle_between_deg(a, b):
    """(n) angles between two sets of up vectors."""
    a, b = np.asarray(a, float), np.asarray(b, float)
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.sum(a * b, axis=1)))


def mean(values, digits=4):
    """Rounded."""
    return round(float(np.mean(list(values))), digits)


def of_recordings(results, paths, names):
    """filters, difference_deg and inside."""
    filters, inside = {}, {}
    for name in names:
        scores = {path.stem: results[Job(path, name)][0] for path in paths}
        trials = {trial: round(s["rms_deg"], 4) for trial, s in scores.items()}
        filters[name] = {"mean_deg": mean(trials.values()), "trials": trials}
        if all("slope_deg_min" in s for s in scores.values()):
            filters[name]["slope_deg_min"] = mean(abs(s["slope_deg_min"]) for s in scores.values())
        if all("tilt_inside" in s for s in scores.values()):
            inside[name] = within(scores.values())
    out = {"filters": filters}
    if inside:
        out["inside"] = inside
    if all(name in names for name in TWINS):
        twins = [{path: results[Job(path, name)][1] for path in paths} for name in TWINS]
        out["difference_deg"] = {
            path.stem: round(float(np.sqrt(np.mean(
                angle_between_deg(twins[0][path], twins[1][path]) ** 2))), 4)
            for path in paths
        }  # fmt: skip
    return out


def within(scores):
    """{tilt, yaw: [least, mean]} of the bounds."""
    out = {}
    for kind in ("tilt", "yaw"):
        parts = [s[f"{kind}_inside"] for s in scores]
        out[kind] = [round(min(parts), 3), mean(parts, 3)]
    return out


def of_scaled(results, paths, names, factors):
    """scaled."""
    return {
        f"{factor:g}": {
            name: mean(results[Job(path, name, factor)][0]["rms_deg"] for path in paths)
            for name in names
        }
        for factor in factors
    }


def of_simulated(results, cases, names, seeds):
    """simulated, and what of it belongs to inside."""
    table, claims = {}, {}
    for case in cases:
        table[case] = {}
        for name in names:
            scores = [results[Job(case, name, 1.0, seed)][0] for seed in seeds]
            table[case][name] = {
                kind: mean((s[kind] for s in scores), 3) for kind in ("rms_deg", "peak_deg")
            }
            if "tilt_inside" in scores[0]:
                claims.setdefault(f"{name}, simulated", []).extend(scores)
    return table, {name: within(scores) for name, scores in claims.items()}


# ---- text


def text(data):
    """All of it as tables."""
    parts = []
    if "filters" in data:
        parts.append(_recordings(data))
    if "scaled" in data:
        parts.append(_scaled(data["scaled"]))
    if "inside" in data:
        lines = ["truth inside the 95 % bound: least, mean of the trials"]
        for name, row in data["inside"].items():
            cells = (f"{kind} {low:.2f} {typical:.2f}" for kind, (low, typical) in row.items())
            lines.append(f"{name:28}" + "   ".join(cells))
        parts.append("\n".join(lines))
    if "simulated" in data:
        parts.append(_simulated(data["simulated"]))
    return "\n\n".join(parts)


def _recordings(data):
    """A row for each filter, a column for each trial."""
    filters = data["filters"]
    trials = list(next(iter(filters.values()))["trials"])
    rows = [[n, *(f["trials"][t] for t in trials), f["mean_deg"]] for n, f in filters.items()]
    if "difference_deg" in data:
        apart = data["difference_deg"]
        rows.append(["attitude - fixed", *(apart[t] for t in trials), mean(apart.values())])
    lines = ["tilt error, degrees RMS"]
    lines += [f"  {chr(65 + i)} = {trial}" for i, trial in enumerate(trials)]
    heads = [chr(65 + i) for i in range(len(trials))] + ["mean"]
    lines.append(" " * 28 + "".join(f"{head:>8}" for head in heads) + "   deg/min")
    for row in rows:
        slope = filters.get(row[0], {}).get("slope_deg_min")
        end = "" if slope is None else f"{slope:10.2f}"
        lines.append(f"{row[0]:28}" + "".join(f"{x:8.3f}" for x in row[1:]) + end)
    return "\n".join(lines)


def _scaled(data):
    """A row for each filter, a column for each factor."""
    lines = ["mean tilt error with the gyro times"]
    lines.append(" " * 28 + "".join(f"{factor:>8}" for factor in data))
    for name in next(iter(data.values())):
        lines.append(f"{name:28}" + "".join(f"{row[name]:8.3f}" for row in data.values()))
    return "\n".join(lines)


def _simulated(data):
    """A row for each case, RMS and largest error of each filter."""
    names = list(next(iter(data.values())))
    lines = ["simulated: tilt error, degrees RMS / largest"]
    lines.append(" " * 32 + "".join(f"{name:>18}" for name in names))
    for case, row in data.items():
        cells = (f"{row[name]['rms_deg']:.2f} / {row[name]['peak_deg']:.2f}" for name in names)
        lines.append(f"{case:32}" + "".join(f"{cell:>18}" for cell in cells))
    return "\n".join(lines)

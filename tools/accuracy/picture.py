# SPDX-License-Identifier: MIT
"""The picture of tools.accuracy: errors of all filters, one trial over time with its bound, a gyro
whose scale is off, and the simulated cases. What was not run is left out."""

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from tools import recordings
from tools.accuracy.measure import Job

_MARKERS = "osv^DPX*<>"
_LINES = {  # of the plot over time: dash, width and grey tell them apart without colour
    "kalman_tilt": (":", 1.0, "0.55"),
    "vqf, led 2.5 ms": ("-", 2.2, "0.7"),
    "attitude": ("-", 1.0, "tab:blue"),
    "fixed.attitude": ((0, (4, 3)), 1.0, "black"),
}


def draw(results, paths, data, target):
    """Save the picture; the trial over time is the one hardest for `attitude`."""
    parts = []
    if data.get("filters"):
        parts += [(_errors, 1.2), (_over_time, 1.0)]
    if "scaled" in data:
        parts.append((_scaled, 0.7))
    if "simulated" in data:
        parts.append((_simulated, 1.6))
    if not parts:
        return
    ratios = [ratio for _, ratio in parts]
    figure, axes = plt.subplots(len(parts), 1, figsize=(10, 4 * sum(ratios)), squeeze=False,
                                height_ratios=ratios)
    for (part, _), axis in zip(parts, axes[:, 0], strict=True):
        part(axis, results, paths, data)
    figure.tight_layout()
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=120)
    plt.close(figure)


def _errors(axis, _, paths, data):
    filters = data["filters"]
    rows = list(filters)[::-1]
    for i, path in enumerate(paths):
        values = [filters[name]["trials"][path.stem] for name in rows]
        axis.plot(values, range(len(rows)), _MARKERS[i % len(_MARKERS)], ms=6, mfc="none",
                  color=str(0.15 + 0.1 * (i % 5)), label=path.stem)
    axis.plot([filters[name]["mean_deg"] for name in rows], range(len(rows)), "|", ms=22, mew=2.5,
              color="black", label="mean")
    axis.set_yticks(range(len(rows)), rows)
    axis.set_xscale("log")
    axis.set_xlabel("tilt error in motion, degrees RMS (logarithmic)")
    axis.grid(True, axis="x", which="both", alpha=0.3)
    axis.legend(fontsize=7, loc="lower right")


def _over_time(axis, results, paths, data):
    filters = data["filters"]
    shown = [name for name in _LINES if name in filters] or list(filters)[-1:]
    judge = filters["attitude" if "attitude" in filters else shown[-1]]["trials"]
    path = max(paths, key=lambda p: judge[p.stem])
    rec = recordings.load(path)
    time_s = np.arange(len(rec)) / rec.rate_hz
    bounds = [results[Job(path, name)][2] for name in reversed(shown)]
    bound = next((bound for bound in bounds if bound is not None), None)
    if bound is not None:
        bound = np.where(rec.counted, bound, np.nan)
        axis.plot(time_s, bound, ls="-", lw=0.8, color="tab:red", label="95 % bound, as claimed")
    for name in shown:
        dash, width, colour = _LINES.get(name, ("-", 1.0, "black"))
        error = np.where(rec.counted, rec.error_deg(results[Job(path, name)][1]), np.nan)
        axis.plot(time_s, _smooth(error, round(rec.rate_hz)), ls=dash, lw=width, color=colour,
                  label=name)
    axis.set_xlabel(f"time in {path.stem}, s")
    axis.set_ylabel("tilt error, degrees RMS over 1 s")
    axis.set_yscale("log")
    axis.grid(True, alpha=0.3)
    axis.legend(fontsize=8, ncols=5, loc="upper center")
    axis.margins(y=0.15)


def _scaled(axis, _, __, data):
    rows = data["scaled"]
    factors = sorted([float(factor) for factor in rows] + ([1.0] if data.get("filters") else []))
    for name, mark in zip(next(iter(rows.values())), _MARKERS):
        values = [rows[f"{factor:g}"][name] if f"{factor:g}" in rows
                  else data["filters"][name]["mean_deg"] for factor in factors]
        axis.plot(factors, values, mark + "-", mfc="none", label=name)
    axis.set_xlabel("all that the gyro reads, times")
    axis.set_ylabel("mean tilt error, degrees RMS")
    axis.grid(True, alpha=0.3)
    axis.legend(fontsize=8)


def _simulated(axis, _, __, data):
    cases = list(data["simulated"])[::-1]
    names = list(data["simulated"][cases[0]])
    for k, name in enumerate(names):
        rows = [data["simulated"][case][name] for case in cases]
        at = np.arange(len(cases)) + 0.12 * (k - 1)
        low = [max(row["rms_deg"], 0.01) for row in rows]
        high = [max(row["peak_deg"], 0.01) for row in rows]
        [line] = axis.plot(low, at, _MARKERS[k], mfc="none", label=f"{name}: RMS to largest")
        axis.hlines(at, low, high, lw=1, color=line.get_color())
    axis.set_yticks(range(len(cases)), cases)
    axis.set_xscale("log")
    axis.set_xlabel("simulated: tilt error, degrees (logarithmic)")
    axis.grid(True, axis="x", which="both", alpha=0.3)
    axis.legend(fontsize=8, loc="lower right")


def _smooth(error, n):
    """Root mean square over n samples; NaN where more than half of them are."""
    kernel = np.ones(n)
    known = np.convolve(~np.isnan(error), kernel, "same")
    power = np.convolve(np.nan_to_num(error) ** 2, kernel, "same")
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(known > n / 2, np.sqrt(power / known), np.nan)

# SPDX-License-Identifier: MIT
"""The picture of tools.accuracy: errors of all filters, and one trial over time."""

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from tools import recordings

_MARKERS = "osv^DPX*<>"
_LINES = {  # of the second plot: dash, width and grey tell them apart without colour
    "kalman_tilt": (":", 1.0, "0.55"),
    "vqf": ("-", 2.2, "0.7"),
    "attitude": ("-", 1.0, "tab:blue"),
    "fixed.attitude": ((0, (4, 3)), 1.0, "black"),
}


def draw(results, paths, data, target):
    """Save the picture; the trial over time is the one hardest for `attitude`."""
    figure, (left, right) = plt.subplots(2, 1, figsize=(10, 8), height_ratios=(1.1, 1))
    filters = data["filters"]
    rows = list(filters)[::-1]
    for i, path in enumerate(paths):
        values = [filters[name]["trials"][path.stem] for name in rows]
        left.plot(values, range(len(rows)), _MARKERS[i % len(_MARKERS)], ms=6, mfc="none",
                  color=str(0.15 + 0.1 * (i % 5)), label=path.stem)
    left.plot([filters[name]["mean_deg"] for name in rows], range(len(rows)), "|", ms=22, mew=2.5,
              color="black", label="mean")
    left.set_yticks(range(len(rows)), rows)
    left.set_xscale("log")
    left.set_xlabel("tilt error in motion, degrees RMS (logarithmic)")
    left.grid(True, axis="x", which="both", alpha=0.3)
    left.legend(fontsize=7, loc="lower right")
    _over_time(right, results, paths, filters)
    figure.tight_layout()
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=120)
    plt.close(figure)


def _over_time(axes, results, paths, filters):
    shown = [name for name in _LINES if name in filters] or list(filters)[-1:]
    judge = filters["attitude" if "attitude" in filters else shown[-1]]["trials"]
    path = max(paths, key=lambda p: judge[p.stem])
    rec = recordings.load(path)
    time_s = np.arange(len(rec)) / rec.rate_hz
    for name in shown:
        dash, width, colour = _LINES.get(name, ("-", 1.0, "black"))
        error = np.where(rec.counted, rec.error_deg(results[name, path][1]), np.nan)
        axes.plot(time_s, _smooth(error, round(rec.rate_hz)), ls=dash, lw=width, color=colour,
                  label=name)
    axes.set_xlabel(f"time in {path.stem}, s")
    axes.set_ylabel("tilt error, degrees RMS over 1 s")
    axes.set_yscale("log")
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8, ncols=4, loc="upper center")
    axes.margins(y=0.15)


def _smooth(error, n):
    """Root mean square over n samples; NaN where more than half of them are."""
    kernel = np.ones(n)
    known = np.convolve(~np.isnan(error), kernel, "same")
    power = np.convolve(np.nan_to_num(error) ** 2, kernel, "same")
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(known > n / 2, np.sqrt(power / known), np.nan)

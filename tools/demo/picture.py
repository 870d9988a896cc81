# SPDX-License-Identifier: MIT
"""The picture of tools.demo: truth and estimates over time, and their errors."""

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from tools.demo.estimates import error_deg, rms
from tools.recordings import roll_pitch_deg

WINDOW_S = 12.0
# dash, width and colour differ, so that grey print tells the lines apart as well
STYLES = {
    "accelerometer alone": (":", 0.8, "0.6"),
    "gyro integral": ("-.", 1.0, "tab:brown"),
    "complementary": ((0, (1, 1)), 1.0, "tab:green"),
    "kalman_tilt": ((0, (3, 1, 1, 1)), 1.0, "tab:purple"),
    "fixed.kalman2": ((0, (6, 2)), 0.9, "0.4"),
    "attitude": ("--", 1.2, "tab:blue"),
    "fixed.attitude": ("-", 1.1, "tab:red"),
}


def draw(recorded, target):
    """Save the picture as `target` (.png), its folder made if need be."""
    t_s = recorded["t_s"] - recorded["t_s"][0]
    middle = t_s[-1] / 2
    shown = (t_s >= middle - WINDOW_S / 2) & (t_s <= middle + WINDOW_S / 2)
    figure, axes = plt.subplots(3, 1, figsize=(11, 11), height_ratios=(1, 1, 1.1))
    truth = roll_pitch_deg(recorded["up"])
    for row, name in enumerate(("roll", "pitch")):
        panel = axes[row]
        panel.plot(t_s[shown], truth[row][shown], "-", lw=3.0, color="0.8", label="optical truth")
        for label, up in recorded["estimates"].items():
            dash, width, colour = STYLES[label]
            angle = roll_pitch_deg(up)[row][shown]
            panel.plot(t_s[shown], _unjumped(angle), ls=dash, lw=width, color=colour, label=label)
        panel.set_ylabel(f"{name}, degrees")
        panel.set_xlabel("time, s")
        panel.grid(True, alpha=0.3)
    axes[0].legend(fontsize=8, ncol=4, loc="upper center", bbox_to_anchor=(0.5, 1.22))
    for label, up in recorded["estimates"].items():
        dash, width, colour = STYLES[label]
        error = error_deg(up, recorded["up"])
        axes[2].plot(t_s, np.maximum(_smooth(error), 0.01), ls=dash, lw=width, color=colour,
                     label=f"{label}: {rms(error):.2f} RMS")  # fmt: skip
    axes[2].set_yscale("log")
    axes[2].set_ylabel("tilt error, degrees RMS over 0.5 s")
    axes[2].set_xlabel("time, s")
    axes[2].grid(True, which="both", alpha=0.3)
    axes[2].legend(fontsize=8, ncol=4, loc="upper center", bbox_to_anchor=(0.5, -0.13))
    figure.tight_layout()
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=110)
    plt.close(figure)


def _smooth(error):
    window = np.ones(125) / 125  # samples of 4 ms
    known = np.where(np.isnan(error), 0, error)
    return np.sqrt(np.convolve(known**2, window, "same"))


def _unjumped(angle_deg):
    """The angles with gaps where they pass from +180 to -180."""
    out = angle_deg.copy()
    out[1:][np.abs(np.diff(angle_deg)) > 180] = np.nan
    return out

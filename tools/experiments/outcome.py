# SPDX-License-Identifier: MIT
"""What an experiment hands back, and how its pictures look: axes with units, readable in grey."""

from dataclasses import dataclass, field

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

# dark to light and each with its own dash, so that no line needs its colour
LINES = (
    {"color": "#000000", "linestyle": "-", "linewidth": 1.6},
    {"color": "#9a2f00", "linestyle": "--", "linewidth": 1.4},
    {"color": "#0066aa", "linestyle": "-.", "linewidth": 1.4},
    {"color": "#5a9a00", "linestyle": ":", "linewidth": 1.8},
    {"color": "#b266b2", "linestyle": (0, (5, 1)), "linewidth": 1.2},
    {"color": "#e0a000", "linestyle": (0, (3, 1, 1, 1)), "linewidth": 1.4},
)
RAW = {"color": "#d8a090", "linestyle": "", "marker": ".", "markersize": 2.5, "zorder": 0}


@dataclass
class Outcome:
    """One experiment: pictures (file name, caption), table (header and rows), notes, values."""

    title: str
    paper: str
    pictures: list = field(default_factory=list)
    header: tuple = ()
    rows: list = field(default_factory=list)
    notes: list = field(default_factory=list)
    values: dict = field(default_factory=dict)


class Picture:
    """One figure with n panels above each other; `save` files it under the outcome."""

    def __init__(self, title, panels=1, height=4.2, x_label="time (s)", share=True):
        self.figure, axes = plt.subplots(
            panels, 1, figsize=(9, height), sharex=share, squeeze=False, layout="constrained"
        )
        self.axes = [row[0] for row in axes]
        self.axes[0].set_title(title)
        self.axes[-1].set_xlabel(x_label)

    def line(self, x, y, label, style=0, panel=0):
        """A labelled line; style is a row of LINES, or a dict."""
        how = style if isinstance(style, dict) else LINES[style % len(LINES)]
        self.axes[panel].plot(x, y, label=label, **how)

    def family(self, x, curves, panel=0):
        """Curves of one parameter from black to grey, as the papers draw their sweeps."""
        for k, (label, y) in enumerate(curves):
            shade = str(0.75 * k / max(1, len(curves) - 1))
            self.axes[panel].plot(x, y, label=label, color=shade, linewidth=1.1)

    def save(self, outcome, out, name, caption, y_labels):
        """Write out/name.png and list it; y_labels: one text with unit per panel."""
        for axis, label in zip(self.axes, y_labels, strict=True):
            axis.set_ylabel(label)
            axis.grid(True, color="#dddddd", linewidth=0.6)
            axis.legend(loc="best", fontsize=8)
        self.figure.savefig(out / f"{name}.png", dpi=110)
        plt.close(self.figure)
        outcome.pictures.append((f"{name}.png", caption))

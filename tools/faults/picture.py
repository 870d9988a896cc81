# SPDX-License-Identifier: MIT
"""The picture of tools.faults: how long each recovery took and how far the angle was off."""

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from tools.faults.kinds import KINDS

_MARKS = {"rp2": ("o", -0.22), "rp2 hard": ("^", 0.0), "esp32": ("x", 0.22)}


def draw(results, target):
    """Save the picture of {name: {board: (outcomes, uncaught)}}."""
    names = list(results)[::-1]
    kinds = {kind.name: kind for kind in KINDS}
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 0.32 * len(names) + 1.6), sharey=True)
    for row, name in enumerate(names):
        left.plot([1000 * kinds[name].bar_s] * 2, [row - 0.4, row + 0.4], "k", lw=2.5)
        for board, (outcomes, _) in results[name].items():
            mark, shift = _MARKS.get(board, ("x", 0.22))
            places = [row + shift] * len(outcomes)
            times = [max(0.5, 1000 * (o.recovery_s or 0.0)) for o in outcomes]
            left.plot(times, places, mark, color="tab:blue", ms=4, mfc="none")
            errors = [max(0.01, o.error_deg) for o in outcomes]
            right.plot(errors, places, mark, color="tab:blue", ms=4, mfc="none")
            after = [max(0.01, o.after_deg) for o in outcomes]
            right.plot(after, places, "|", color="black", ms=6)
    left.set_yticks(range(len(names)), names)
    left.set_xscale("log")
    left.set_xlabel("recovery after the fault's end, ms (0.5: at once; bar: allowed)")
    right.set_xscale("log")
    right.set_xlabel("claimed error (o rp2, ^ hard, x esp32) and error 1 s after (|), degrees")
    for axes in (left, right):
        axes.grid(True, axis="x", alpha=0.3)
    figure.tight_layout()
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=110)
    plt.close(figure)

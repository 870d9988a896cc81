# SPDX-License-Identifier: MIT
"""A step response as numbers: overshoot, rise, settling, smoothness."""

import numpy as np

ENDS = 0.1  # of the record, at each end: what is taken for the levels before and after
BAND = 0.05  # of the step, within which it has settled
LEAST_STEP = 6.0  # in standard deviations of the end: less is no step


def response(t, y):
    """{"from", "to", "rise_s" (10 to 90 %), "overshoot" (of the step), "settling_s",
    "smoothness"}: 1 for a way without detours, more for each. ValueError when there is no step.
    """
    t, y = np.asarray(t, float), np.asarray(y, float)
    size = max(3, int(ENDS * len(y)))
    if len(y) < 20:
        raise ValueError("too short")
    before, after = float(np.mean(y[:size])), float(np.mean(y[-size:]))
    step = after - before
    noise = max(float(np.std(y[:size])), float(np.std(y[-size:])), 1e-9)
    if abs(step) < LEAST_STEP * noise:
        raise ValueError("no step in it: it begins and ends alike")
    way = (y - before) / step
    begin = int(np.argmax(way > 0.1))
    reach = begin + int(np.argmax(way[begin:] > 0.9))
    outside = np.flatnonzero(np.abs(way - 1) > BAND)
    settled = int(outside[-1]) + 1 if len(outside) else begin
    moving = y[begin : settled + 1]
    travelled = float(np.sum(np.abs(np.diff(moving)))) if len(moving) > 1 else abs(step)
    return {
        "from": before,
        "to": after,
        "rise_s": float(t[reach] - t[begin]),
        "overshoot": max(0.0, float(np.max(way)) - 1),
        "settling_s": float(t[min(settled, len(t) - 1)] - t[begin]),
        "smoothness": travelled / max(abs(moving[-1] - moving[0]), 1e-9),
    }

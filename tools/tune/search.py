# SPDX-License-Identifier: MIT
"""A filter's settings by how near it comes to the best hindsight on some recordings.

The default is the null hypothesis: it stays unless a change brings the recordings nearer, in the
geometric mean, by at least WORTH. The smoother that serves as truth has ways of its own, and what
it prefers by a few percent is no gain; nor is what nobody sees, FLOOR_DEG. What suits one motion
does not suit another: tune on recordings of what the robot does.
"""

import math

import numpy as np

from firmware.config import KNOBS
from tools.replay import engine, grade

WORTH = 0.08  # of the error
FLOOR_DEG = 0.1  # added to each error before they are compared
WORST = 3.0  # a trial that takes one recording further away than by this leads nowhere
STEPS = (4.0, 2.0, 1.4)  # factors by which a setting is tried, one round each
# the filter: its settings that are searched. A Kalman filter's gains depend on q / r alone.
SEARCHED = {
    "attitude": ("attitude_tau_s", "attitude_rest_tau_s", "attitude_bias_tau_s"),
    "kalman2": ("kalman_r_measure", "kalman_q_bias"),
    "float.attitude": ("attitude_tau_s", "attitude_rest_tau_s", "attitude_bias_tau_s"),
    "float.kalman": ("kalman_r_measure", "kalman_q_bias"),
    "float.complementary": ("complementary_tau_s",),
}
_KNOB = {knob.name: knob for knob in KNOBS}


class Judge:
    """Errors of settings against the hindsight of each track. runs: how many replays it took."""

    def __init__(self, tracks):
        self._tracks = tracks
        self._references = []
        for track in tracks:
            up = grade.hindsight(track)
            counted = ~np.isnan(up).any(axis=1)
            counted[: int(grade.SETTLE_S * track.rate_hz)] = False
            if not counted.any():
                raise ValueError(f"{track.name}: too short; {2 * grade.SETTLE_S:.0f} s at least")
            self._references.append((up, counted))
        self._known = {}
        self.runs = 0

    def errors(self, changes):
        """(degrees of each track) with these settings; infinite where they are refused."""
        key = tuple(sorted(changes.items()))
        if key not in self._known:
            self._known[key] = self._measured(changes)
        return self._known[key]

    def _measured(self, changes):
        found = []
        for track, (up, counted) in zip(self._tracks, self._references):
            try:
                angles = engine.run(track, engine.changed(track.settings, changes))
            except (ValueError, OverflowError):
                return np.full(len(self._tracks), np.inf)
            found.append(grade.rms_deg(angles, up, counted))
        self.runs += 1
        return np.array(found)


def tuned(judge, name, tell=lambda text: None):
    """{knob: value} that are better than the defaults of the filter `name`; {} when none are.

    tell(text): each step of the search.
    """
    base = {"filter": name}
    default = judge.errors(base)
    best, gain = {}, 0.0
    for factor in STEPS:
        better = True
        while better:
            better = False
            for knob in SEARCHED[name]:
                for by in (factor, 1 / factor):
                    trial = {**best, knob: _times(knob, best.get(knob), by)}
                    now = _gain(default, judge.errors({**base, **trial}))
                    if now > gain + 0.002:
                        best, gain, better = trial, now, True
                        tell(f"{name}: {_said(best)}: {100 * gain:.1f} % nearer")
            if factor == STEPS[-1]:
                break
    if gain < WORTH:
        return {}
    return {knob: float(f"{value:.3g}") for knob, value in best.items()}


def _gain(before, after):
    """Part of the error that is gone, in the geometric mean of all."""
    if not np.all(np.isfinite(after)):
        return -math.inf
    ratio = (after + FLOOR_DEG) / (before + FLOOR_DEG)
    return 1 - float(np.exp(np.mean(np.log(ratio)))) if all(ratio < WORST) else -math.inf


def _times(name, value, by):
    knob = _KNOB[name]
    value = (knob.default if value is None else value) * by
    return min(max(value, knob.low or 1e-7), knob.high)


def _said(settings):
    return ", ".join(f"{name} = {value:.3g}" for name, value in settings.items())

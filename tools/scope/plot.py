# SPDX-License-Identifier: MIT
"""A chart of traces over time: plot.js on uPlot, or NiceGUI's own, more slowly, without it."""

import base64

import numpy as np
from nicegui import ui
from nicegui.element import Element

from tools.scope import assets

SLOW_ROWS = 400  # points of a trace in the slower chart


def rows(t, values, gap, period_s):
    """(t0, base64) of samples for plot.js; before a gap stands a row without values."""
    if not len(t):
        return 0.0, ""
    t0 = float(t[0])
    table = np.column_stack([t - t0, values]).astype(np.float32)
    holes = np.flatnonzero(gap)
    if len(holes):
        empty = np.full((len(holes), table.shape[1]), np.nan, np.float32)
        empty[:, 0] = t[holes] - period_s - t0
        table = np.insert(table, holes, empty, axis=0)
    return t0, base64.b64encode(table.tobytes()).decode()


class Plot(Element, component="plot.js"):
    """traces: [{"label", "unit", ...}], see plot.js. Its methods by name with run_method()."""

    quick = True

    def __init__(self, title, traces, height=260, seconds=10.0):
        super().__init__()
        self.traces = traces
        self._props.update(title=title, traces=traces, height=height, seconds=seconds)
        self.classes("w-full")

    def push(self, t, values, gap, period_s):
        """More samples."""
        if len(t):
            t0, text = rows(t, values, gap, period_s)
            self.run_method("push", t0, text, values.shape[1])

    def overlay(self, first, t0, values):
        """Values (n x those from trace `first` on) over the samples from t0 on."""
        text = base64.b64encode(np.ascontiguousarray(values, np.float32).tobytes()).decode()
        self.run_method("overlay", first, t0, text)


class SlowPlot(ui.echart):
    """The same with NiceGUI's own chart: a few pictures a second."""

    quick = False

    def __init__(self, title, traces, height=260, seconds=10.0):
        self.traces, self._seconds = traces, seconds
        self._t, self._values = np.zeros(0), np.zeros((0, len(traces)))
        self._paused, self._skip = False, 0
        series = [
            {"type": "line", "name": trace["label"], "showSymbol": False, "data": []}
            for trace in traces
        ]
        super().__init__({
            "animation": False, "title": {"text": title}, "legend": {}, "series": series,
            "xAxis": {"type": "value", "scale": True}, "yAxis": {"type": "value", "scale": True},
        })  # fmt: skip
        self.classes("w-full").style(f"height: {height}px")

    def push(self, t, values, _gap, _period_s):
        """More samples; every fifth time they are drawn."""
        wide = np.full((len(t), len(self.traces)), np.nan)
        wide[:, : values.shape[1]] = values
        t = np.concatenate([self._t, t])
        keep = t > (t[-1] if len(t) else 0) - self._seconds
        self._t, self._values = t[keep], np.concatenate([self._values, wide])[keep]
        self._skip = (self._skip + 1) % 5
        if not self._paused and not self._skip:
            self._draw()

    def _draw(self):
        every = max(1, len(self._t) // SLOW_ROWS)
        for series, column in zip(self.options["series"], self._values[::every].T):
            good = ~np.isnan(column)
            series["data"] = np.column_stack([self._t[::every], column])[good].tolist()
        self.update()

    def overlay(self, first, t0, values):
        """As Plot's."""
        begin = np.searchsorted(self._t, t0 - 1e-4)
        size = min(len(values), len(self._t) - begin)
        self._values[:, first:] = np.nan
        self._values[begin : begin + size, first:] = values[:size]
        self._draw()

    def run_method(self, name, *args, **_):
        """What plot.js can and this one, too."""
        if name == "setPaused":
            self._paused = args[0]
        elif name == "setSpan":
            self._seconds = args[0]


def plot(*args, **settings):
    """The quick one where uPlot is there."""
    return (Plot if assets.uplot(fetch=False) else SlowPlot)(*args, **settings)

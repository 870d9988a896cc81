# SPDX-License-Identifier: MIT
"""The page: traces on the left, what one does with them on the right."""

from nicegui import ui

from tools.link.history import ANGLES
from tools.scope import knobs, looks, past_tab, tune_tab
from tools.scope.plot import plot

TICK_S = 0.05
FIRST_S = 60.0  # of the past, sent when the page opens
SPANS = (2, 5, 10, 30, 60)
GROUPS = {
    "gyro": ("gyro_x", "gyro_y", "gyro_z"),
    "accelerometer": ("accel_x", "accel_y", "accel_z"),
    "rates, calibrated": ("rate_x", "rate_y", "rate_z"),
    "timing": ("late_us", "step_us"),
}
UNITS = {"gyro": "deg/s", "accelerometer": "g", "rates, calibrated": "deg/s", "timing": "us"}
STYLE = """
.scope-readout{font-family:ui-monospace,monospace;font-size:12px;min-height:1.4em;padding-left:60px;
color:inherit;opacity:.85}
.u-legend{font-size:12px;text-align:left!important;padding-left:52px}
body.body--dark .u-title,body.body--dark .u-legend{color:#ddd}
.q-tab__label{text-transform:none}
"""


class View:
    """One open page on the session."""

    def __init__(self, session):
        self.session = session
        self.seen = 0
        self.group = "gyro"
        self._marked = -1
        ui.add_css(STYLE)
        self.dark = ui.dark_mode()
        self.dark.auto()
        with ui.column().classes("w-full gap-1"):
            self._top()
            with ui.row().classes("w-full no-wrap items-start gap-4 overflow-hidden"):
                with ui.column().classes("gap-0").style("flex: 3 1 0; min-width: 0"):
                    self._tools()
                    self._charts()
                right = ui.column().classes("gap-0 overflow-hidden")
                with right.style("flex: 2 1 0; min-width: 0"):
                    self._tabs()
        ui.timer(TICK_S, self._tick)
        ui.timer(0.5, self._slow)

    # ---- what stands where

    def _top(self):
        with ui.row().classes("w-full items-center gap-3"):
            ui.label("Plumb").classes("text-lg font-bold")
            self.line = ui.label().classes("text-sm grow").mark("line")
            if self.session.virtual:
                ui.button("Unplug", on_click=lambda: self.session.virtual.do("unplug")).props(
                    "dense outline"
                )
                ui.button("Plug in", on_click=lambda: self.session.virtual.do("plug")).props(
                    "dense outline"
                )
            self.recording = ui.button("Record", on_click=self._record).props("dense outline")
            ui.button("Dark / light", on_click=self._turn_dark).props("dense flat")

    def _tools(self):
        with ui.row().classes("items-center gap-2"):
            self.pause = ui.button("Pause", on_click=self._pause).props("dense").mark("pause")
            ui.select(
                {span: f"{span} s" for span in SPANS}, value=10, label="window",
                on_change=lambda e: self._both("setSpan", e.value),
            ).props("dense").classes("w-24")  # fmt: skip
            ui.switch("Fixed scale", on_change=lambda e: self._both("setFixed", e.value))
            ui.button("CSV", on_click=lambda: self._both("csv", "plumb")).props("dense outline")
            ui.button("PNG", on_click=lambda: self._both("png", "plumb")).props("dense outline")
            below = ui.select(list(GROUPS), value=self.group, on_change=self._regroup)
            below.props('dense aria-label="traces below"').classes("w-40")

    def _charts(self):
        traces = [
            {"label": name, "unit": "deg", "colour": i, "dash": i} for i, name in enumerate(ANGLES)
        ] + [
            {"label": f"{name}, what if", "unit": "deg", "colour": i + 3, "dash": i, "thin": True}
            for i, name in enumerate(ANGLES)
        ]
        self.angles = plot("Angles", traces, height=300).on("ready", self._refill)
        self.angles.on("paused", lambda e: self._paused(e.args)).mark("angles")
        self.holder = ui.column().classes("w-full")
        self._lower()

    def _lower(self):
        self.holder.clear()
        with self.holder:
            traces = [
                {"label": name, "unit": UNITS[self.group], "digits": 0 if "us" in name else 2}
                for name in GROUPS[self.group]
            ]
            self.lower = plot(self.group.capitalize(), traces, height=240)
            self.lower.on("ready", lambda: self._fill(self.lower, GROUPS[self.group], FIRST_S))
            self.lower.on("paused", lambda e: self._paused(e.args))

    def _tabs(self):
        names = ("Knobs", "Tune the past", "Vibration", "Body", "Step", "Auto-tune", "Changes")
        with ui.tabs().props("dense no-caps outside-arrows mobile-arrows") as tabs:
            for name in names:
                ui.tab(name)
        with ui.tab_panels(tabs, value="Knobs").classes("w-full").props("keep-alive"):
            self.parts = []
            for name, kind in zip(names, (
                knobs.Knobs, past_tab.PastTab, looks.Vibration, looks.Body, looks.Step,
                tune_tab.TuneTab, knobs.Changes,
            )):  # fmt: skip
                with ui.tab_panel(name).classes("p-1"):
                    self.parts.append(kind(self))
        self.tabs = tabs

    # ---- what moves

    def _tick(self):
        session = self.session
        end, t, values, gap = session.history.since(self.seen, ANGLES)
        if end == self.seen or not session.history.header:
            return
        below = session.history.since(self.seen, GROUPS[self.group])
        self.seen = end
        period_s = self.period_s()
        self.angles.push(t, values, gap, period_s)
        n = min(len(below[1]), len(t))
        self.lower.push(below[1][:n], below[2][:n], below[3][:n], period_s)
        for part in self.parts:
            if hasattr(part, "tick"):
                part.tick()

    def period_s(self):
        """Between two samples."""
        header = self.session.history.header
        return header["period_us"] * header["every"] * 1e-6

    def _slow(self):
        self.line.text = self.session.line()
        marks = self.session.history.marks
        if len(marks) != self._marked:
            self._marked = len(marks)
            said = [{"t": t, "text": ", ".join(changed)} for t, changed in marks[-40:]]
            self._both("setMarks", said)
        for part in self.parts:
            if hasattr(part, "slow") and self.tabs.value == part.name:
                part.slow()

    def _refill(self):
        self._fill(self.angles, ANGLES, FIRST_S)

    def _fill(self, chart, names, seconds):
        history = self.session.history
        if not history.header:
            return
        begin = max(0, self.seen - round(seconds / self.period_s()))
        _, t, values, gap = history.since(begin, names)
        n = self.seen - begin
        chart.push(t[:n], values[:n], gap[:n], self.period_s())
        self._marked = -1

    # ---- what one does

    def _both(self, name, *arguments):
        self.angles.run_method(name, *arguments)
        self.lower.run_method(name, *arguments)

    def _pause(self):
        self._both("setPaused", self.pause.text == "Pause")
        self._paused(self.pause.text == "Pause")

    def _paused(self, paused):
        self.pause.text = "Go on" if paused else "Pause"

    def _regroup(self, event):
        self.group = event.value
        self._lower()

    def _turn_dark(self):
        self.dark.set_value(not self.dark.value)

    def _record(self):
        session = self.session
        if session.recorder is None:
            session.record(True)
            self.recording.text = "Stop and save"
            return
        self.recording.text = "Record"
        done = session.record(False)
        try:
            import tempfile
            from pathlib import Path

            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "plumb.npz"
                done.save(path)
                ui.download.content(path.read_bytes(), "plumb.npz")
        except ValueError as error:
            ui.notify(str(error), type="warning")

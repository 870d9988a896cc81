# SPDX-License-Identifier: MIT
"""Tune the past: a slider runs the last minute through the board's filter again, at once."""

import asyncio
import math
import time

from nicegui import ui

from firmware.config import KNOBS
from tools.scope import knobs
from tools.scope.past import SECONDS

_KNOB = {knob.name: knob for knob in KNOBS}
_TICKS = 200  # of a slider, over the knob's range on a logarithmic scale


class PastTab:
    """Sliders of the filter that runs; what they would have made of the last minute."""

    name = "Tune the past"

    def __init__(self, view):
        self._view, self._session = view, view.session
        self._filter = None
        self._changes = {}
        self._busy = self._again = False
        self._task = None  # the loop itself keeps no reference
        self._track = None
        ui.label(
            "The last minute again, through the board's own integer code with these settings; "
            "drawn over it as 'what if'."
        ).classes("text-sm")
        self._sliders = ui.column().classes("w-full gap-0")
        self._grade = ui.label().classes("text-sm font-bold").mark("grade")
        self._took = ui.label().classes("text-xs").mark("took")
        with ui.row():
            self._send = ui.button("Send to the board", on_click=self._to_board).mark("send")
            ui.button("Forget", on_click=self.forget).props("outline")
            ui.button("Take the newest minute", on_click=self._newest).props("outline")

    def slow(self):
        """The sliders follow the filter that runs."""
        running = self._session.settings.get("filter")
        if running and running != self._filter:
            self._filter = running
            self._make()
            if self._track is None and self._session.history.end > 100:
                self._newest()

    def _make(self):
        self._sliders.clear()
        self._changes = {}
        with self._sliders:
            for name in knobs.own(self._session.settings):
                knob = _KNOB[name]
                value = self._session.settings[name]
                label = ui.label(f"{name} = {value:.4g} {knob.unit}").classes("text-sm")
                ui.slider(
                    min=0, max=_TICKS, value=_place(knob, value),
                    on_change=lambda e, knob=knob, label=label: self._moved(knob, label, e.value),
                ).props(f'aria-label="{name}"').mark(f"past {name}")  # fmt: skip

    def _moved(self, knob, label, place):
        value = _value(knob, place)
        label.text = f"{knob.name} = {value:.4g} {knob.unit}"
        self._changes[knob.name] = value
        self._task = asyncio.create_task(self._run())

    def _newest(self):
        try:
            self._track, self._start_s = self._session.history.track(SECONDS)
        except ValueError as error:
            ui.notify(str(error))
            return
        self._task = asyncio.create_task(self._run())

    async def _run(self):
        """One at a time; what moved meanwhile is run afterwards, only as it is then."""
        if self._busy:
            self._again = True
            return
        self._busy = True
        try:
            while True:
                self._again = False
                await self._once()
                if not self._again:
                    break
        finally:
            self._busy = False

    async def _once(self):
        began = time.perf_counter()
        if self._track is None or self._changes == {}:
            self._track, self._start_s = self._session.history.track(SECONDS)
        changes = dict(self._changes)
        try:
            found = await asyncio.wrap_future(self._session.past.rerun(self._track, changes))
        except Exception as error:
            self._took.text = str(error)
            return
        with self._grade:
            self._view.angles.overlay(3, self._start_s, found["angles"])
        if "rms_deg" in found:
            self._grade.text = (
                f"Distance from the best hindsight: {found['rms_now_deg']:.3f}° as it was on the "
                f"board, {found['rms_deg']:.3f}° with these settings."
            )
        else:
            self._grade.text = "Too short so far to be graded: six seconds at least."
        passed = time.perf_counter() - began
        self._took.text = f"{len(self._track)} samples again in {passed:.2f} s"

    async def _to_board(self):
        if self._changes and await knobs.told(self._session.set, dict(self._changes)):
            ui.notify("sent; Undo is among the knobs")

    def forget(self):
        """As the board has it."""
        self._make()
        self._grade.text = self._took.text = ""
        self._track = None
        self._view.angles.run_method("overlay", 3, 0, "")


def _ends(knob):
    low = max(knob.low, knob.default / 1000 if knob.default else 1e-6)
    return math.log(low), math.log(knob.high)


def _place(knob, value):
    low, high = _ends(knob)
    return round(_TICKS * (math.log(max(value, math.exp(low))) - low) / (high - low))


def _value(knob, place):
    low, high = _ends(knob)
    value = float(f"{math.exp(low + (high - low) * place / _TICKS):.3g}")
    return min(max(value, knob.low), knob.high)

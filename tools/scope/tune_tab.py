# SPDX-License-Identifier: MIT
"""Auto-tune from the last minutes: proposed beside present, set when the user says so."""

import asyncio

from nicegui import ui

from tools.scope import knobs

SECONDS = 120.0


class TuneTab:
    """Proposals of tools.tune for what has just been seen."""

    name = "Auto-tune"

    def __init__(self, view):
        self._session = view.session
        self._figures = self._report = None
        ui.label(
            "Seeks the settings of the running filter that come nearest to the best hindsight of "
            "the last two minutes, and tells of noise at rest and of vibration. Nothing is set "
            "until you say so."
        ).classes("text-sm")
        with ui.row():
            self._seek = ui.button("Seek", on_click=self._run).mark("seek")
            self._set = ui.button("Set what is proposed", on_click=self._take).props("outline")
            self._save = ui.button("Report", on_click=self._download).props("outline")
        self._set.disable()
        self._save.disable()
        self._found = ui.column().classes("w-full gap-1 text-sm")

    async def _run(self):
        self._seek.disable()
        try:
            track, _ = self._session.history.track(SECONDS)
            future = self._session.past.tuned(track)
            self._figures, self._report = await asyncio.wrap_future(future)
        except Exception as error:
            with self._found:
                ui.notify(str(error), type="warning")
            return
        finally:
            self._seek.enable()
        self._save.enable()
        self._set.set_enabled(bool(self._figures["changed"]))
        self._show()

    def _show(self):
        figures = self._figures
        self._found.clear()
        with self._found:
            if not figures["changed"]:
                distance = f"{figures['rms_unchanged_deg']:.3f}° from the best hindsight"
                ui.label(f"The defaults stay: {distance}, and nothing is clearly nearer.")
            else:
                ui.label(f"{figures['rms_unchanged_deg']:.3f}° → {figures['rms_deg']:.3f}°")
                present = self._session.settings
                ui.table(rows=[
                    {"knob": name, "present": present.get(name), "proposed": value}
                    for name, value in figures["changed"].items()
                ])  # fmt: skip
            for noise in figures["noise"].values():
                if noise is None:
                    ui.label("Noise: no ten seconds at rest among them.")
                    continue
                for kind in ("raw", "used"):
                    white = max(axis["white"] for axis in noise[kind]["gyro_dps"])
                    ui.label(f"Gyro at rest, {kind}: {1000 * white:.1f} mdeg/s per root Hz")
            for rows in figures["vibration"].values():
                for row in rows[:3]:
                    ui.label(row["words"])

    async def _take(self):
        if await knobs.told(self._session.set, self._figures["changed"]):
            ui.notify("set; not saved yet. Undo is among the knobs")
            self._set.disable()

    def _download(self):
        ui.download.content(self._report, "plumb-tuning.html")

# SPDX-License-Identifier: MIT
"""Other looks at the samples: vibration, the body in space, a step's response."""

import base64
import io
import math

import numpy as np
from nicegui import ui
from nicegui.element import Element

from tools.link.history import ANGLES
from tools.scope import step
from tools.tune import vibration

SPECTRUM_S = 8.0
PICTURE = 160  # pixels of a spectrogram's height
FLOOR_DB = 60.0


class Vibration:
    """Spectrum and spectrogram, the sensor's low-pass and the notches that would help."""

    name = "Vibration"

    def __init__(self, view):
        self._history, self._session = view.session.history, view.session
        self._chart = ui.echart({
            "animation": False, "legend": {"top": 0},
            "grid": {"left": 55, "right": 15, "top": 30, "bottom": 45},
            "xAxis": {"type": "value", "name": "Hz", "nameLocation": "middle", "nameGap": 25},
            "yAxis": {"type": "value", "name": "dB", "scale": True},
            "series": [
                {"type": "line", "name": "gyro", "showSymbol": False, "data": [],
                 "markLine": {"symbol": "none", "data": []}},
                {"type": "line", "name": "accelerometer", "showSymbol": False, "data": [],
                 "lineStyle": {"type": "dashed"}},
            ],
        }).classes("w-full").style("height: 300px").mark("spectrum")  # fmt: skip
        ui.label("Spectrogram of the gyro: time to the right, frequency up").classes("text-xs")
        self._picture = ui.html("", sanitize=False).classes("w-full")
        self._words = ui.column().classes("text-sm gap-1")

    def slow(self):
        """Twice a second, while it is looked at."""
        try:
            track, _ = self._history.track(SPECTRUM_S)
        except ValueError:
            return
        if len(track) < track.rate_hz:
            return
        gyro, accel = track.units()
        for series, values in zip(self._chart.options["series"], (gyro, accel)):
            hz, power = vibration.spectrum(values, track.rate_hz)
            level = 10 * np.log10(np.maximum(power, 1e-12))
            series["data"] = np.round(np.column_stack([hz, level])[1:], 2).tolist()
        advice = vibration.advice(track)[:3]
        lines = [{"xAxis": self._session.settings["dlpf_hz"], "name": "dlpf_hz"}]
        lines += [{"xAxis": row["hz"], "name": "notch"} for row in advice if row["notch"]]
        for line in lines:
            line["label"] = {"formatter": line["name"]}
        self._chart.options["series"][0]["markLine"]["data"] = lines
        self._chart.options["xAxis"]["max"] = round(track.rate_hz / 2)
        self._chart.update()
        self._picture.set_content(_spectrogram(gyro, track.rate_hz))
        self._words.clear()
        with self._words:
            for row in advice:
                ui.label(row["words"])
            if not advice:
                ui.label("No vibration that would be worth a notch.")


def _spectrogram(values, hz):
    """An <img> of grey levels."""
    from PIL import Image
    from scipy import signal

    size = min(128, len(values) // 4)
    power = sum(
        signal.spectrogram(axis, hz, nperseg=size, noverlap=size * 3 // 4)[2] for axis in values.T
    )
    level = 10 * np.log10(np.maximum(power, 1e-12))
    shade = np.clip((level - level.max() + FLOOR_DB) / FLOOR_DB, 0, 1)
    image = Image.fromarray((255 * shade[::-1]).astype(np.uint8)).resize((600, PICTURE))
    data = io.BytesIO()
    image.save(data, "PNG")
    text = base64.b64encode(data.getvalue()).decode()
    source = f"data:image/png;base64,{text}"
    return f'<img alt="spectrogram of the gyro" style="width:100%" src="{source}">'


class _Body(Element, component="body.js"):
    """turn(roll, pitch, yaw) in radians."""


class Body:
    """A body that stands as the robot does."""

    name = "Body"

    def __init__(self, view):
        self._history, self._view = view.session.history, view
        self._body = _Body().classes("w-full")
        self._numbers = ui.label().classes("font-mono text-sm")
        self._flags = ui.label().classes("text-sm")

    def tick(self):
        """Where it stands now."""
        if self._view.tabs.value != self.name:
            return
        roll, pitch, yaw = (self._history.last(name) for name in ANGLES)
        self._body.run_method("turn", *(math.radians(angle) for angle in (roll, pitch, yaw)))
        self._numbers.text = f"roll {roll:8.2f}°  pitch {pitch:8.2f}°  yaw {yaw:8.2f}°"
        flags = self._history.flags()
        said = [text for bit, text in ((1, "predicted"), (2, "at rest"), (4, "tilt uncertain"),
                                       (8, "yaw uncertain")) if flags & bit]  # fmt: skip
        self._flags.text = ", ".join(said) or "measured, in motion"


class Step:
    """Measure a step: press, let it step within the time, read."""

    name = "Step"

    def __init__(self, view):
        self._history = view.session.history
        ui.label("Let the robot make a step, wait until it stands, press.").classes("text-sm")
        with ui.row().classes("items-center"):
            self._name = ui.select(list(ANGLES), value="pitch", label="channel")
            self._seconds = ui.number("seconds", value=4, min=1, max=30).props("dense")
            ui.button("Measure", on_click=self._measure).mark("measure step")
        self._text = ui.label().classes("whitespace-pre font-mono text-sm").mark("step")

    def _measure(self):
        t, values = self._history.newest(self._seconds.value, [self._name.value])
        try:
            found = step.response(t, values[:, 0])
        except ValueError as error:
            self._text.text = str(error)
            return
        self._text.text = (
            f"from {found['from']:.2f} to {found['to']:.2f}\n"
            f"rise (10 to 90 %)  {found['rise_s']:.3f} s\n"
            f"overshoot          {100 * found['overshoot']:.1f} %\n"
            f"settled within 5 % {found['settling_s']:.3f} s\n"
            f"way, by the step   {found['smoothness']:.2f} (1: without a detour)"
        )

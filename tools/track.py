# SPDX-License-Identifier: MIT
"""A recording as a filter sees it: counts at their times, settings, calibration, truth if any.

load(path) reads what tools.record wrote (.npz, .csv) and recordings with optical truth
(tools.recordings: .npz, .mat, .csv).
"""

import csv
import json
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from firmware.config import KNOBS
from tools import recordings

DEFAULTS = {knob.name: knob.default for knob in KNOBS}
LAG_S = 0.0048  # of a recording that does not say how old its samples are: Attitude's default
COUNTS = ("accel_x", "accel_y", "accel_z", "temp", "gyro_x", "gyro_y", "gyro_z")


@dataclass
class Track:
    """counts: (n x 7) int16 as of the registers; t_s: (n); angles_deg: (n x 3) as the board had
    them, or None; up: (n x 3) the true vertical in sensor axes, or None, counted where errors
    count; marks: [(sample, {knob: value})] of changes; gaps: samples after which some are
    missing; settings: of the first sample."""

    name: str
    counts: np.ndarray
    t_s: np.ndarray
    rate_hz: float
    settings: dict
    lag_s: float = LAG_S
    calibration: dict = field(default_factory=dict)
    angles_deg: np.ndarray | None = None
    up: np.ndarray | None = None
    counted: np.ndarray | None = None
    marks: list = field(default_factory=list)

    def __len__(self):
        return len(self.counts)

    @property
    def period_us(self):
        """Between two samples."""
        return 1e6 / self.rate_hz

    @property
    def gaps(self):
        """Samples after which others are missing: the next comes more than 1.5 periods later."""
        return np.flatnonzero(np.diff(self.t_s) > 1.5 / self.rate_hz)

    def part(self, piece):
        """The samples of a slice."""
        own = {"angles_deg": self.angles_deg, "up": self.up, "counted": self.counted}
        cut = {name: None if value is None else value[piece] for name, value in own.items()}
        return Track(
            self.name, self.counts[piece], self.t_s[piece], self.rate_hz, self.settings,
            self.lag_s, self.calibration, **cut,
        )  # fmt: skip

    def units(self):
        """(gyro in deg/s, accelerometer in g), n x 3 each, calibrated, in the robot's frame."""
        cal = self.calibration
        out = []
        for kind, first, lsb in (
            ("gyro", 4, recordings.GYRO_LSB_PER_DPS[self.settings["gyro_dps"]]),
            ("accel", 0, recordings.ACCEL_LSB_PER_G[self.settings["accel_g"]]),
        ):
            unit = "dps" if kind == "gyro" else "g"
            bias = np.array(cal.get(f"{kind}_bias_{unit}", (0, 0, 0)))
            matrix = np.array(cal.get(f"{kind}_matrix", np.eye(3).ravel())).reshape(3, 3)
            out.append((self.counts[:, first : first + 3] / lsb - bias) @ matrix.T)
        return tuple(out)


def load(path):
    """The Track in a file. ValueError in words when it is none."""
    path = Path(path)
    if path.suffix == ".csv" and _is_stream(path):
        return of_stream(path.stem, *_from_csv(path))
    if path.suffix == ".npz":
        with np.load(path) as data:
            if "headers" in data:
                return of_stream(
                    path.stem, json.loads(str(data["headers"])), data["number"], data["t_us"],
                    data["raw"],
                )  # fmt: skip
    return of_truth(recordings.load(path))


def _is_stream(path):
    """Whether a csv begins with a stream's header: else it is one with truth."""
    with path.open() as file:
        return file.readline().startswith("# [")


def of_truth(rec):
    """Of a recording with optical truth, in the widest ranges."""
    settings = dict(DEFAULTS, gyro_dps=recordings.GYRO_DPS, accel_g=recordings.ACCEL_G)
    return Track(
        rec.name, rec.counts(), np.arange(len(rec)) / rec.rate_hz, rec.rate_hz, settings,
        up=rec.up, counted=rec.counted,
    )  # fmt: skip


def of_stream(name, headers, number, t_us, raw):
    """Of a stream: headers [(first sample, header)], and its arrays."""
    if not len(raw) or not headers:
        raise ValueError(f"{name}: no samples in it")
    first = headers[0][1]
    names = [channel[0] for channel in first["channels"]]
    missing = [channel for channel in COUNTS if channel not in names]
    if missing:
        raise ValueError(f"{name}: no {', '.join(missing)} in it")
    raw, t_us = np.asarray(raw, np.int16), np.asarray(t_us, np.int64)
    scales = np.array([channel[2] for channel in first["channels"]])
    angles = [names.index(axis) for axis in ("roll", "pitch", "yaw")]
    return Track(
        name, np.ascontiguousarray(raw[:, [names.index(c) for c in COUNTS]]),
        (t_us - t_us[0]) * 1e-6, _rate(first, t_us), dict(DEFAULTS, **first["settings"]),
        first["lag_s"], first["calibration"], raw[:, angles] * scales[angles],
        marks=marks(headers),
    )  # fmt: skip


def _rate(header, t_us):
    """Samples a second, as they came."""
    nominal = header["period_us"] * header["every"]
    steps = np.diff(t_us)
    whole = steps[(steps > 0.5 * nominal) & (steps < 1.5 * nominal)]
    return 1e6 / (float(np.mean(whole)) if len(whole) else nominal)


def marks(headers):
    """[(sample, {knob: (before, after)})] of each header that changes settings."""
    out = []
    for (_, old), (at, new) in pairwise(headers):
        was, now = old["settings"], new["settings"]
        changed = {name: (was.get(name), now[name]) for name in now if was.get(name) != now[name]}
        if changed:
            out.append((at, changed))
    return out


def _from_csv(path):
    with path.open(newline="") as file:
        head = json.loads(file.readline().removeprefix("# "))
        rows = csv.reader(line for line in file if not line.startswith("#"))
        columns = next(rows)
        table = np.array([[float(cell) for cell in row] for row in rows])
    if not len(table):
        raise ValueError(f"{path}: no samples in it")
    scales = [channel[2] for channel in head[0][1]["channels"]]
    raw = np.round(table[:, columns.index("flags") + 1 :] / scales).astype(np.int16)
    return head, table[:, 0].astype(np.int64), np.round(table[:, 1] * 1e6).astype(np.int64), raw

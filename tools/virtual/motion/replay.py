# SPDX-License-Identifier: MIT
"""Replay of a recording: npz or CSV, SI units, linear between its samples.

npz: `acc_m_s2` (n x 3), `gyr_rad_s` (n x 3), `rate_hz`, and if known `quat_wxyz` (n x 4, sensor
to earth with z up, NaN where unknown), `temp_c` (n). CSV: a header naming the columns `t_s`,
`acc_x_m_s2`.. `acc_z_m_s2`, `gyr_x_rad_s`.. `gyr_z_rad_s`, and if known `quat_w`.. `quat_z`,
`temp_c`; any other column is ignored and uneven times are resampled.
"""

import csv
import math
from pathlib import Path

import numpy as np

from tools.virtual.motion import quaternions as quat

_G = 9.80665
_REST_S, _STILL_DPS = 0.5, 3.0  # the rates of a rest, from the lowest to the highest
_BIAS_DPS = 20.0  # the datasheet's zero-rate output
_ACC = [f"acc_{n}_m_s2" for n in "xyz"]
_GYR = [f"gyr_{n}_rad_s" for n in "xyz"]
_QUAT = [f"quat_{n}" for n in "wxyz"]


class Replay:
    """A recording as motion source; ValueError names what a file lacks.

    For `lead_s` seconds before it the sensor rests in the recording's first attitude; after the
    end it rests in the last. There its gyro reads the bias that it has next to it, if the
    recording is at rest there, else 0. `start_s` and `length_s` cut a piece out.
    """

    def __init__(self, path, lead_s=0.0, start_s=0.0, length_s=None, temp_c=25.0):
        self.path = Path(path)
        data = _read_csv(self.path) if self.path.suffix.lower() == ".csv" else _read_npz(self.path)
        acc, gyr, quats, temp, self.rate_hz = data
        first = round(start_s * self.rate_hz)
        last = None if length_s is None else first + round(length_s * self.rate_hz) + 1
        acc, gyr = acc[first:last], gyr[first:last]
        if len(acc) < 2:
            raise ValueError(f"{self.path}: fewer than two samples from {start_s} s on")
        temp = np.full(len(acc), temp_c) if temp is None else temp[first:last]
        rows = np.column_stack([acc / _G, np.degrees(gyr), temp])
        self._rows = rows.tolist()
        self._quats = None if quats is None else quats[first:last].tolist()
        self.lead_s = lead_s
        self.duration_s = lead_s + (len(acc) - 1) / self.rate_hz
        some = round(_REST_S * self.rate_hz)
        self._rest = self._resting(0, rows[:some, 3:6]), self._resting(-1, rows[-some:, 3:6])

    def _resting(self, n, rates):
        """At rest in the attitude of row n: by the truth, else by its specific force."""
        row = self._rows[n]
        bias = np.mean(rates, axis=0)
        still = np.ptp(rates, axis=0).max() < _STILL_DPS and np.abs(bias).max() < _BIAS_DPS
        bias = bias.tolist() if still else (0.0, 0.0, 0.0)
        q = self._quats[n] if self._quats else (math.nan,)
        if not math.isnan(q[0]):
            return (*quat.gravity(q), *bias, row[6])
        size = math.sqrt(sum(v * v for v in row[:3])) or 1.0
        return (*(v / size for v in row[:3]), *bias, row[6])

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        place = (t_s - self.lead_s) * self.rate_hz
        if place < 0:
            return self._rest[0]
        n = int(place)
        rows = self._rows
        if n + 1 >= len(rows):
            return self._rest[1]
        f = place - n
        a, b, c, d, e, g, h = rows[n]
        p, q, r, s, t, u, v = rows[n + 1]
        return (
            a + f * (p - a),
            b + f * (q - b),
            c + f * (r - c),
            d + f * (s - d),
            e + f * (t - e),
            g + f * (u - g),
            h + f * (v - h),
        )

    def truth(self, t_s):
        """(w, x, y, z) as recorded; NaN where it is unknown."""
        if self._quats is None:
            return (math.nan,) * 4
        place = min(max((t_s - self.lead_s) * self.rate_hz, 0.0), len(self._quats) - 1.0)
        n = min(int(place), len(self._quats) - 2)
        a, b = self._quats[n], self._quats[n + 1]
        f = place - n
        if f == 0:
            return tuple(a)
        if sum(u * v for u, v in zip(a, b)) < 0:
            b = [-v for v in b]
        mix = [u + f * (v - u) for u, v in zip(a, b)]
        size = math.sqrt(sum(v * v for v in mix))
        return tuple(v / size for v in mix)


def _read_npz(path):
    with np.load(path) as data:
        missing = [key for key in ("acc_m_s2", "gyr_rad_s", "rate_hz") if key not in data]
        if missing:
            raise ValueError(f"{path}: no {', '.join(missing)} in it")
        quats = data["quat_wxyz"].astype(float) if "quat_wxyz" in data else None
        temp = data["temp_c"].astype(float) if "temp_c" in data else None
        acc, gyr = data["acc_m_s2"].astype(float), data["gyr_rad_s"].astype(float)
        return acc, gyr, quats, temp, float(data["rate_hz"])


def _read_csv(path):
    with open(path, newline="") as file:
        rows = csv.DictReader(file)
        missing = [key for key in ["t_s", *_ACC, *_GYR] if key not in (rows.fieldnames or ())]
        if missing:
            raise ValueError(f"{path}: no column {', '.join(missing)}")
        known = [key for key in [*_QUAT, "temp_c"] if key in rows.fieldnames]
        names = ["t_s", *_ACC, *_GYR, *known]
        table = np.array([[float(row[key] or "nan") for key in names] for row in rows])
    if len(table) < 2:
        raise ValueError(f"{path}: fewer than two samples")
    steps = np.diff(table[:, 0])
    if steps.min() <= 0:
        raise ValueError(f"{path}: t_s does not grow at row {int(steps.argmin()) + 2}")
    rate_hz = 1 / float(np.median(steps))
    even = np.arange(table[0, 0], table[-1, 0] + 0.5 / rate_hz, 1 / rate_hz)
    columns = {n: np.interp(even, table[:, 0], table[:, k]) for k, n in enumerate(names)}
    quats = np.column_stack([columns[n] for n in _QUAT]) if "quat_w" in columns else None
    acc = np.column_stack([columns[n] for n in _ACC])
    gyr = np.column_stack([columns[n] for n in _GYR])
    return acc, gyr, quats, columns.get("temp_c"), rate_hz

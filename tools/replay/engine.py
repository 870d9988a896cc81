# SPDX-License-Identifier: MIT
"""A filter of the board over a Track: the integer code itself, run by CPython unchecked."""

from array import array
from types import SimpleNamespace

import numpy as np

from tools.virtual.port import install_micropython

install_micropython(checked=False)  # before anything of attitude.fixed

from calibration import Calibration  # noqa: E402

from firmware import filters  # noqa: E402
from firmware.config import checked  # noqa: E402


def knobs():
    """Names of the settings that a replay can change: the filter and its own."""
    return ["filter", *dict.fromkeys(name for own in filters.SETTINGS.values() for name in own)]


def changed(settings, changes):
    """The settings with these changes. ValueError in words for one that no replay can make."""
    for name in changes:
        checked(name, changes[name])
        if name not in knobs():
            known = ", ".join(knobs())
            raise ValueError(f"{name}: no filter's own; a replay can set {known}")
    return {**settings, **changes}


def made(track, settings):
    """The filter, as the app makes it (firmware.filters)."""
    config = SimpleNamespace(**settings)
    imu = SimpleNamespace(
        gyro_range_dps=settings["gyro_dps"],
        accel_range_g=settings["accel_g"],
        delay_s=track.lag_s - 0.5 / settings["sensor_hz"],
    )
    calibration = Calibration.from_dict(track.calibration)
    return filters.make(config, calibration, imu, track.rate_hz)


def run(track, settings):
    """(n x 3) angles in degrees: roll, pitch, yaw, as the board would have had them."""
    filt = made(track, settings)
    period_us = round(track.period_us)
    if filt.timed:
        rows = [array("h", row) for row in track.counts.tolist()]
        steps = np.full(len(rows), period_us)
        step, bridge = None, filt.update
    else:
        rows = [array("H", row) for row in track.counts.view(np.uint16).tolist()]
        steps = np.zeros(len(rows), int)
        step, bridge = filt.step, filt.update
    gaps = track.gaps
    steps[gaps + 1] = np.round(1e6 * (track.t_s[gaps + 1] - track.t_s[gaps]))
    angles = array("i")
    tell, out = angles.extend, filt.out
    for row, dt_us in zip(rows, steps.tolist()):
        if dt_us:
            bridge(row, dt_us)
        else:
            step(row)
        tell(out[0:3])
    return np.array(angles).reshape(-1, 3) / 1000.0

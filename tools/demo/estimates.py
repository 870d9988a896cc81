# SPDX-License-Identifier: MIT
"""The filters on the samples that main.py had, and how far each is from the truth."""

from array import array

import numpy as np

from tools.recordings import up_from_quaternion, up_from_roll_pitch

# What the table calls the estimates, in its order; those with a knob are made by the app's code.
FILTERS = {
    "accelerometer alone": None,
    "gyro integral": None,
    "complementary": "float.complementary",
    "kalman_tilt": "float.kalman",
    "fixed.kalman2": "kalman2",
    "attitude": "float.attitude",
    "fixed.attitude": "attitude",
}


def up_vectors(quats):
    """True up (n x 3) of the quaternions; not a number where the truth is not known."""
    return up_from_quaternion(np.array([q if q is not None else (np.nan,) * 4 for q in quats]))


def estimates(app, recorded, stdout):
    """{name: (n x 3) up vectors}: the other filters on the counts that the app had."""
    from attitude import GyroIntegral, accel_tilt_deg

    from firmware import filters

    out = {}
    t_us = np.round(recorded["t_s"] * 1e6).astype(int)
    dt_us = np.diff(t_us, prepend=t_us[0] - 4000).tolist()
    rows = recorded["counts"].tolist()
    gyro = recorded["counts"][:, 4:] / app.imu.gyro_lsb_per_dps - app.calibration.gyro_bias_dps
    tilt = np.array([accel_tilt_deg(*row[:3]) for row in rows])
    counts = array("h", [0] * 7)
    for name, knob in FILTERS.items():
        if stdout.isatty():
            stdout.write(f"\rfilters on the same samples: {name:<24}")
            stdout.flush()
        if name == "accelerometer alone":
            angles = tilt
        elif knob is None:
            axes = [GyroIntegral(), GyroIntegral()]
            for axis, start in zip(axes, tilt[0]):
                axis.reset(start)
            angles = np.array(
                [[a.update(g, d * 1e-6) for a, g in zip(axes, row)]
                 for row, d in zip(gyro[:, :2].tolist(), dt_us)]
            )  # fmt: skip
        elif knob == recorded["knob"]:
            angles = recorded["live"]
        else:
            app.config.set("filter", knob)
            f = filters.make(app.config, app.calibration, app.imu, app.config.rate_hz)
            timed = f.timed
            angles = np.empty((len(rows), 2))
            for i, row in enumerate(rows):
                for k in range(7):
                    counts[k] = row[k]
                if timed:
                    f.update(counts, dt_us[i])
                else:
                    f.update(counts)
                angles[i] = f.roll_mdeg / 1000, f.pitch_mdeg / 1000
        out[name] = up_from_roll_pitch(angles[:, 0], angles[:, 1])
    if stdout.isatty():
        stdout.write("\r" + " " * 60 + "\r")
    return out


def error_deg(up, truth):
    """Angle (n) between estimated and true up vectors."""
    cross = np.linalg.norm(np.cross(up, truth), axis=1)
    return np.degrees(np.arctan2(cross, np.sum(up * truth, axis=1)))


def rms(values):
    """Root mean square of what is known."""
    return float(np.sqrt(np.nanmean(values**2)))

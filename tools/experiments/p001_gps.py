# SPDX-License-Identifier: MIT
"""Paper 001, section 4: position from GPS and accelerometer by the multi-dimensional filter."""

import numpy as np
from attitude import KalmanND

from tools.experiments.outcome import RAW, Outcome, Picture
from tools.experiments.record import rms

RATE_HZ = 50
SECONDS = 120
GPS_HZ = 1
GPS_M = 3.0
ACCEL_M_S2 = 0.2
BIAS_M_S2 = 0.08


def drive(seed=0):
    """(t, true position, accelerometer, GPS or NaN) of a car that stops and goes."""
    rng = np.random.default_rng(seed)
    t = np.arange(SECONDS * RATE_HZ) / RATE_HZ
    accel = 1.5 * np.sin(2 * np.pi * t / 20) * (np.sin(2 * np.pi * t / 60) > -0.5)
    speed = np.cumsum(accel) / RATE_HZ
    position = np.cumsum(speed) / RATE_HZ
    fix = np.arange(t.size) % (RATE_HZ // GPS_HZ) == 0
    gps = np.where(fix, position + rng.normal(0, GPS_M, t.size), np.nan)
    return t, position, accel + BIAS_M_S2 + rng.normal(0, ACCEL_M_S2, t.size), gps


def model():
    """State: position, velocity, bias of the accelerometer; input: the accelerometer (eq. 12)."""
    dt = 1 / RATE_HZ
    return KalmanND(
        F=[[1.0, dt, -dt * dt / 2], [0.0, 1.0, -dt], [0.0, 0.0, 1.0]],
        B=[[dt * dt / 2], [dt], [0.0]],
        H=[[1.0, 0.0, 0.0]],
        Q=[[1e-6, 0.0, 0.0], [0.0, (ACCEL_M_S2 * dt) ** 2, 0.0], [0.0, 0.0, 1e-8]],
        R=[[GPS_M**2]],
        P=[[GPS_M**2, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.01]],
    )


def run(out, **_):
    """Position and its error: GPS alone, integration alone, both."""
    outcome = Outcome(
        "Position from GPS and accelerometer",
        "Paper 001, eqs. 12-13 and its example: KalmanND with F, H, Q, R, B",
    )
    t, position, accel, gps = drive()
    filt = model()
    fused = []
    for a, z in zip(accel.tolist(), gps.tolist(), strict=True):
        filt.predict([a])
        if z == z:
            filt.correct([z])
        fused.append(filt.x[0])
    fused = np.array(fused)
    dead = np.cumsum(np.cumsum(accel) / RATE_HZ) / RATE_HZ
    fix = ~np.isnan(gps)
    late = t > 20
    outcome.header = ("estimate", "RMS error m", "largest m")
    for name, miss in (
        ("GPS alone", (gps - position)[fix]),
        ("accelerometer integrated twice", dead - position),
        ("KalmanND", (fused - position)[late]),
    ):
        outcome.rows.append((name, rms(miss), float(np.abs(miss).max())))
    outcome.notes = [
        f"The bias of the accelerometer, {BIAS_M_S2} m/s2, is a state: found {filt.x[2]:.3f}.",
        "On the board the same class runs without numpy; use_steady_gain() makes a step cheap.",
    ]
    picture = Picture("Position", panels=2, height=6)
    picture.line(t[fix], gps[fix], "GPS", RAW)
    picture.line(t, position, "truth", 0)
    picture.line(t, fused, "KalmanND", 1)
    picture.line(t, dead, "accelerometer integrated twice", 2)
    picture.axes[0].set_ylim(position.min() - 40, position.max() + 40)
    picture.line(t[fix], (gps - position)[fix], "GPS", RAW, 1)
    picture.line(t, fused - position, "KalmanND", 1, 1)
    picture.save(outcome, out, "p001_gps", "GPS and accelerometer together",
                 ["position (m)", "error (m)"])
    return outcome

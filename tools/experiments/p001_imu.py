# SPDX-License-Identifier: MIT
"""Paper 001, eqs. 1-11 and Fig. 4: gyro sum with yaw transfer, blend, 1-D Kalman."""

import numpy as np
from attitude import Attitude, Complementary, Kalman1D, tilt_asin_deg, yaw_transfer_deg

from tools.experiments.outcome import RAW, Outcome, Picture
from tools.experiments.record import record, rms
from tools.virtual.motion import FreeMotion, Vibration

RATE_HZ = 250
SAMPLES = 8000
E_MEA = 4.0
E_EST = 2.0


def flight():
    """32 s of an aircraft's motion: tilt to 15 degrees while it turns, engine running."""
    motion = FreeMotion(seed=4, angle_deg=(15, 12, 120), shift_m=0.01, rest_s=8.0, highest_hz=0.3)
    motion = Vibration(5400, (0.06, 0.06, 0.06), (1, 1, 1), over=motion)
    return record(motion, SAMPLES, RATE_HZ, 44, seed=2, gyro_bias_dps=(0.8, -0.6, 0.5))


def estimates(rec):
    """{name: (roll, pitch)} of each step of the paper, and of Attitude. Bias from 2000 samples."""
    gyro = rec.bias_corrected(2000).gyro_dps
    accel = np.array([tilt_asin_deg(*a) for a in rec.accel_g.tolist()])
    dt, plain, moved = rec.dt_s, np.zeros(2), (0.0, 0.0)
    roll, pitch = Complementary(alpha=0.9996), Complementary(alpha=0.9996)
    ours = Attitude(RATE_HZ)
    columns = {"gyro sum": [], "gyro sum, yaw transfer": [], "blend 0.9996": [], "attitude": []}
    for (gx, gy, gz), (a_roll, a_pitch), a, raw in zip(
        gyro.tolist(), accel.tolist(), rec.accel_g.tolist(), rec.gyro_dps.tolist(), strict=True
    ):
        plain = plain + np.array([gx, gy]) * dt  # eqs. 1-2
        columns["gyro sum"].append(tuple(plain))
        moved = yaw_transfer_deg(moved[0] + gx * dt, moved[1] + gy * dt, gz * dt)  # eqs. 3-4
        columns["gyro sum, yaw transfer"].append(moved)
        # eqs. 7-8: the last output, turned as the gyro says, is what the blend corrects
        at = yaw_transfer_deg(roll.angle_deg + gx * dt, pitch.angle_deg + gy * dt, gz * dt)
        roll.reset(at[0])
        pitch.reset(at[1])
        blend = roll.update(a_roll, 0.0, dt), pitch.update(a_pitch, 0.0, dt)
        columns["blend 0.9996"].append(blend)
        ours.update(*raw, *a, dt)
        columns["attitude"].append((ours.roll_deg, ours.pitch_deg))
    return {"accelerometer": accel} | {n: np.array(c) for n, c in columns.items()}


def kalman(values, q, r=E_MEA, p=E_EST):
    """The 1-D filter on a column."""
    filt = Kalman1D(q, r, p)
    return np.array([filt.update(v) for v in values.tolist()])


def run(out, **_):
    """Fig. 4 and the steps before it, with the error of each."""
    outcome = Outcome(
        "Six degrees of freedom by sums and a blend",
        "Paper 001, eqs. 1-11, Fig. 4: 250 Hz, +-500 deg/s, +-8 g, 8000 samples",
    )
    rec = flight()
    columns = estimates(rec)
    truth = np.column_stack([rec.roll_deg, rec.pitch_deg])
    accel_pitch = columns["accelerometer"][:, 1]
    filtered = {
        "1-D Kalman as printed (no process noise)": kalman(accel_pitch, 0.0),
        "1-D Kalman with process noise": kalman(accel_pitch, 0.01),
    }
    outcome.header = ("estimate", "roll RMS deg", "pitch RMS deg", "largest deg")
    for name, angles in columns.items():
        miss = angles - truth
        outcome.rows.append(
            (name, rms(miss[:, 0]), rms(miss[:, 1]), float(np.abs(miss).max()))
        )
    for name, pitch in filtered.items():
        miss = pitch - rec.pitch_deg
        outcome.rows.append((name, "", rms(miss), float(np.abs(miss).max())))
    outcome.notes = [
        "The paper's theta is our roll (about x), its phi our pitch; eq. 6 needs a minus sign.",
        "Eqs. 9-11 have no process noise: the gain falls as 1/n, and the output becomes the mean"
        " since the start. It looks smooth and follows nothing.",
        "0.9996 at 250 Hz is a time constant of 10 s: a gyro bias of 0.1 deg/s leaves 1 degree.",
    ]
    t = rec.t_s
    picture = Picture("Gyro sum, yaw transfer and blend (eqs. 1-8)", panels=2, height=6.5)
    for axis in (0, 1):
        picture.line(t, columns["accelerometer"][:, axis], "accelerometer", RAW, axis)
        picture.line(t, truth[:, axis], "truth", 0, axis)
        for k, name in enumerate(("gyro sum", "gyro sum, yaw transfer", "blend 0.9996")):
            picture.line(t, columns[name][:, axis], name, k + 1, axis)
        picture.line(t, columns["attitude"][:, axis], "attitude", 4, axis)
    picture.save(outcome, out, "p001_steps", "Roll and pitch, each step of the paper and ours",
                 ["roll (deg)", "pitch (deg)"])
    picture = Picture("Pitch after the 1-D Kalman filter (Fig. 4)", x_label="sample")
    n = np.arange(SAMPLES)
    picture.line(n, accel_pitch, "accelerometer", RAW)
    picture.line(n, rec.pitch_deg, "truth", 0)
    for k, (name, pitch) in enumerate(filtered.items()):
        picture.line(n, pitch, name, k + 1)
    picture.line(n, columns["attitude"][:, 1], "attitude", 4)
    picture.save(outcome, out, "p001_fig4", "1-D Kalman on 8000 samples", ["pitch (deg)"])
    return outcome

# SPDX-License-Identifier: MIT
"""Paper 000, Figs. 1-3 and 8-14: its filters and parameter sweeps on one raw record.

The record: one axis turned by hand, motors at high speed on the same frame, no damping.
"""

import numpy as np
from attitude import Attitude, Complementary, GyroIntegral, Kalman1D, fixed
from attitude.lite import Kalman

from tools.experiments.outcome import RAW, Outcome, Picture
from tools.experiments.record import record, rms
from tools.virtual.motion import Sequence, Sinusoid, Still, Vibration

RATE_HZ = 250
SECONDS = 16
REST_S = 2
RPM = (8400, 8460, 8580, 8700)


def raw_record(seconds=SECONDS):
    """2 s at rest, then a sway of 25 degrees; four motors shake all the time; bias 2.5 deg/s."""
    sway = Sinusoid(25.0, 0.25, "roll", offset_deg=5.0, phase_deg=-90.0)
    motion = Sequence((Still(-20.0), REST_S), (sway, seconds - REST_S))
    tones = ((1, 1.0), (2, 0.3))
    motion = Vibration(RPM, (0.12, 0.12, 0.12), (2, 2, 2), over=motion, harmonics=tones)
    return record(motion, seconds * RATE_HZ, RATE_HZ, 184, seed=1, gyro_bias_dps=(2.5, 0, 0))


def complementary(rows, dt, p):
    """Eq. 1 with Q = 1 - P."""
    filt = Complementary(alpha=p)
    return np.array([filt.update(angle, rate, dt) for angle, rate in rows])


def single(rows, q=0.125, r=10.0, p=1.05):
    """Eq. 15, on the accelerometer alone."""
    filt = Kalman1D(q, r, p)
    return np.array([filt.update(angle) for angle, _ in rows])


def double(rows, dt, q_angle=0.001, q_bias=0.003, r_measure=0.03):
    """Eqs. 16-27 by the library's own calls."""
    kalman = Kalman()
    kalman.setAngle(0.0)
    kalman.set_params(q_angle, q_bias, r_measure)
    return np.array([kalman.getAngle(angle, rate, dt) for angle, rate in rows])


def recommended(rec):
    """Roll of the float Attitude and of its integer twin, bias taken at rest as the app does."""
    still = REST_S * RATE_HZ
    real = Attitude(RATE_HZ)
    twin = fixed.Attitude(rate_hz=RATE_HZ, gyro_dps=500, accel_g=8)
    twin.calibrate(rec.offset(still))
    gyro = rec.bias_corrected(still).gyro_dps
    floats, ints = [], []
    for g, a, counts in zip(gyro.tolist(), rec.accel_g.tolist(), rec.counts, strict=True):
        real.update(*g, *a, rec.dt_s)
        floats.append(real.roll_deg)
        twin.update(counts)
        ints.append(twin.roll_mdeg / 1000)
    return np.array(floats), np.array(ints)


def run(out, **_):
    """All figures, and each filter's error against the truth."""
    outcome = Outcome(
        "Filters on one record with motor vibration",
        "Paper 000, Figs. 1-3 and 8-14: complementary filter, Kalman of one and of two variables",
    )
    rec = raw_record()
    rows, dt, t = rec.roll_rows(), rec.dt_s, rec.t_s
    accel = np.array(rows)[:, 0]
    _raw_figures(outcome, out, rec, rows)
    _sweeps(outcome, out, rows, dt, t, accel)
    curves = {
        "accelerometer": accel,
        "complementary 0.9": complementary(rows, dt, 0.9),
        "complementary 0.98": complementary(rows, dt, 0.98),
        "Kalman, one variable": single(rows),
        "Kalman, two variables": double(rows, dt),
    }
    curves["attitude"], curves["fixed.attitude"] = recommended(rec)
    picture = Picture("All filters on the same record (Fig. 14)")
    picture.line(t, accel, "accelerometer", RAW)
    for k, name in enumerate(list(curves)[2:6]):
        picture.line(t, curves[name], name, k + 1)
    picture.line(t, rec.roll_deg, "truth", 0)
    picture.axes[0].set_xlim(8, 12)
    picture.save(outcome, out, "p000_fig14", "All filters together, 4 of the 16 s", ["roll (deg)"])
    late = t > 4
    outcome.header = ("filter", "RMS error deg", "largest deg", "jitter deg")
    for name, angle in curves.items():
        miss = (angle - rec.roll_deg)[late]
        jitter = float(np.std(np.diff(angle[late]) - np.diff(rec.roll_deg[late])))
        outcome.rows.append((name, rms(miss), float(np.abs(miss).max()), jitter))
    outcome.notes = [
        "jitter: standard deviation of the successive differences, less the true movement's.",
        "The single-variable filter sees no gyro: smooth, and late. The paper says the same.",
        "Vibration that creeps in is the paper's named limitation; the last two rows are ours.",
    ]
    return outcome


def _raw_figures(outcome, out, rec, rows):
    integral = GyroIntegral()
    gyro = np.array([integral.update(rate, rec.dt_s) for _, rate in rows])
    picture = Picture("Raw readings (Fig. 1)", panels=2, height=5)
    picture.line(rec.t_s, np.array(rows)[:, 0], "accelerometer", RAW)
    picture.line(rec.t_s, gyro, "integral of the gyro", 1)
    picture.line(rec.t_s, rec.roll_deg, "truth", 0)
    for k, rpm in enumerate(RPM):
        picture.line(rec.t_s, np.full(len(rec.t_s), rpm), f"motor {k + 1}", k, panel=1)
    picture.save(outcome, out, "p000_fig1", "Accelerometer noisy, gyro drifting, motors turning",
                 ["roll (deg)", "speed (1/min)"])
    picture = Picture("Complementary filter, P 0.9, Q 0.1 (Fig. 2)")
    picture.line(rec.t_s, np.array(rows)[:, 0], "accelerometer", RAW)
    picture.line(rec.t_s, gyro, "integral of the gyro", 1)
    picture.line(rec.t_s, complementary(rows, rec.dt_s, 0.9), "complementary", 0)
    picture.save(outcome, out, "p000_fig2", "The complementary filter takes the best of both",
                 ["roll (deg)"])


def _sweeps(outcome, out, rows, dt, t, accel):
    near = (t >= 8) & (t < 10)
    sweeps = (
        ("fig3", "Complementary, P from 0.95 to 0 (Fig. 3)",
         [(f"P {p:g}", complementary(rows, dt, p)) for p in (0.95, 0.8, 0.6, 0.4, 0.2, 0.0)]),
        ("fig8", "Kalman of one variable: P 1.05, Q 0.125, R 10 (Fig. 8)",
         [("output", single(rows))]),
        ("fig9", "Kalman of one variable, R from 2 to 40 (Fig. 9)",
         [(f"R {r:g}", single(rows, r=r)) for r in (2, 5, 10, 20, 40)]),
        ("fig10", "Kalman of two variables (Fig. 10)", [("output", double(rows, dt))]),
        ("fig11", "Kalman of two variables, R_measure from 0.03 to 0.43 (Fig. 11)",
         [(f"R {r:g}", double(rows, dt, r_measure=r)) for r in (0.03, 0.13, 0.23, 0.33, 0.43)]),
        ("fig12", "Kalman of two variables, Q_angle from 0.001 to 0.041 (Fig. 12)",
         [(f"Q_angle {q:g}", double(rows, dt, q_angle=q)) for q in (0.001, 0.011, 0.021, 0.041)]),
        ("fig13", "Kalman of two variables, Q_bias from 0.003 to 0.403 (Fig. 13)",
         [(f"Q_bias {q:g}", double(rows, dt, q_bias=q)) for q in (0.003, 0.103, 0.203, 0.403)]),
    )  # fmt: skip
    for file, title, curves in sweeps:
        picture = Picture(title)
        picture.line(t[near], accel[near], "accelerometer", RAW)
        picture.family(t[near], [(label, y[near]) for label, y in curves])
        picture.axes[0].set_ylim(-40, 60)
        picture.save(outcome, out, f"p000_{file}", title, ["roll (deg)"])

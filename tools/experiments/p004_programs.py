# SPDX-License-Identifier: MIT
"""Paper 004, Figs. 2-5: its two programs on the board, and "simulation against real time".

The paper compares a simulator with a real board by eye. Here one recording goes through the same
filters in double precision on the PC, in single precision and in integers on the emulated RP2040.
"""

import re
import struct
from pathlib import Path

import numpy as np
from attitude import Kalman1D, KalmanTilt, accel_tilt_deg, tilt_atan_deg

from tools import recordings
from tools.experiments import on_board
from tools.experiments.outcome import RAW, Outcome, Picture
from tools.virtual.motion import Sequence, Sinusoid, Still, Vibration

PROGRAMS = Path(__file__).parents[2] / "docs" / "examples"
SAMPLES = 250
REST_S = 1.3  # from power-on: boot, and the bias
EACH = 4  # of the recording's 286 samples a second
NAME = "02_undisturbed_slow_rotation_B.npz"
FROM = 10 * 286

ON_BOARD = """
import binascii, struct
from array import array
from attitude import Kalman1D, KalmanTilt, accel_tilt_deg, tilt_atan_deg
from attitude.fixed import KalmanTilt2
dt = {dt}
paper = Kalman1D(q=(4 * dt) ** 2, r=9, p=4)
tilt = KalmanTilt()
twin = KalmanTilt2(rate_hz=1 / dt, gyro_dps=500, accel_g=8)
counts = array("h", [0] * 7)
out = []
with open("/recording.bin", "rb") as f:
    for k in range({n}):
        f.readinto(counts)
        a = counts[0] / 4096, counts[1] / 4096, counts[2] / 4096
        rate = counts[4] / 65.5
        if not k:  # where the integer filter starts
            tilt.reset(accel_tilt_deg(*a)[0])
        row = (
            paper.update(tilt_atan_deg(*a)[0], rate * dt),
            tilt.update(accel_tilt_deg(*a)[0], rate, dt),
        )
        twin.update(counts)
        print(binascii.hexlify(struct.pack("<ffi", row[0], row[1], twin.roll_mdeg)).decode())
"""


def run(out, **_):
    """Run both programs, then the recording three ways."""
    outcome = Outcome(
        "Programs on the board; simulation against real time",
        "Paper 004: registers, bias from samples at rest, 4 ms loop, 1-D Kalman per axis",
    )
    _programs(outcome, out)
    counts = recordings.load(recordings.EXCERPTS / NAME).counts(gyro_dps=500, accel_g=8)
    counts = counts[FROM : FROM + SAMPLES * EACH : EACH]
    dt = EACH / 285.714
    files = {"/recording.bin": np.ascontiguousarray(counts, dtype="<i2").tobytes()}
    with on_board.board(files=files) as pico:
        text = pico.exec(ON_BOARD.format(n=len(counts), dt=dt), timeout_s=60)
    rows = [struct.unpack("<ffi", bytes.fromhex(line)) for line in text.split()]
    paper32, tilt32, whole = np.array(rows).T
    accel, paper64, tilt64 = _double(counts.tolist(), dt)
    pairs = (
        ("paper 004's 1-D Kalman, float32 on the board", paper32, paper64),
        ("KalmanTilt, float32 on the board", tilt32, tilt64),
        ("fixed.KalmanTilt2, integers on the board", whole / 1000, tilt64),
    )
    outcome.header = ("against float64 on the PC", "largest difference deg")
    t = np.arange(len(counts)) * dt
    picture = Picture("One recording, three arithmetics", panels=2, height=6.5)
    picture.line(t, accel, "accelerometer", RAW)
    picture.line(t, paper64, "1-D Kalman, float64", 0)
    picture.line(t, tilt64, "KalmanTilt, float64", 1)
    for k, (name, got, expected) in enumerate(pairs):
        miss = np.abs((got - expected + 180) % 360 - 180)
        outcome.rows.append((name, float(miss.max())))
        picture.line(t, got, name, k + 2)
        picture.line(t, np.maximum(miss, 1e-7), name, k + 2, 1)
    picture.axes[1].set_yscale("log")
    picture.save(outcome, out, "p004_arithmetic", "Overlaid, and the differences",
                 ["roll (deg)", "difference (deg)"])
    outcome.notes = [
        "The largest step of the integer filter's output is 0.001 degree, of the sensor 0.014.",
        "The paper's text gives R as (3 Ts)^2; its program has 3^2, which is used here.",
    ]
    outcome.values = {"paper004": {row[0]: row[1] for row in outcome.rows}}
    return outcome


def _double(rows, dt):
    paper, tilt = Kalman1D(q=(4 * dt) ** 2, r=9, p=4), KalmanTilt()
    out = []
    for ax, ay, az, _, gx, _, _ in rows:
        force = ax / 4096, ay / 4096, az / 4096
        angle = accel_tilt_deg(*force)[0]
        if not out:
            tilt.reset(angle)
        out.append((
            angle,
            paper.update(tilt_atan_deg(*force)[0], gx / 65.5 * dt),
            tilt.update(angle, gx / 65.5, dt),
        ))  # fmt: skip
    return np.array(out).T


def _programs(outcome, out):
    """Both programs as they are, but for fewer samples of rest and an end."""
    sway = Sequence((Still(), REST_S), (Sinusoid(15.0, 1.0, "roll"), 10.0))
    motion = Vibration(3000, (0.08,) * 3, (1,) * 3, over=sway)
    curves = {}
    for name, period_s in (("unfiltered", 0.05), ("filtered", 0.04)):
        code = (PROGRAMS / f"paper_004_{name}.py").read_text(encoding="utf-8")
        code = code.replace("ROWS = None", "ROWS = 30").replace("SAMPLES = 2000", "SAMPLES = 50")
        with on_board.board(motion, seed=1) as pico:
            text = pico.exec(code, timeout_s=60)
        angles = re.findall(r"Roll Angle \[deg\]: (\S+) Pitch", text)
        curves[name] = (np.arange(len(angles)) * period_s, np.array(angles, dtype=float))
    picture = Picture("Its two programs on the board (Figs. 2-5)")
    for k, (name, (t, angle)) in enumerate(curves.items()):
        picture.line(t, angle, name, k)
    picture.save(outcome, out, "p004_programs", "Serial output of both programs, sensor swayed"
                 " by 15 degrees at 1 Hz and shaken", ["roll (deg)"])

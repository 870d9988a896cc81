# SPDX-License-Identifier: MIT
"""The self-balancing robot that paper 000 names, on its simulated plant."""

import numpy as np

from tools.experiments.outcome import Outcome, Picture
from tools.plants import closed_loop
from tools.plants.balance import Balance

STAND_S = 60.0
RELEASE_S = 1.8
PUSH_S = 8.0
SCALE = 1.02  # gyro
OFFSET_G = 0.05


def run(out, **_):
    """60 s of standing with a bad sensor, and a push."""
    outcome = Outcome(
        "Self-balancing robot",
        "Named by paper 000: stands 60 s with 2 % gyro scale error and 50 mg offset; a push",
    )
    plant, _, _ = closed_loop.run(
        "balance", Balance, RELEASE_S + STAND_S, seed=1,
        gyro_matrix=((SCALE, 0, 0), (0, SCALE, 0), (0, 0, SCALE)),
        accel_bias_g=(OFFSET_G,) * 3, gyro_bias_dps=(1.0, 2.0, -1.0),
    )  # fmt: skip
    log = plant.log()
    t, lean = log["t_s"], log["lean_deg"]
    fell = np.nonzero(np.abs(lean) > 45)[0]
    stood = float((t[fell[0]] if fell.size else t[-1]) - RELEASE_S)
    push = float(np.abs(lean[(t >= PUSH_S) & (t < PUSH_S + 3)]).max())
    calm = t > PUSH_S + 5
    outcome.values = {"balance": {"stood_s": min(stood, STAND_S), "push_peak_deg": push}}
    outcome.header = ("", "value")
    outcome.rows = [
        ("stood, s", min(stood, STAND_S)),
        ("largest lean after the push, deg", push),
        ("lean at rest, standard deviation, deg", float(lean[calm].std())),
        ("travel from 5 s after the push on, m", float(np.ptp(log["x_m"][calm]))),
    ]
    outcome.notes = [
        f"The accelerometer's {OFFSET_G * 1000:.0f} mg look like a lean of 2.9 degrees; the speed"
        " loop finds the true balance without encoders.",
        "The push: a hand tilts the body to 10 degrees within 60 ms and lets go.",
    ]
    near = t < 24
    picture = Picture("Lean, drive and travel", panels=3, height=7)
    picture.line(t[near], lean[near], "lean", 0)
    picture.line(t[near], 100 * log["drive"][near], "drive", 2, 1)
    picture.line(t[near], log["x_m"][near], "travel", 1, 2)
    picture.save(outcome, out, "balance", f"Let go at {RELEASE_S} s, pushed at {PUSH_S:.0f} s",
                 ["lean (deg)", "drive (%)", "travel (m)"])
    return outcome

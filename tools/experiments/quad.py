# SPDX-License-Identifier: MIT
"""The quadcopter that papers 000 and 001 name: its loop in flight, and its step on the board."""

import numpy as np

from tools.experiments import on_board
from tools.experiments.outcome import Outcome, Picture
from tools.experiments.record import rms
from tools.plants import closed_loop
from tools.plants.quad import Quad

SECONDS = 6.5
ARM_S = 1.2

STEP = """
from firmware.app import App
from firmware.apps import quad
app = App()
app.set("telemetry_hz", 0)
quad.start(app)
app.loop.stop()
app.quad.command(500)
app.quad.escs.armed = True
imu, filter, control, step = app.imu, app.filter, app.quad.update, app.loop.step

def full():
    imu.read()
    filter.update(imu.counts)
    control(app)

def in_app():
    step(1000)

def lead():
    app.sensing.begin()

rows = [measure(full)]
if imu.split:
    parts = []
    for part in (0, 1):
        best = 1 << 29
        for _ in range(8):
            began = time.ticks_us()
            lead()
            middle = time.ticks_us()
            time.sleep_us(500)
            if part:
                began = time.ticks_us()
                in_app()
                middle = time.ticks_us()
            else:
                in_app()
            best = min(best, time.ticks_diff(middle, began))
        parts.append(best)
    rows.append(parts)
print(rows)
"""


class Pilot:
    """Arms, lifts off, then rolls, pitches and turns; logs what the board believes."""

    def __init__(self):
        self.rows = []

    def __call__(self, app, t_s):
        quad = app.quad
        if t_s < ARM_S:
            return
        if t_s < ARM_S + 0.1 and not quad.escs.armed:
            quad.command(0)
            quad.arm(app)
            return
        roll = 20000 if 2.5 < t_s < 3.3 else 0
        pitch = -15000 if 4.0 < t_s < 4.7 else 0
        yaw = int(min(max(t_s - 5.2, 0.0), 0.6) * 75000)
        quad.command(680 if t_s < 2.2 else 632, roll, pitch, yaw)
        filt = app.filter
        self.rows.append(
            (t_s, roll, pitch, yaw, filt.roll_mdeg, filt.pitch_mdeg, filt.yaw_mdeg)
        )


def run(out, **_):
    """A flight of some seconds in closed loop, and the cost of a step on the emulated RP2040."""
    outcome = Outcome(
        "Quadcopter attitude loop at 1 kHz",
        "Named by papers 000 and 001: rate and angle loops on three axes, mixer, four ESCs",
    )
    pilot = Pilot()
    plant, _, stats = closed_loop.run(
        "quad", Quad, SECONDS, drive=pilot, seed=1, gyro_bias_dps=(1.0, 2.0, -1.0)
    )
    log, believed = plant.log(), np.array(pilot.rows)
    with on_board.board(seed=1) as pico:
        (step_us, used), *split = on_board.run(pico, STEP)
    outcome.values = {"quad": {"step_us": step_us, "bytes": used}}
    outcome.header = ("on the emulated RP2040, 125 MHz", "us", "bytes")
    outcome.rows = [("burst, attitude, three cascades, mixer, four PWM writes", step_us, used)]
    if split:
        lead, rest = split[0]
        outcome.values["quad"]["split_app_us"] = lead + rest
        outcome.rows.append(
            ("the app's own step, burst in the background, checks included", lead + rest, "")
        )
    truth = np.interp(believed[:, 0], log["t_s"], log["roll_deg"])
    outcome.notes = [
        f"Flight: {stats['ticks']} ticks, {stats['overruns']} overruns; estimate of roll against"
        f" truth {rms(believed[:, 4] / 1000 - truth):.2f} deg RMS. In the air the accelerometer"
        " feels thrust, not gravity, so a lasting tilt is pulled towards level.",
        "Motors shake the frame with up to 0.25 g each.",
    ]
    picture = Picture("Angles in flight", panels=4, height=8.5)
    names = ("roll", "pitch", "yaw")
    for k, name in enumerate(names):
        picture.line(believed[:, 0], believed[:, 1 + k] / 1000, "asked for", 3, k)
        picture.line(believed[:, 0], believed[:, 4 + k] / 1000, "board's estimate", 1, k)
        picture.line(log["t_s"], log[f"{name}_deg"], "truth", 0, k)
    for k in range(4):
        picture.line(log["t_s"], 100 * log[f"m{k + 1}"], f"motor {k + 1}", k, 3)
    picture.axes[0].set_xlim(ARM_S, SECONDS)
    picture.save(outcome, out, "quad", "Take-off, roll, pitch, turn",
                 [f"{n} (deg)" for n in names] + ["motors (%)"])
    return outcome

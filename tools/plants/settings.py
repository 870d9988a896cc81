# SPDX-License-Identifier: MIT
"""Do the robot and the quadcopter fly with every range, rate, low-pass and mounting?

    python -m tools.plants.settings [--every N]     all of them, or each N-th; exits 1 on a failure

The robot is pushed by 10 degrees and must stand; the quadcopter is asked for a step of roll, and
its peak is compared with that of the straight mounting at the default settings.
"""

import argparse
import itertools
import sys
import tempfile
from concurrent.futures import ProcessPoolExecutor
from functools import lru_cache

from tqdm import tqdm

from tools.plants.balance import Balance
from tools.plants.quad import Quad
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.port import Port

AXES = ("+x", "-x", "+y", "-y", "+z", "-z")
MOUNTINGS = [(f, u) for f in AXES for u in AXES if f[1] != u[1]]  # forward and up: 24
STRAIGHT = ("+x", "+z")
STEP_DEG = 20.0
_RATES = {"balance": (100, 250, 500, 1000), "quad": (500, 1000)}


class _Mounted:
    """A plant as its sensor feels it, mounted by a rotation from the sensor to the robot."""

    duration_s = None

    def __init__(self, plant, rotation):
        self._plant, self._r = plant, rotation

    def at(self, t_s):
        sample, r = self._plant.at(t_s), self._r
        turned = [
            sum(r[3 * k + i] * vector[k] for k in range(3))
            for vector in (sample[:3], sample[3:6])
            for i in range(3)
        ]
        return (*turned, sample[6])

    def truth(self, t_s):
        return self._plant.truth(t_s)


def fly(name, mounting, seconds, pilot, make, **knobs):
    """firmware.apps.NAME on its plant with these knobs; the plant."""
    with tempfile.TemporaryDirectory() as root:
        chip = MPU6050Chip(seed=3, gyro_bias_dps=(1.0, 2.0, -1.0))
        with Port("rp2", {0: Bus(chip, log_length=1)}, version=(1, 26, 1), root=root) as port:
            from calibration import Calibration
            from calibration import mounting as mountings

            from firmware.app import App
            from firmware.calibration import save_calibration

            rotation = mountings.orientation(*mounting)
            save_calibration(Calibration(who_am_i=0x68).mounted(rotation))
            app = App()
            plant = make(port, app.board.outputs)
            chip.set_motion(_Mounted(plant, rotation))
            __import__("firmware.apps." + name, fromlist=["start"]).start(app)
            for knob, value in knobs.items():
                app.set(knob, value)
            while port.now_ns < seconds * 1e9:
                port.run_ms(10)
                pilot(app, port.now_ns / 1e9)
            app.stop()
            return plant


def push_lean_deg(mounting=STRAIGHT, **knobs):
    """The robot's lean at the end, degrees, three seconds after a push of 10 degrees."""

    def pilot(app, t_s):
        if not app.balance.armed and t_s < 0.9:
            app.balance.arm()

    def make(port, pins):
        # a range of 250 deg/s cannot follow the usual push, which turns at 333 deg/s
        length_s = 0.1 if knobs.get("gyro_dps") == 250 else 0.06
        return Balance(port, pins, hold_s=2.2, push=(4.0, 10.0, length_s))

    return float(abs(fly("balance", mounting, 7.0, pilot, make, **knobs).log()["lean_deg"][-1]))


def step_peak_deg(mounting=STRAIGHT, **knobs):
    """The largest roll of the quadcopter that was asked for STEP_DEG, degrees."""

    def pilot(app, t_s):
        if 1.2 <= t_s < 1.3 and not app.quad.armed:
            app.quad.command(0)
            app.quad.arm()
        elif t_s >= 1.3:
            roll = round(1000 * STEP_DEG) if t_s > 2.2 else 0
            app.quad.command(680 if t_s < 2.0 else 632, roll)

    log = fly("quad", mounting, 2.9, pilot, Quad, **knobs).log()
    return float(log["roll_deg"].max()) if log["height_m"].max() > 0.1 else 0.0


@lru_cache
def _straight_deg(knobs):
    return step_peak_deg(**dict(knobs))


def _check(job):
    name, mounting, knobs = job
    if name == "balance":
        value = push_lean_deg(mounting, **knobs)
        return value < 5.0, value, job
    value = step_peak_deg(mounting, **knobs)
    straight = value if mounting == STRAIGHT else _straight_deg(tuple(knobs.items()))
    return value > 15 and abs(value / straight - 1) < 0.1, value, job


def jobs(every):
    """All combinations, or each `every`-th."""
    made = []
    for name, rates in _RATES.items():
        for rate, gyro, dlpf, mounting in itertools.product(
            rates, (250, 500, 1000, 2000), (184, 94, 44), MOUNTINGS
        ):
            knobs = {"rate_hz": rate, "gyro_dps": gyro, "dlpf_hz": dlpf}
            made.append((name, mounting, knobs))
    return made[::every]


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.plants.settings", description=__doc__)
    parser.add_argument("--every", type=int, default=1)
    work = jobs(parser.parse_args().every)
    bad = 0
    with ProcessPoolExecutor() as pool:
        for good, value, job in tqdm(pool.map(_check, work), total=len(work), disable=None):
            if not good:
                bad += 1
                print("%s forward %s up %s %s: %.1f" % (job[0], *job[1], job[2], value))
    print("%d of %d stand, and step as the straight one" % (len(work) - bad, len(work)))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

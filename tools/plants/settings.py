# SPDX-License-Identifier: MIT
"""Do the robot and the quadcopter fly with every range, rate, low-pass and mounting?

    python -m tools.plants.settings [--every N]     all of them, or each N-th; exits 1 on a failure

The robot is pushed by 10 degrees at up to 333 deg/s, beyond the smallest range, and must stand;
the quadcopter is asked for a step of roll, and its peak is compared with that of the straight
mounting at the same settings.
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

    robot = []

    def pilot(app, t_s):
        if not app.balance.armed and t_s < 0.9:
            app.balance.arm()
        if app.balance.running:  # held on, it would wind itself up, and start with a kick
            robot[0].let_go(t_s)

    def make(port, pins):
        robot.append(Balance(port, pins, hold_s=2.2, push=(4.0, 10.0, 0.06)))
        return robot[0]

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


def check(job):
    """(whether it is good, degrees: lean or peak, that peak to the straight one's or 1, job)."""
    name, mounting, knobs = job
    if name == "balance":
        value = push_lean_deg(mounting, **knobs)
        return value < 5.0, value, 1.0, job
    value = step_peak_deg(mounting, **knobs)
    straight = value if mounting == STRAIGHT else _straight_deg(tuple(knobs.items()))
    ratio = value / max(straight, 0.1)
    return 15 < value < 30 and abs(ratio - 1) < 0.1, value, ratio, job


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


def table(results):
    """A line for each application, rate and range: over its low-passes and mountings."""
    lines = ["%-8s %5s %6s %4s %22s %16s" % ("", "Hz", "deg/s", "runs", "lean or peak, deg",
                                             "to straight")]  # fmt: skip
    rows = {}
    for result in results:
        name, _, knobs = result[3]
        rows.setdefault((name, knobs["rate_hz"], knobs["gyro_dps"]), []).append(result)
    for key, found in rows.items():
        values, ratios = [r[1] for r in found], [r[2] for r in found]
        lines.append(
            "%-8s %5d %6d %4d %12.2f to %6.2f %8.3f to %.3f"
            % (*key, len(found), min(values), max(values), min(ratios), max(ratios))
        )
    return "\n".join(lines)


def main():
    parser = argparse.ArgumentParser(prog="python -m tools.plants.settings", description=__doc__)
    parser.add_argument("--every", type=int, default=1)
    parser.add_argument("--processes", type=int, default=None)
    arguments = parser.parse_args()
    work = jobs(arguments.every)
    with ProcessPoolExecutor(arguments.processes) as pool:
        results = list(tqdm(pool.map(check, work), total=len(work), disable=None))
    bad = [result for result in results if not result[0]]
    for _, value, ratio, job in bad:
        print("%s forward %s up %s %s: %.1f, %.3f" % (job[0], *job[1], job[2], value, ratio))
    print(table(results))
    print("%d of %d stand, and step as the straight one" % (len(work) - len(bad), len(work)))
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())

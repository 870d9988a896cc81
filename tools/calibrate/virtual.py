# SPDX-License-Identifier: MIT
"""The calibration's figures, on the worst sensor that the datasheet allows."""

import math
import os
import random
import tempfile

import numpy as np

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.chip.tolerances import worst_case
from tools.virtual.motion import Still
from tools.virtual.motion import quaternions as quat
from tools.virtual.port import Port

# roll and pitch, degrees, that put each face up
FACES = ((0, 0), (180, 0), (90, 0), (-90, 0), (0, -90), (0, 90))
TEMPERATURES_C = (5.0, 45.0)  # of the two calibrations
CHECKED_C = (-10.0, 5.0, 20.0, 35.0, 50.0)
RESIDUAL_MG, SCALE, TILT_DEG = 2.0, 0.001, 0.3


def pose(rig, roll_deg, pitch_deg, temp_c):
    """Lay the virtual sensor so, and let its low-pass forget the pose before."""
    port, chip, bus, imu = rig
    bus.advance(port.now_ns)
    chip.set_motion(Still(roll_deg, pitch_deg, temp_c=temp_c))
    for _ in range(4):
        port.run_ms(100)
        imu.read()


def measure(seed, platform="rp2"):
    """Figures of two six-face calibrations and of the static tilt over temperature, a dict."""
    part = worst_case(seed)
    chip = MPU6050Chip(seed=seed, **part)
    bus = Bus(chip)
    here = os.getcwd()
    with tempfile.TemporaryDirectory() as root, Port(platform, {0: bus}, root=root) as port:
        os.chdir(root)
        try:
            return _measure(seed, part, chip, bus, port)
        finally:
            os.chdir(here)


def _measure(seed, part, chip, bus, port):
    from firmware.app import App
    from firmware.calibration import load_calibration

    app = App()
    residuals = []
    for temp_c in TEMPERATURES_C:
        steps = app.calibrating()
        rig = (port, chip, bus, app.imu)
        pose(rig, 0, 0, temp_c)
        steps.gyro(1.0)
        faces = list(FACES)
        random.Random(seed).shuffle(faces)
        for roll_deg, pitch_deg in faces:
            pose(rig, roll_deg, pitch_deg, temp_c)
            steps.pose()
        steps.solve()
        residuals.append(steps.cal.residual_mg)
        steps.save("2026-01-01")
    cal, _ = load_calibration()
    # what matrix x sensor gives, which should be the identity
    product = np.array(cal.accel_matrix).reshape(3, 3) @ np.array(part["accel_matrix"])
    return {
        "residual_mg": max(residuals),
        "scale": float(np.abs(np.diag(product) - 1).max()),
        "cross_axis": float(np.abs(product - np.diag(np.diag(product))).max()),
        "tilt_deg": {temp_c: _tilt(app, rig, cal, temp_c, seed) for temp_c in CHECKED_C},
        "date": cal.date,
        "who_am_i": cal.who_am_i,
    }


def _tilt(app, rig, cal, temp_c, seed):
    """Largest angle between true and measured up over twelve poses at a temperature."""
    from calibration.rest import rest

    generator = random.Random(seed + 100)
    worst = 0.0
    for _ in range(12):
        roll, pitch = generator.uniform(-180, 180), generator.uniform(-80, 80)
        pose(rig, roll, pitch, temp_c)
        still = rest(app.imu, 0.5)
        told = cal.at(still.temp_c).apply(still.accel_g, still.gyro_dps)[0]
        true = quat.gravity(quat.from_euler(roll, pitch, 0.0))
        worst = max(worst, _angle_deg(told, true))
    return worst


def _angle_deg(a, b):
    cross = np.linalg.norm(np.cross(a, b))
    return math.degrees(math.atan2(cross, float(np.dot(a, b))))


def run(seed):
    """Print the figures beside their bars; exit code 1 when one is missed."""
    found = measure(seed)
    tilt = max(found["tilt_deg"].values())
    print(f"sensor at the datasheet's limits, signs from seed {seed}; six faces at 5 and 45 degC")
    print(f"residual         {found['residual_mg']:.2f} mg (at most {RESIDUAL_MG})")
    print(f"scale error      {100 * found['scale']:.3f} % (at most {100 * SCALE})")
    print(f"cross-axis error {100 * found['cross_axis']:.3f} %")
    for temp_c, error in found["tilt_deg"].items():
        print(f"static tilt at {temp_c:5.1f} degC: {error:.3f} deg (at most {TILT_DEG})")
    good = found["residual_mg"] < RESIDUAL_MG and found["scale"] < SCALE and tilt < TILT_DEG
    return 0 if good else 1

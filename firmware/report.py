# SPDX-License-Identifier: MIT
"""How the sensor is: app.report() and app.self_test() at the REPL."""

import time
from array import array
from math import sqrt

from micropython import const

from firmware.stats import faults

_SAMPLES = const(100)


def report(app):
    """A dict: rate, jitter, size of the force, noise, temperature, registers, faults by cause;
    gyro_scale: for x, y, z by how much the rate is multiplied (1: as calibrated) and one sigma, as
    a filter has learned it that does.

    |a| is 1 g and the noise that of the sensor only while the robot is at rest.
    """
    timing = app.stats()
    imu = app.imu
    sums, squares = [0] * 7, [0] * 7
    for _ in range(_SAMPLES):
        time.sleep_ms(1 + app.loop.period_us // 1000)
        counts = array("h", imu.counts)  # in one piece: the tick does not come in between
        for i in range(7):
            sums[i] += counts[i]
            squares[i] += counts[i] * counts[i]
    mean = [s / _SAMPLES for s in sums]
    noise = [
        sqrt(max(0, _SAMPLES * squares[i] - sums[i] * sums[i])) / _SAMPLES for i in range(4, 7)
    ]
    force = app.calibration.apply([m / imu.accel_lsb_per_g for m in mean[:3]], (0, 0, 0))[0]
    seen = faults(app)
    out = {
        "rate_hz": 1e6 / timing["period_mean_us"] if timing["period_mean_us"] else 0.0,
        "jitter_p99_us": timing["jitter_p99_us"],
        "force_g": sqrt(sum([f * f for f in force])),
        "gyro_noise_dps": max(noise) / imu.gyro_lsb_per_dps,
        "temp_c": imu.temp_c(),
        "part": imu.profile.name,
        "registers_good": seen.get("register", 0) == 0,
        "stale": app.stale,
        "faults": seen,
    }
    if hasattr(app.filter, "learned"):
        scale, sigma = app.filter.learned()[:2]
        out["gyro_scale"] = tuple([(1.0 + part, off) for part, off in zip(scale, sigma)])
    return out


def tested(imu):
    """(whether the chip's self-test passed, a line for each axis); the sensor is at rest. OSError.

    A part without factory trim cannot be judged: that counts as not passed and says so.
    """
    from mpu6050.selftest import passed, self_test

    axes = self_test(imu)
    lines = []
    for axis in axes:
        change = "no factory trim" if axis.change is None else "%+.1f %%" % (100 * axis.change)
        lines.append("%s %s %s" % (axis.name, change, "good" if axis.passed else "BAD"))
    return passed(axes), lines

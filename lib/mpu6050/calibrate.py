# SPDX-License-Identifier: MIT
"""Calibrating at the REPL, one call per step; nothing here belongs in a running loop.

from mpu6050.calibrate import Poses, gyro_bias
cal = gyro_bias(imu)                 # the sensor lies still
poses = Poses(imu)
poses.add()                          # once for each pose, in any order
cal = poses.solve(cal)
"""

import time
from collections import namedtuple
from math import sqrt

from mpu6050 import solve
from mpu6050.calibration import Calibration, multiply

# Means over the time of rest: g, deg/s, degC
Rest = namedtuple("Rest", ("accel_g", "gyro_dps", "temp_c"))

_GYRO_LIMIT_DPS = 0.5  # deviation; the sensor's own noise is 0.1 at the widest filter
_ACCEL_LIMIT_G = 0.02  # deviation; own noise 0.008 at the widest filter
_DRIFT_LIMIT_G = 0.01  # of the mean from the first half to the second: a slow turn
_BIAS_LIMIT_DPS = 40  # PS p. 12: +-20 at once and +-20 over temperature
_FACES = ("+x", "+y", "+z", "-x", "-y", "-z")


class NotStill(ValueError):
    """The sensor moved while it should rest; the text says how."""


def rest(imu, seconds=1.0):
    """Mean readings (a Rest) of a sensor that lies still. NotStill says why not. OSError."""
    pause_ms = max(1, round(1000 / imu.rate_hz))
    half = max(10, int(500 * seconds / pause_ms))
    first, first_squares = _sums(imu, half, pause_ms)
    second, second_squares = _sums(imu, half, pause_ms)
    n = 2 * half
    scale = [imu.accel_lsb_per_g] * 3 + [1] + [imu.gyro_lsb_per_dps] * 3
    mean, spread, drift = [], [], []
    for i in range(7):
        total = first[i] + second[i]
        mean.append(total / n / scale[i])
        # integers up to here, so that single precision does not eat the small difference
        variance = n * (first_squares[i] + second_squares[i]) - total * total
        spread.append(sqrt(max(0, variance)) / n / scale[i])
        drift.append((second[i] - first[i]) / half / scale[i])
    _judge(mean, spread, drift)
    temp = mean[3] / imu.profile.temp_lsb_per_c + imu.profile.temp_offset_c
    return Rest(tuple(mean[:3]), tuple(mean[4:]), temp)


def gyro_bias(imu, cal=None, seconds=2.0):
    """`cal` (or a new Calibration) with the gyro bias of a sensor that lies still. NotStill."""
    still = rest(imu, seconds)
    cal = (cal or Calibration(who_am_i=imu.who_am_i)).at(still.temp_c)
    return cal.but(gyro_bias_dps=still.gyro_dps)


class Poses:
    """Resting poses for the accelerometer: the six faces, or any others."""

    def __init__(self, imu):
        self._imu = imu
        self._rests = []

    def add(self, seconds=1.0):
        """Measure one pose; returns the face that is up, such as "+z". NotStill. OSError."""
        self._rests.append(rest(self._imu, seconds))
        return face(self._rests[-1].accel_g)

    def undo(self):
        """Forget the last pose."""
        self._rests.pop()

    def missing(self):
        """Faces that have not been up yet."""
        seen = [face(r.accel_g) for r in self._rests]
        return [name for name in _FACES if name not in seen]

    def solve(self, cal=None, faces=True):
        """`cal` (or a new one) with the accelerometer's bias, matrix and residual_mg.

        faces: each pose lies square on a face of a box, all six have been up. Otherwise any
        directions, well spread, six or better twelve. The mounting in `cal` stays: it is its
        gyro_matrix. ValueError says what is missing.
        """
        readings = [r.accel_g for r in self._rests]
        if faces:
            if self.missing():
                raise ValueError("not yet up: " + ", ".join(self.missing()))
            solution = solve.from_faces(readings, [_unit(face(r)) for r in readings])
        else:
            solution = solve.from_rest(readings)
        bias, matrix, residual = solution
        temp = sum([r.temp_c for r in self._rests]) / len(self._rests)
        cal = (cal or Calibration()).at(temp)
        return cal.but(
            accel_bias_g=bias,
            accel_matrix=multiply(cal.gyro_matrix, matrix),
            residual_mg=1000 * residual,
            who_am_i=self._imu.who_am_i,
        )


def with_slopes(cold, warm):
    """`warm` with the bias slopes between two calibrations made at different temperatures.

    ValueError when the temperatures are less than 5 degC apart.
    """
    span = warm.temp_c - cold.temp_c
    if abs(span) < 5:
        raise ValueError("only %.1f degC apart: at least 5 needed" % abs(span))
    gyro = [(w - c) / span for w, c in zip(warm.gyro_bias_dps, cold.gyro_bias_dps)]
    accel = [(w - c) / span for w, c in zip(warm.accel_bias_g, cold.accel_bias_g)]
    return warm.but(gyro_slope_dps_per_c=tuple(gyro), accel_slope_g_per_c=tuple(accel))


def face(accel_g):
    """The face that is up, "+x" to "-z", for a reading in g at rest."""
    sizes = [abs(v) for v in accel_g]
    axis = sizes.index(max(sizes))
    return ("+" if accel_g[axis] > 0 else "-") + "xyz"[axis]


def _unit(name):
    vector = [0.0, 0.0, 0.0]
    vector["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return vector


def _sums(imu, n, pause_ms):
    sums, squares = [0] * 7, [0] * 7
    for _ in range(n):
        imu.read()
        if not imu.plausible():
            raise NotStill("no data: the sensor sends %s" % list(imu.counts))
        for i in range(7):
            value = imu.counts[i]
            sums[i] += value
            squares[i] += value * value
        time.sleep_ms(pause_ms)
    return sums, squares


def _judge(mean, spread, drift):
    for i in range(3):
        axis = "xyz"[i]
        for size, limit, unit, what in (
            (spread[4 + i], _GYRO_LIMIT_DPS, "deg/s", "gyro %s shook by" % axis),
            (spread[i], _ACCEL_LIMIT_G, "g", "accelerometer %s shook by" % axis),
            (abs(drift[4 + i]), _GYRO_LIMIT_DPS, "deg/s", "gyro %s drifted by" % axis),
            (abs(drift[i]), _DRIFT_LIMIT_G, "g", "accelerometer %s drifted by" % axis),
            (abs(mean[4 + i]), _BIAS_LIMIT_DPS, "deg/s", "gyro %s turns at" % axis),
        ):
            if size > limit:
                raise NotStill("moved: %s %.3g %s (limit %g)" % (what, size, unit, limit))
    length = sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2)
    if not 0.8 < length < 1.2:
        raise NotStill("moved, or broken: it feels %.3g g instead of 1 g" % length)

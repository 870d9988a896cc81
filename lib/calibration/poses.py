# SPDX-License-Identifier: MIT
"""Calibrating at the REPL, one call per step; nothing here belongs in a running loop.

from calibration.poses import Poses
from calibration.rest import gyro_bias
cal = gyro_bias(imu)                 # the sensor lies still
poses = Poses(imu)
poses.add()                          # once for each pose, in any order
cal = poses.solve(cal)
"""

from calibration import Calibration, multiply, solve
from calibration.rest import rest

_FACES = ("+x", "+y", "+z", "-x", "-y", "-z")


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
        directions, well spread, six or better twelve. The mounting in `cal` stays.
        ValueError says what is missing.
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
            accel_matrix=multiply(cal.rotation(), matrix),
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

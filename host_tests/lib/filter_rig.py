# SPDX-License-Identifier: MIT
"""What tests of all filters share: how each is made, and a body that turns, as counts."""

from array import array

import numpy as np

LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
LSB_PER_G = {2: 16384.0, 4: 8192.0, 8: 4096.0, 16: 2048.0}
INTEGER = ("attitude", "kalman2")
FLOAT = ("float.attitude", "float.kalman", "float.complementary")
ALL = INTEGER + FLOAT
FREE = ("attitude", "float.attitude")  # know yaw, and learn the bias of three axes


def make(name, rate_hz=250, gyro_dps=500, accel_g=8, **settings):
    """One of ALL."""
    from attitude import Complementary, FloatAttitude, FloatTilt, KalmanTilt, fixed

    ranges = {"gyro_dps": gyro_dps, "accel_g": accel_g}
    if name == "attitude":
        return fixed.Attitude(rate_hz, **ranges, **settings)
    if name == "kalman2":
        return fixed.KalmanTilt2(rate_hz, **ranges, **settings)
    if name == "float.attitude":
        return FloatAttitude(rate_hz, **ranges, **settings)
    if name == "float.kalman":
        return FloatTilt(KalmanTilt, rate_hz, **ranges, **settings)
    return FloatTilt(Complementary, rate_hz, **ranges, **{"tau_s": 0.5, **settings})


def quaternion(roll_deg, pitch_deg, yaw_deg=0.0):
    """Sensor to earth, scalar first; yaw first, roll last."""
    half = np.radians([roll_deg, pitch_deg, yaw_deg]) / 2
    (a, b, c), (p, q, r) = np.cos(half), np.sin(half)
    return product((c, 0, 0, r), product((b, 0, q, 0), (a, p, 0, 0)))


def product(p, q):
    a, b, c, d = p
    w, x, y, z = q
    return np.array([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                     a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w])  # fmt: skip


def matrix(q):
    """Rotation matrix, sensor to earth."""
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def angles(q):
    """Roll, pitch, yaw in degrees."""
    m = matrix(q)
    roll, pitch = np.arctan2(m[2, 1], m[2, 2]), np.arctan2(-m[2, 0], np.hypot(m[2, 1], m[2, 2]))
    return np.degrees([roll, pitch, np.arctan2(m[1, 0], m[0, 0])])


def wrap(deg):
    return (np.asarray(deg) + 180.0) % 360.0 - 180.0


def tilt_error(filt, q):
    """Angle between the filter's vertical and the true one, degrees."""
    roll, pitch = filt.angles_mdeg[0] / 1000, filt.angles_mdeg[1] / 1000
    cosine = matrix(quaternion(roll, pitch))[2] @ matrix(q)[2]
    return float(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def yaw_error(filt, q):
    return float(wrap(filt.angles_mdeg[2] / 1000 - angles(q)[2]))


class Body:
    """A body in the robot's frame; counts() is what a sensor with this bias, ranges and
    calibration (its inverse) sends.
    """

    def __init__(
        self, roll=0.0, pitch=0.0, yaw=0.0, bias=(0, 0, 0), gyro_dps=500, accel_g=8, cal=None
    ):
        self.q, self.rates = quaternion(roll, pitch, yaw), np.zeros(3)
        self.bias = np.array(bias, float)  # in the robot's frame, on top of the calibration
        self._gyro, self._accel, self._cal = LSB_PER_DPS[gyro_dps], LSB_PER_G[accel_g], cal
        self._counts = array("h", [0] * 7)

    def turn(self, rates_dps, dt_s):
        """Turn at these rates about its own axes."""
        self.rates = np.array(rates_dps, float)
        v = np.radians(self.rates) * dt_s / 2
        n = np.linalg.norm(v)
        s = np.sinc(n / np.pi)
        self.q = product(self.q, (np.cos(n), *(v * s)))
        self.q /= np.linalg.norm(self.q)

    def counts(self):
        gyro, accel = self.rates + self.bias, matrix(self.q).T @ (0, 0, 1)
        if self._cal:
            gyro = (
                np.linalg.solve(np.reshape(self._cal.gyro_matrix, (3, 3)), gyro)
                + self._cal.gyro_bias_dps
            )
            accel = (
                np.linalg.solve(np.reshape(self._cal.accel_matrix, (3, 3)), accel)
                + self._cal.accel_bias_g
            )
        both = [*np.round(accel * self._accel), 0, *np.round(gyro * self._gyro)]
        for i, value in enumerate(both):
            self._counts[i] = int(np.clip(value, -32768, 32767))
        return self._counts


def rest(filt, body, seconds, rate_hz=250):
    """Feed a body that does not move."""
    body.turn((0, 0, 0), 0)
    counts = body.counts()
    for _ in range(round(seconds * rate_hz)):
        filt.update(counts)


def turn(filt, body, rates_dps, seconds, rate_hz=250):
    """Feed a body that turns at these rates."""
    for _ in range(round(seconds * rate_hz)):
        body.turn(rates_dps, 1 / rate_hz)
        filt.update(body.counts())

# SPDX-License-Identifier: MIT
"""Motions of known attitude, and what a sensor with faults reads: by numpy, for minutes."""

import numpy as np

G = 9.80665
IDEAL = np.eye(3)


def product(p, q):
    """Hamilton products of (n x 4) quaternions."""
    a, b, c, d = p.T
    w, x, y, z = q.T
    return np.stack([a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
                     a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], 1)


def up_of(quats):
    """(n x 3) the earth's z in sensor axes."""
    w, x, y, z = np.asarray(quats, float).T
    return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1)


def from_euler(roll, pitch, yaw):
    """(n x 4) of angles in degrees."""
    half = np.radians(np.stack(np.broadcast_arrays(roll, pitch, yaw), 1)) / 2
    (cr, cp, cy), (sr, sp, sy) = np.cos(half).T, np.sin(half).T
    return np.stack([cr * cp * cy + sr * sp * sy, sr * cp * cy - cr * sp * sy,
                     cr * sp * cy + sr * cp * sy, cr * cp * sy - sr * sp * cy], 1)


class Motion:
    """`angles(t)` gives (roll, pitch, yaw) in degrees, `push(t)` an earth acceleration in g.

    `.t`, `.quat` (truth), `.gyro` (deg/s), `.accel` (g) of a perfect sensor at rate_hz.
    """

    def __init__(self, seconds, angles, push=None, rate_hz=100.0):
        self.rate_hz = rate_hz
        self.t = t = np.arange(round(seconds * rate_hz)) / rate_hz
        self.quat = from_euler(*angles(t))
        before, after = (from_euler(*angles(t + h)) for h in (-1e-4, 1e-4))
        turn = product(before * (1, -1, -1, -1), after)
        self.gyro = np.degrees(2 * turn[:, 1:] * np.sign(turn[:, :1])) / 2e-4
        w, x, y, z = self.quat.T
        rows = np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
                         2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], 1)
        force = np.zeros((len(t), 3)) if push is None else push(t)
        self.accel = np.einsum("nji,nj->ni", rows.reshape(-1, 3, 3), force + (0, 0, 1))

    def read(self, matrix=IDEAL, bias=(0, 0, 0), noise=True, seed=0):
        """(n x 6) gyro in deg/s, accelerometer in g of a sensor with these faults."""
        rng = np.random.default_rng(seed)
        gyro = self.gyro @ np.asarray(matrix, float).T + bias
        rows = np.hstack([gyro, self.accel])
        if noise:  # datasheet, at 44 Hz of bandwidth
            rows += rng.normal(0, [0.04] * 3 + [0.0033] * 3, rows.shape)
        return rows

    def tilt_error_deg(self, quats):
        """(n) angle between true and estimated up."""
        a, b = up_of(quats), up_of(self.quat)
        across = np.linalg.norm(np.cross(a, b), axis=1)
        return np.degrees(np.arctan2(across, np.sum(a * b, axis=1)))

    def yaw_error_deg(self, quats):
        """(n) unwrapped rotation about the vertical from truth to estimate."""
        off = product(np.asarray(quats), self.quat * (1, -1, -1, -1))
        return np.degrees(np.unwrap(2 * np.arctan2(off[:, 3], off[:, 0])))


def begin(t, at_s, over_s=0.5):
    """0 before at_s, 1 from over_s later on, smooth in between."""
    u = np.clip((t - at_s) / over_s, 0, 1)
    return u * u * (3 - 2 * u)


def by_hand(t, rest_s=4.0, deg=(50, 35, 70)):
    """Turned by hand in all directions after a rest."""
    k = begin(t, rest_s, 2.0)
    t = t - rest_s
    return (k * deg[0] * np.sin(1.9 * t), k * deg[1] * np.sin(2.3 * t + 1),
            k * deg[2] * np.sin(1.3 * t + 2))


def shaken(t, rest_s=4.0, metres=0.03):
    """What the hand's way to and fro adds, g."""
    u = t - rest_s
    return begin(t, rest_s, 1.0)[:, None] * metres / G * np.stack(
        [30 * np.sin(5.5 * u), 18 * np.sin(4.3 * u + 1), 25 * np.sin(5.0 * u + 2)], 1)

# SPDX-License-Identifier: MIT
"""Recordings with optical truth: read them, feed them as counts, measure a filter's tilt error.

The kinds of file are in tools.recording_formats. Without a folder the project's excerpts are used.

`python -m tools.recordings SOURCE OUT --start S --length S` cuts an excerpt.
"""

import argparse
from pathlib import Path

import numpy as np

from tools.recording_formats import read
from tools.virtual.chip import profiles

EXCERPTS = Path(__file__).parent / "data"
STANDARD_GRAVITY = 9.80665
GYRO_LSB_PER_DPS = dict(zip((250, 500, 1000, 2000), profiles.GYRO_LSB_PER_DPS))
ACCEL_LSB_PER_G = dict(zip((2, 4, 8, 16), profiles.ACCEL_LSB_PER_G))
GYRO_DPS = 2000  # the ranges that hold every recording
ACCEL_G = 16
KINDS = (".npz", ".mat", ".csv")


class Recording:
    """One trial. `gyro_dps`, `accel_g` (n x 3, as recorded); `up` (n x 3, true unit vector to the
    sky in sensor axes, NaN where unknown); `quat` (n x 4); `counted` (n, where errors count);
    `rate_hz`; `name`."""

    def __init__(self, name, rate_hz, accel_m_s2, gyro_rad_s, quat, movement):
        self.name = name
        self.rate_hz = float(rate_hz)
        self.accel_g = np.asarray(accel_m_s2, float) / STANDARD_GRAVITY
        self.gyro_dps = np.degrees(np.asarray(gyro_rad_s, float))
        self.quat = np.asarray(quat, float)
        self.up = up_from_quaternion(self.quat)
        self.counted = np.asarray(movement, bool).ravel() & ~np.isnan(self.up).any(axis=1)

    def __len__(self):
        return len(self.accel_g)

    def counts(self, gyro_dps=GYRO_DPS, accel_g=ACCEL_G):
        """(n x 7) int16 as the sensor's registers would hold: ax ay az temp gx gy gz."""
        out = np.zeros((len(self), 7), np.int16)
        out[:, :3] = _to_int16(self.accel_g * ACCEL_LSB_PER_G[accel_g])
        out[:, 3] = _to_int16((25.0 - 36.53) * 340.0)
        out[:, 4:] = _to_int16(self.gyro_dps * GYRO_LSB_PER_DPS[gyro_dps])
        return out

    def samples(self, gyro_dps=GYRO_DPS, accel_g=ACCEL_G):
        """(n x 6) float gx gy gz (dps) ax ay az (g), quantised like the counts."""
        counts = self.counts(gyro_dps, accel_g).astype(float)
        return np.hstack([counts[:, 4:] / GYRO_LSB_PER_DPS[gyro_dps],
                          counts[:, :3] / ACCEL_LSB_PER_G[accel_g]])

    def error_deg(self, up):
        """(n) angle between an estimated (n x 3) and the true up vector; NaN where unknown."""
        cross = np.linalg.norm(np.cross(up, self.up), axis=1)
        return np.degrees(np.arctan2(cross, np.sum(up * self.up, axis=1)))

    def rmse_deg(self, up):
        """Root mean square of error_deg over the samples that count."""
        return float(np.sqrt(np.mean(self.error_deg(up)[self.counted] ** 2)))

    def roll_pitch_deg(self):
        """(n), (n): the true angles."""
        return roll_pitch_deg(self.up)


def _to_int16(values):
    return np.clip(np.round(values), -32768, 32767).astype(np.int16)


def up_from_quaternion(quat):
    """(n x 3) earth's z axis in sensor axes, of (n x 4) sensor-to-earth quaternions."""
    w, x, y, z = np.asarray(quat, float).T
    up = np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z], 1)
    return up / np.linalg.norm(up, axis=1, keepdims=True)


def roll_pitch_deg(up):
    """Up vectors (n x 3) to angles in degrees, by the project's convention."""
    x, y, z = np.asarray(up, float).T
    return np.degrees(np.arctan2(y, z)), np.degrees(np.arctan2(-x, np.hypot(y, z)))


def up_from_roll_pitch(roll_deg, pitch_deg):
    """Angles in degrees to unit up vectors (n x 3)."""
    roll, pitch = np.radians(roll_deg), np.radians(pitch_deg)
    return np.stack([-np.sin(pitch), np.sin(roll) * np.cos(pitch),
                     np.cos(roll) * np.cos(pitch)], axis=-1)


def load(path):
    """One Recording; ValueError names what the file lacks."""
    return Recording(Path(path).stem, *read(path))


def files(folder=None):
    """The recordings' paths in a folder (default: the project's excerpts), sorted."""
    folder = Path(folder or EXCERPTS)
    found = sorted(path for kind in KINDS for path in folder.glob("*" + kind))
    if not found:
        raise FileNotFoundError(f"no {', '.join(KINDS)} recording in {folder}")
    return found


def cut(source, target, start_s, length_s):
    """Write an excerpt of a recording as npz, at the sensor's own resolution."""
    rec = load(source)
    piece = slice(round(start_s * rec.rate_hz), round((start_s + length_s) * rec.rate_hz))
    samples = rec.samples()[piece]
    np.savez_compressed(
        target,
        acc_m_s2=(samples[:, 3:] * STANDARD_GRAVITY).astype(np.float32),
        gyr_rad_s=np.radians(samples[:, :3]).astype(np.float32),
        quat_wxyz=(np.round(rec.quat[piece] * 16384) / 16384).astype(np.float32),
        movement=rec.counted[piece],
        rate_hz=rec.rate_hz,
    )


def main():
    parser = argparse.ArgumentParser(description="Cut an excerpt of a recording.")
    parser.add_argument("source")
    parser.add_argument("target")
    parser.add_argument("--start", type=float, default=0.0, help="s")
    parser.add_argument("--length", type=float, default=60.0, help="s")
    args = parser.parse_args()
    cut(args.source, args.target, args.start, args.length)


if __name__ == "__main__":
    main()

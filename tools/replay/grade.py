# SPDX-License-Identifier: MIT
"""How far angles are from the truth, or from the best hindsight where nobody knows the truth.

The best hindsight is an acausal smoother, vqf.offlineVQF: it knows the whole recording, its end
too. It has the gyro's scale as Attitude, in double precision, has learned it at that end, and
nothing else of that filter: it is no judge that leans towards one.
A board's angle is for the moment at which it is read, and its samples are lag_s old; so the
smoother's attitude is taken that much later.
"""

from itertools import pairwise

import numpy as np
from attitude import Attitude
from vqf import offlineVQF

from tools.recordings import STANDARD_GRAVITY, up_from_quaternion, up_from_roll_pitch

SETTLE_S = 3.0  # of a recording without truth: until a filter that knew nothing has found itself


def hindsight(track):
    """(n x 3) the vertical in the robot's frame at each sample's instant of reading.

    A gap ends what the smoother knows: each stretch by itself.
    """
    gyro, accel = track.units()
    ends = [0, *(track.gaps + 1), len(track)]
    up = np.full((len(track), 3), np.nan)
    for begin, end in pairwise(ends):
        if end - begin < 2 * SETTLE_S * track.rate_hz:
            continue
        true = gyro[begin:end] @ learned_matrix(track, gyro[begin:end], accel[begin:end]).T
        up[begin:end] = smoothed(track, true, accel[begin:end])
    return up


def smoothed(track, gyro, accel):
    """(n x 3) the vertical by the smoother, from rates in deg/s and forces in g without a gap."""
    found = offlineVQF(
        np.ascontiguousarray(np.radians(gyro)),
        np.ascontiguousarray(accel * STANDARD_GRAVITY),
        None, 1.0 / track.rate_hz,
    )  # fmt: skip
    return _later(up_from_quaternion(found["quat6D"]), track.lag_s * track.rate_hz)


def learned_matrix(track, gyro, accel):
    """(3 x 3) what makes the gyro's rates true, as learned from all of these samples (n x 3, deg/s
    and g): scale and cross-axis."""
    filt = Attitude(
        track.rate_hz,
        gyro_range_dps=track.settings["gyro_dps"],
        accel_range_g=track.settings["accel_g"],
    )
    for row in np.hstack((gyro, accel)).tolist():
        filt.update(*row)
    return np.array(filt.calibration_learned()).reshape(3, 3)


def _later(up, samples):
    """What it is so many samples later (0 to 100, not whole)."""
    whole = int(samples)
    part = samples - whole
    padded = np.concatenate([up, np.repeat(up[-1:], whole + 1, axis=0)])
    n = len(up)
    mixed = padded[whole : whole + n] * (1 - part) + padded[whole + 1 : whole + 1 + n] * part
    return mixed / np.linalg.norm(mixed, axis=1, keepdims=True)


def reference(track):
    """(up, counted, "truth" or "hindsight"): what to compare with, and where."""
    if track.up is not None:
        return track.up, track.counted, "truth"
    up = hindsight(track)
    counted = ~np.isnan(up).any(axis=1)
    counted[: int(SETTLE_S * track.rate_hz)] = False
    return up, counted, "hindsight"


def errors_deg(angles_deg, up):
    """(n) angle between the vertical of roll and pitch and the true one."""
    own = up_from_roll_pitch(angles_deg[:, 0], angles_deg[:, 1])
    cross = np.linalg.norm(np.cross(own, up), axis=1)
    return np.degrees(np.arctan2(cross, np.sum(own * up, axis=1)))


def rms_deg(angles_deg, up, counted):
    """Root mean square of it over the samples that count. ValueError when there are none."""
    if not counted.any():
        raise ValueError("too short to be graded, or nothing known of it")
    return float(np.sqrt(np.mean(errors_deg(angles_deg, up)[counted] ** 2)))

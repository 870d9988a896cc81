# SPDX-License-Identifier: MIT
"""The sensor's noise at rest: Allan deviation, white noise, bias instability.

Terms as in IEEE Std 952: the angle random walk is the deviation at one second of the part that
falls with the square root of time; the bias instability its least value divided by 0.664.
"""

import numpy as np

STILL_DPS = 3.0  # peak to peak in half a second: knob still_dps
BLOCK_S = 0.5
LEAST_S = 10.0
PER_OCTAVE = 3


def allan(rate, hz):
    """(taus in s, overlapping Allan deviation) of samples of a rate, in its unit."""
    theta = np.concatenate([[0.0], np.cumsum(rate)]) / hz
    longest = len(rate) // 5
    sizes = np.unique(np.round(2.0 ** np.arange(0, np.log2(max(longest, 2)), 1 / PER_OCTAVE)))
    sizes = sizes.astype(int)
    deviations = []
    for m in sizes:
        second = theta[2 * m :] - 2 * theta[m:-m] + theta[: -2 * m]
        deviations.append(np.sqrt(np.mean(second**2) / 2) / (m / hz))
    return sizes / hz, np.array(deviations)


def figures(rate, hz):
    """{"white": per root Hz, "instability", "at_s", "mean"} of one axis, in its unit."""
    taus, deviation = allan(rate, hz)
    short = taus <= max(1.0, 4 * taus[0])
    white = float(np.median(deviation[short] * np.sqrt(taus[short])))
    least = int(np.argmin(deviation))
    return {
        "white": white,
        "instability": float(deviation[least]) / 0.664,
        "at_s": float(taus[least]),
        "mean": float(np.mean(rate)),
    }


def rest(track):
    """The longest time at rest, a slice; None when there is none of LEAST_S."""
    size = int(BLOCK_S * track.rate_hz)
    gyro = track.units()[0]
    blocks = gyro[: len(gyro) // size * size].reshape(-1, size, 3)
    still = (np.ptp(blocks, axis=1) < STILL_DPS).all(axis=1)
    for gap in track.gaps:
        still[min(gap // size, len(still) - 1)] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    if not len(edges):
        return None
    begins, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - begins))
    begin, end = int(begins[longest]) * size, int(ends[longest]) * size
    return slice(begin, end) if end - begin >= LEAST_S * track.rate_hz else None


def at_rest(track):
    """{"raw"|"used": {"gyro"|"accel": [three axes' figures]}, "seconds"}, or None: no rest.

    raw: as the registers had it; used: calibrated, in the robot's frame.
    """
    piece = rest(track)
    if piece is None:
        return None
    still = track.part(piece)
    bare = track.part(piece)
    bare.calibration = {}
    out = {"seconds": len(still) / track.rate_hz}
    for name, which in (("raw", bare), ("used", still)):
        gyro, accel = which.units()
        out[name] = {
            "gyro_dps": [figures(axis, track.rate_hz) for axis in gyro.T],
            "accel_g": [figures(axis, track.rate_hz) for axis in accel.T],
        }
    return out

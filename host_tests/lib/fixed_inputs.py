# SPDX-License-Identifier: MIT
"""Inputs for the integer filters' tests: recorded, and what no sensor should ever give."""

import math
import random

from tools import recordings

LOW, HIGH = -32768, 32767


class Skewed:
    """A calibration at the datasheet's worst, mounted on a cube's diagonal (re-typed numbers)."""

    gyro_bias_dps = (20.0, -20.0, 20.0)
    accel_bias_g = (0.08, -0.05, 0.08)
    # a third of a turn about (1, 1, 1) and 35 degrees about z, 3 % scale, 2 % cross-axis
    gyro_matrix = (-0.5743, 0.02, 0.8437, 0.8437, 0.02, 0.5907, 0.02, 1.03, -0.02)
    accel_matrix = (-0.5743, 0.02, 0.8437, 0.8437, 0.02, 0.5907, 0.02, 1.03, -0.02)


def recorded(name, start_s, length_s, gyro_dps=2000, accel_g=16):
    """Rows of seven counts of one of the project's excerpts, and their rate in Hz."""
    rec = recordings.load(recordings.EXCERPTS / (name + ".npz"))
    first = int(start_s * rec.rate_hz)
    rows = rec.counts(gyro_dps, accel_g)[first : first + int(length_s * rec.rate_hz)]
    return rows.tolist(), rec.rate_hz


def _corners(rng, n):
    return [[rng.choice((LOW, HIGH, 0)) for _ in range(7)] for _ in range(n)]


def _noise(rng, n):
    return [[rng.randint(LOW, HIGH) for _ in range(7)] for _ in range(n)]


def _square(rng, n):
    """All of full scale, turning its sign at random: steps and the worst for a loop's states."""
    half = rng.choice((1, 7, 60, 400))
    return [[(HIGH, LOW)[i // half % 2]] * 7 for i in range(n)]


def _spin(rng, n):
    """Full rate on all axes while gravity stands still: the attitude loop is always wrong."""
    rates = [rng.choice((LOW + 20, HIGH - 20)) for _ in range(3)]
    return [[0, 0, 32700, 0, *rates]] * n


def _pushed(rng, n):
    """As much level acceleration as passes for unsaturated."""
    half = rng.choice((50, 300, 700))
    return [[(32730, -32730)[i // half % 2], 32730, 32730, 0, 0, 0, 0] for i in range(n)]


def _creep(rng, n):
    """A rate that grows so slowly that each moment looks like rest."""
    return [[0, 0, 16384, 0, 0, 0, min(HIGH, i * 3)] for i in range(n)]


def _dead(rng, n):
    """Rest, then nothing at all, then upside down."""
    still = [[0, 0, 8192, 0, 5, -5, 5]] * (n // 3)
    return still + [[0] * 7] * (n // 3) + [[0, 0, LOW, 0, 0, 0, 0]] * (n // 3)


def _tumble(rng, n):
    """A vector of half full scale that turns, and rates that fit nothing."""
    rows = []
    for i in range(n):
        c, s = math.cos(i * 0.11), math.sin(i * 0.11)
        a, b = int(16000 * c), int(16000 * s)
        rows.append([a, b, -a, 0, b * 2, -b * 2, a * 2])
    return rows


KINDS = {
    "corners": _corners,
    "noise": _noise,
    "square": _square,
    "spin": _spin,
    "pushed": _pushed,
    "creep": _creep,
    "dead": _dead,
    "tumble": _tumble,
}


def adversarial(kind, n, seed=0):
    """n rows of seven counts of one of KINDS."""
    return KINDS[kind](random.Random(seed), n)

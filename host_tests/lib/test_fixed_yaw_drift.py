# SPDX-License-Identifier: MIT
"""Yaw over an hour with a perfect gyro: what integers cut off must not pile up in it.

Nothing tells of yaw but the gyro, so the least bias that rounding makes stays there. MicroPython's
unix port runs it, 900,000 samples in three seconds.
"""

import math
import subprocess

import numpy as np
import pytest

from host_tests.lib.filter_rig import matrix, product, quaternion
from tools.virtual import images
from tools.virtual.rp2040.flash import ROOT

RATE_HZ, PERIOD_S = 250, 20
PROGRAM = """
import sys
sys.path[:] = [%r]
from array import array
import micropython
from attitude.fixed import Attitude

BURSTS = array("h", %s)

@micropython.viper
def put(counts: ptr16, table: ptr16, at: int, seed: int, noise: int) -> int:
    # sums of four uniform numbers on top: 10 counts RMS of a force, 2 of a rate
    n = 0
    while n < 7:
        total = 0
        if noise:
            wide = 17 if n < 3 else 3
            k = 0
            while k < 4:
                seed = (seed * 1103 + 12345) & 0xFFFFF
                total += (seed >> 5) %% wide
                k += 1
            total -= 2 * (wide - 1)
        counts[n] = int(table[at + n]) + total
        n += 1
    return seed

f, c, seed = Attitude(%d, lag_s=0.0), array("h", [0] * 7), 1
for _ in range(6):
    last = f.yaw_mdeg
    for _ in range(30):
        for at in range(0, len(BURSTS), 7):
            seed = put(c, BURSTS, at, seed, %d)
            f.step(c)
    print((f.yaw_mdeg - last + 540000) %% 360000 - 180000)
"""


def attitude(t_s):
    turn = 2 * math.pi * t_s
    return quaternion(40 * math.sin(turn / 4), 15 * math.sin(turn / 2.5), 30 * math.sin(turn / 5))


def bursts():
    """A period of a motion that comes back to where it began, as counts. Noise is added on the
    way: the same one in each period would be a fault of the sensor, which is learned.
    """
    n, h, words = PERIOD_S * RATE_HZ, 1e-4, []
    for t in np.arange(n) / RATE_HZ:
        w, x, y, z = attitude(t - h)
        turned = product((w, -x, -y, -z), attitude(t + h))
        words.append([*(4096 * matrix(attitude(t))[2]), 0, *(65.5 * np.degrees(turned[1:] / h))])
    return np.round(np.array(words)).astype(int).ravel().tolist()


@pytest.mark.parametrize("noise", (0, 1))
def test_yaw_drifts_no_more_than_the_algorithm_does(noise, tmp_path):
    script = tmp_path / "drift.py"
    script.write_text(PROGRAM % (str(ROOT / "lib"), bursts(), RATE_HZ, noise))
    command = [str(images.unix_micropython()), "-X", "heapsize=16M", str(script)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert not done.returncode, done.stderr + done.stdout
    drift = [int(line) / 1000 / 600 for line in done.stdout.split()]
    assert len(drift) == 6
    assert max(map(abs, drift)) < 0.0015

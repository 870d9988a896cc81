# SPDX-License-Identifier: MIT
"""One consistent estimate, for whoever asks at the REPL or in a loop of one's own."""

from collections import namedtuple

from micropython import const

_WRAP = const(0x3FFFFFFF)

# All of one tick, in the robot's frame. t_us: ticks_us() of that tick; rates_dps, accel_g:
# (x, y, z), gravity in it; age_us since the last good sample.
Sample = namedtuple(
    "Sample",
    (
        "t_us",
        "roll_deg",
        "pitch_deg",
        "yaw_deg",
        "rates_dps",
        "accel_g",
        "at_rest",
        "age_us",
        "uncertain",
        "stale",
    ),
)


def make(words, lsb_per_g, age_us, stale):
    """The Sample of a copy of firmware.tick.estimate's words."""
    return Sample(
        words[1] & _WRAP,
        words[2] / 1000,
        words[3] / 1000,
        words[4] / 1000,
        tuple([v / 1000 for v in words[5:8]]),
        tuple([v / lsb_per_g for v in words[8:11]]),
        words[11] != 0,
        age_us,
        words[12] != 0 and not stale,
        stale,
    )

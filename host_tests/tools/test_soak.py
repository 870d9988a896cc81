# SPDX-License-Identifier: MIT
"""Two hours of the integer path on MicroPython itself; `python -m tools.soak` runs a day."""

from tools import soak


def test_two_hours_without_drift_a_byte_or_a_lost_tick():
    result = soak.run(2, say=lambda line: None)
    _settle, first, second = result["hours"]
    # hour, mean and largest error in mdeg, yaw, bytes, wraps so far, rejected, wrong
    assert result["samples"] == result["ticks"] == (2 * 3600 + 60) * 250
    assert (result["lost"], result["skipped"]) == (0, 0)
    assert [row[4] for row in result["hours"]] == [0, 0, 0]
    assert second[5] == 1 + (7260 - 5) * 1_000_000 // (1 << 30)  # begins 5 s before a wrap
    assert second[6:] == [0, 0]
    assert second[2] < 600 and second[1] <= first[1] + 5

# SPDX-License-Identifier: MIT
"""One time axis over unpluggings and resets: what comes after one is put where the PC's clock says
that it belongs."""

import time

LEAST_US = 1000  # of a gap whose length nobody knows


class Joiner:
    """numbers and times of batches, continued. clock(): seconds, of the PC."""

    def __init__(self, clock=time.monotonic):
        self._clock = clock
        self._last = None  # number, t_us as joined, and the board's own; the PC's seconds
        self._shift = 0, 0

    def join(self, batch):
        """(number, t_us, anew): arrays that go on from the batch before; anew: whether the board,
        or its stream, began anew in between."""
        number, t_us, anew = batch.number, batch.t_us, False
        if self._last is not None:
            old_number, old_us, was_number, was_us, at = self._last
            anew = int(number[0]) <= was_number or int(t_us[0]) <= was_us
            if anew:
                away_us = max(LEAST_US, round((self._clock() - at) * 1e6))
                period_us = batch.header["period_us"] * batch.header["every"]
                missing = max(1, round(away_us / period_us) - len(number))
                self._shift = (
                    old_number + missing + 1 - int(number[0]),
                    old_us + (missing + 1) * period_us - int(t_us[0]),
                )
        joined, times = number + self._shift[0], t_us + self._shift[1]
        self._last = (
            int(joined[-1]), int(times[-1]), int(number[-1]), int(t_us[-1]), self._clock(),
        )  # fmt: skip
        return joined, times, anew

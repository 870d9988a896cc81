# SPDX-License-Identifier: MIT
"""Second-order filters of raw counts, to stand between the sensor and a filter.

    notch = Notch(center_hz=120, rate_hz=1000)
    notch.update(imu.counts)
    attitude.update(notch.counts)

The form is the trapezoidal state-variable filter (A. Simper, Cytomic, 2011): unlike the direct
forms it keeps its accuracy in 32 bits at any cutoff, and may be retuned while it runs.
"""

from array import array
from math import pi, tan

import micropython
from micropython import const

# Q15 but for the first: g = tan(pi f / rate) and k = 1 / quality make a1 = 1 / (1 + g (g + k)),
# a2 = g a1, a3 = g a2. a1 is at most 1; a2 and a3 are kept below it by g <= 1 (f <= rate / 4)
_A1 = const(0)
_A2 = const(1)
_A3 = const(2)
_K = const(3)  # Q14
_STARTED = const(4)
_STATE = const(5)  # two for each of six channels, counts Q12
_SIZE = const(17)


class _Biquad:
    """Filters accelerometer and gyro of `counts`; the result is in its own `.counts`."""

    def __init__(self, hz, rate_hz, quality):
        self.rate_hz = rate_hz
        self._s = array("i", [0] * _SIZE)
        self.counts = array("h", [0] * 7)
        self.tune(hz, quality)

    def tune(self, hz, quality):
        """Change the frequency, 0.001 to 0.25 of the rate, and the quality, 0.5 to 20 (floats)."""
        if not 0.001 * self.rate_hz <= hz <= 0.25 * self.rate_hz:
            raise ValueError("%s Hz: must be 0.001 to 0.25 of the rate" % hz)
        if not 0.5 <= quality <= 20:
            raise ValueError("quality %s: must be 0.5 to 20" % quality)
        g = tan(pi * hz / self.rate_hz)
        k = 1.0 / quality
        a1 = 1.0 / (1.0 + g * (g + k))
        self._s[_A1] = int(32768.0 * a1)
        self._s[_A2] = int(32768.0 * a1 * g + 0.5)
        self._s[_A3] = int(32768.0 * a1 * g * g + 0.5)
        self._s[_K] = int(16384.0 * k + 0.5)

    def reset(self):
        """The next sample is taken as if it had lasted for ever."""
        self._s[_STARTED] = 0

    def state(self):
        """What set_state() takes to continue here: a tuple of integers."""
        return tuple(self._s[_STARTED:])

    def set_state(self, state):
        """Continue from a state()."""
        for i, value in enumerate(state):
            self._s[_STARTED + i] = value

# SPDX-License-Identifier: MIT
"""Second-order filters of raw counts, to stand between the sensor and a filter.

    notch = Notch(center_hz=120, rate_hz=1000)
    notch.update(imu.counts)
    attitude.update(notch.counts)

The form is the trapezoidal state-variable filter (A. Simper, Cytomic, 2011): unlike the direct
forms it keeps its accuracy in 32 bits at any cutoff, and may be retuned while it runs.
"""

from array import array
from math import atan, pi, tan

import micropython
from micropython import const

# g = tan(pi f / rate), k = 1 / quality, a1 = 1 / (1 + g (g + k)), all Q15; g is at most 1
_G = const(0)
_K = const(1)
_A1 = const(2)
_LOW = const(3)  # 1: low-pass, 0: notch
_SLEW = const(4)  # change of g for a sample when the notch follows, else 0; g here is Q25
_G_MIN = const(5)
_G_MAX = const(6)
_STARTED = const(7)  # state from here on
_G_FINE = const(8)  # Q25
_FIRST = const(9)  # two for each of six channels, counts Q8
_LAST = const(21)  # what the notch last left of the accelerometer's three
_SIZE = const(24)


class _Biquad:
    """Filters accelerometer and gyro of `counts` alike; the result is in its own `.counts`."""

    _low = 0

    def __init__(self, hz, rate_hz, quality):
        self.rate_hz = rate_hz
        self._s = array("i", [0] * _SIZE)
        self._s[_LOW] = self._low
        self.counts = array("h", [0] * 7)
        self.tune(hz, quality)

    def tune(self, hz, quality):
        """Change the frequency, 0.002 to 0.25 of the rate, and the quality, 0.5 to 20."""
        if not 0.5 <= quality <= 20:
            raise ValueError("quality %s: must be 0.5 to 20" % quality)
        s = self._s
        g = self._g_of(hz)
        s[_G] = int(32768.0 * g + 0.5)
        s[_G_FINE] = s[_G] << 10
        s[_K] = int(32768.0 / quality + 0.5)
        s[_A1] = (1 << 30) // (32768 + (s[_G] * (s[_G] + s[_K]) >> 15))

    def _g_of(self, hz):
        if not 0.002 * self.rate_hz <= hz <= 0.25 * self.rate_hz:
            raise ValueError("%s Hz: must be 0.002 to 0.25 of the rate" % hz)
        return tan(pi * hz / self.rate_hz)

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

    @micropython.viper
    def update(self, counts: ptr16):
        """Filter one sample, ax ay az temp gx gy gz (int16), into .counts."""
        s = ptr32(self._s)
        out = ptr16(self.counts)
        g = s[_G]
        k = s[_K]
        low = s[_LOW]
        started = s[_STARTED]
        out[3] = counts[3]
        total = 0
        n = 0
        i = 0
        while i < 7:
            x = ((int(counts[i]) ^ 0x8000) - 0x8000) << 8
            v = 0
            w = x
            if started:
                v = s[_FIRST + n]
                w = s[_FIRST + n + 1]
            # band-pass b = a1 (v + g (x - w)), low-pass l = w + g b
            t = x - w
            t = v + (t >> 15) * g + ((t & 0x7FFF) * g + 16384 >> 15)
            b = (t >> 15) * s[_A1] + ((t & 0x7FFF) * s[_A1] + 16384 >> 15)
            t = w + (b >> 15) * g + ((b & 0x7FFF) * g + 16384 >> 15)
            s[_FIRST + n] = (b << 1) - v
            s[_FIRST + n + 1] = (t << 1) - w
            if low == 0:
                t = x - (b >> 15) * k - ((b & 0x7FFF) * k + 16384 >> 15)
                if i < 3 and s[_SLEW]:
                    total += (s[_LAST + i] - t >> 12) * (b >> 13)
                    s[_LAST + i] = t
            t = t + 128 >> 8
            if t > 32767:
                t = 32767
            elif t < -32768:
                t = -32768
            out[i] = t & 0xFFFF
            n += 2
            i += 1
            if i == 3:
                i = 4
        s[_STARTED] = 1
        t = s[_SLEW]
        if t:
            # what is left runs against the band-pass's slope above the notch, with it below
            t = s[_G_FINE] + (t if total > 0 else 0 - t)
            if t > s[_G_MAX]:
                t = s[_G_MAX]
            elif t < s[_G_MIN]:
                t = s[_G_MIN]
            s[_G_FINE] = t
            g = t >> 10
            s[_G] = g
            t = 32768 + (g * (g + k) >> 15)
            s[_A1] = ((1 << 29) // t) << 1


class LowPass(_Biquad):
    """Second-order low-pass at hz; quality 0.707 is Butterworth's.

    Its delay, 1 / (4.4 hz) s, adds to the sensor's: tell it to Attitude as part of lag_s.
    """

    _low = 1

    def __init__(self, hz, rate_hz, quality=0.7071):
        super().__init__(hz, rate_hz, quality)


class Notch(_Biquad):
    """Takes out one frequency, hz, and about hz / quality around it; all else passes."""

    def __init__(self, hz, rate_hz, quality=3.0):
        super().__init__(hz, rate_hz, quality)


class AdaptiveNotch(_Biquad):
    """A notch that follows the strongest vibration of the accelerometer, from min_hz to max_hz.

    slew_hz_s: how fast it follows; it starts in the middle. max_hz at most 0.25 of the rate; of
    a vibration beyond half the rate it finds the alias.
    """

    def __init__(self, min_hz, max_hz, rate_hz, quality=2.0, slew_hz_s=50.0):
        super().__init__(0.5 * (min_hz + max_hz), rate_hz, quality)
        s = self._s
        low, high = self._g_of(min_hz), self._g_of(max_hz)
        s[_G_MIN] = int(low * 33554432.0)
        s[_G_MAX] = int(high * 33554432.0)
        s[_SLEW] = int((high - low) / (max_hz - min_hz) * slew_hz_s / rate_hz * 33554432.0) + 1

    @property
    def hz(self):
        """Where the notch stands, Hz (makes a float)."""
        return atan(self._s[_G] / 32768.0) * self.rate_hz / pi

# SPDX-License-Identifier: MIT
"""Integer PID for the running loop: viper, no allocation.

Integers in and out, each in a unit of the caller's choice (millidegrees, counts, permille,
microseconds). Gains are given as for the float classes, in output units per input unit, and
seconds; they become integers once, for the loop's rate.

Format of a gain: g (15 bits and sign) with two shifts: a product is ((x << left) * g >> 15)
rounded >> right. It is made of two 15-bit halves because viper has no high word. The
constructors refuse a gain for which something could leave int32: |x << left| < 2^30 and each
term < 2^28, so the sum of the three and of the limit is < 2^30; |x| < 2^23 leaves room for the
6 bits that the low-passed rate keeps, also in a difference.
"""

from array import array

import micropython
from micropython import const

_FRACTION = const(10)  # bits below the output's unit that the integral keeps


def encode(gain, x_max):
    """(g, left, right) of a gain for |inputs| up to x_max; ValueError where int32 is too small."""
    exponent, size = 0, abs(gain)
    while size >= 1.0:
        size *= 0.5
        exponent += 1
    while 0.0 < size < 0.5 and exponent > -15:
        size *= 2.0
        exponent -= 1
    left, right = max(exponent, 0), max(-exponent, 0)
    if x_max >= 1 << 23 or x_max << left >= 1 << 30 or abs(gain) * x_max >= 1 << 28:
        raise ValueError("gain %s too large for inputs of %d" % (gain, x_max))
    g = min(32767, round(size * 32768))
    return (g if gain >= 0 else -g), left, right


def lag(tau_s, rate_hz):
    """Weight in 1/32768 of a new sample in a low-pass of this time constant."""
    return max(1, min(32768, round(32768 / (tau_s * rate_hz + 1.0))))


def output_range(limit):
    low, high = (-limit, limit) if isinstance(limit, int) else limit
    if not -(1 << 18) < low < high < 1 << 18:
        raise ValueError("limit (%s, %s): low below high, both within 18 bits" % (low, high))
    return low, high


def put_gains(coef, at, kp, ki, kd, rate_hz, x_max):
    """Write the gains of one axis into its 16 words; ki per second, kd in seconds."""
    terms = (
        encode(kp, x_max) + encode(ki / rate_hz * (1 << _FRACTION), x_max) + encode(kd, x_max)
    )
    for k in range(9):
        coef[at + k] = terms[k]
    coef[at + 12] = x_max


# One axis has 16 words of coefficients: kp, ki, kd as (g, left, right) each, 9 weight of the
# derivative's low-pass, 10 low, 11 high, 12 the largest input, 13..15 the cascade's outer gain
# (g, left, right); and 4 words of state: 0 integral << 10, 1 low-passed rate << 6, 2 last rate.
@micropython.viper
def steps(n: int, coef: ptr32, state: ptr32, error: ptr32, rate: ptr32, out: ptr32):
    """One step for n axes: out = kp error + integral - kd rate, each within its limits."""
    axis = 0
    while axis < n:
        c = axis << 4
        s = axis << 2
        top = int(coef[c + 12])
        e = int(error[axis])
        if e > top:
            e = top
        elif e < 0 - top:
            e = 0 - top
        v = int(rate[axis])
        if v > top:
            v = top
        elif v < 0 - top:
            v = 0 - top

        d = int(state[s + 1])
        w = int(coef[c + 9])
        x = (v << 6) - d
        d += (x >> 15) * w + (((x & 0x7FFF) * w) >> 15)
        state[s + 1] = d

        g = int(coef[c])
        x = e << int(coef[c + 1])
        r = int(coef[c + 2])
        p = ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + ((1 << r) >> 1)) >> r
        g = int(coef[c + 6])
        x = ((d + 32) >> 6) << int(coef[c + 7])
        r = int(coef[c + 8])
        p -= ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + ((1 << r) >> 1)) >> r
        g = int(coef[c + 3])
        x = e << int(coef[c + 4])
        r = int(coef[c + 5])
        i = ((x >> 15) * g + (((x & 0x7FFF) * g) >> 15) + ((1 << r) >> 1)) >> r

        low = int(coef[c + 10])
        high = int(coef[c + 11])
        old = int(state[s])
        new = old + i
        if new > high << 10:
            new = high << 10
        elif new < low << 10:
            new = low << 10
        u = p + (new >> 10)
        if u > high:  # at the limit the integral may only move back: no wind-up
            u = high
            if i > 0:
                new = old
        elif u < low:
            u = low
            if i < 0:
                new = old
        state[s] = new
        out[axis] = u
        axis += 1


class PID:
    """One integer PID at a fixed rate; see control.PID for the law.

    input_max: the largest error and rate that can occur (larger ones are clipped).
    """

    def __init__(self, kp, ki, kd, limit, rate_hz=250, input_max=180000, tau_d_s=0.0):
        self._rate_hz = rate_hz
        self._gains = (kp, ki, kd)
        self._coef = array("i", [0] * 16)
        put_gains(self._coef, 0, kp, ki, kd, rate_hz, input_max)
        self._coef[9] = lag(tau_d_s, rate_hz)
        self._coef[10], self._coef[11] = output_range(limit)
        self._state = array("i", [0] * 4)
        self._error = array("i", [0])
        self._rate = array("i", [0])
        self._out = array("i", [0])

    def reset(self, output=0):
        """Forget the past; zero error then gives this output."""
        low, high = self._coef[10], self._coef[11]
        self._state[0] = min(max(output, low), high) << _FRACTION
        self._state[1] = 0
        self._error[0] = 0

    def tune(self, kp=None, ki=None, kd=None):
        """New gains without a jump of the output, as control.PID.tune; not for the tick."""
        old_kp, old_ki, old_kd = self._gains
        kp = old_kp if kp is None else kp
        ki = old_ki if ki is None else ki
        kd = old_kd if kd is None else kd
        put_gains(self._coef, 0, kp, ki, kd, self._rate_hz, self._coef[12])
        if ki != 0:
            rate = self._state[1] / 64
            jump = (old_kp - kp) * self._error[0] + (kd - old_kd) * rate
            low, high = self._coef[10] << _FRACTION, self._coef[11] << _FRACTION
            moved = self._state[0] + round(jump * (1 << _FRACTION))
            self._state[0] = min(max(moved, low), high)
        self._gains = (kp, ki, kd)

    @micropython.native
    def update(self, error, rate=0):
        """One step -> output; error = target - measurement, rate = the measurement's (gyro)."""
        self._error[0] = error
        self._rate[0] = rate
        steps(1, self._coef, self._state, self._error, self._rate, self._out)
        return self._out[0]

# SPDX-License-Identifier: MIT
"""From physical units to the chip's filtered samples: imperfections, noise, saturation, DLPF.

The low-pass of each row of the datasheet's table is a first-order section with the row's -3 dB
point behind a pure delay that makes the group delay at 5 Hz the row's. That is the reading under
which bandwidths and delays of the table agree: first-order sections alone have 3.6, 7.2 and
12.7 ms at 44, 21 and 10 Hz, and the table has 1.1 to 1.3 ms more in each of these rows.
"""

import math
from collections import deque
from functools import cache

import numpy as np

_HISTORY = 64  # samples; the longest delay of a clone is 51 ms
_BLOCK = 2048
_DELAY_AT_HZ = 5.0


@cache
def design(bandwidth_hz, delay_s, rate_hz):
    """(alpha, whole, part) of y += alpha (x[n - whole - part] - y) for one row of the table.

    `part` is a fraction of a sample by linear interpolation, whose own loss is allowed for.
    """
    if bandwidth_hz >= rate_hz / 2:
        alpha = 1.0
        whole, part = divmod((delay_s or 0.0) * rate_hz, 1.0)
        return alpha, min(int(whole), _HISTORY - 2), part
    lag = 0.0
    for _ in range(20):
        part = lag % 1.0
        alpha = _alpha(
            bandwidth_hz / rate_hz, math.sqrt(0.5) / _loss(part, bandwidth_hz / rate_hz)
        )
        if delay_s is None:
            break
        lag = max(0.0, delay_s * rate_hz - _group_delay(alpha, _DELAY_AT_HZ / rate_hz))
    whole, part = divmod(lag, 1.0)
    return alpha, int(whole), part


def _loss(part, frequency):
    """Gain of linear interpolation at `frequency` (cycles per sample)."""
    w = 2 * math.pi * frequency
    return math.hypot(1 - part + part * math.cos(w), part * math.sin(w))


def _alpha(frequency, gain):
    """The alpha whose first-order section has `gain` at `frequency` (cycles per sample)."""
    low, high = 0.0, 1.0
    cosine = math.cos(2 * math.pi * frequency)
    for _ in range(60):
        alpha = (low + high) / 2
        b = 1 - alpha
        if alpha / math.sqrt(1 + b * b - 2 * b * cosine) < gain:
            low = alpha
        else:
            high = alpha
    return high


def _group_delay(alpha, frequency):
    """Group delay in samples of the first-order section at `frequency` (cycles per sample)."""
    b = 1 - alpha
    cosine = math.cos(2 * math.pi * frequency)
    return b * (cosine - b) / (1 + b * b - 2 * b * cosine)


class Triad:
    """Three axes of one sensor: measured = matrix true + bias + noise, clipped, filtered.

    `bias` and `slope` (per degC from 25) are in the sensor's unit, `matrix` is three rows or None
    for a perfect one; `density`, set later, is the unit per square root of a hertz.
    """

    def __init__(self, bias, slope, matrix, generator):
        self.bias = tuple(float(b) for b in bias)
        self.slope = tuple(float(s) for s in slope)
        self.matrix = None if matrix is None else tuple(float(v) for row in matrix for v in row)
        self.density = 0.0
        self.added = (0.0, 0.0, 0.0)  # self-test response, or a fault's overload
        self.value = (0.0, 0.0, 0.0)  # filtered
        self.limit = 1.0
        self._generator = generator
        self._noise = []
        self._sigma = 0.0
        self._history = deque([(0.0, 0.0, 0.0)] * _HISTORY, maxlen=_HISTORY)
        self._filter = (1.0, 0, 0.0)
        self._empty = True
        self._drifts = any(self.slope)
        self._offset = self.bias

    def set_filter(self, coefficients, rate_hz, limit):
        """Filter of design(), its sample rate (for the noise), and saturation in the unit."""
        self._filter = coefficients
        self.limit = limit
        sigma = self.density * math.sqrt(rate_hz / 2)
        if sigma != self._sigma:
            self._sigma = sigma
            self._noise = []
        self._offset = tuple(b + a for b, a in zip(self.bias, self.added))

    def restart(self):
        """Forget the past: the next sample fills the filter."""
        self._empty = True

    def zero(self):
        """As after a reset: output zero and nothing in the filter."""
        self._empty = True
        self.value = (0.0, 0.0, 0.0)

    def step(self, x, y, z, temp_c):
        """Take one true sample; the filtered one is in `value`."""
        m = self.matrix
        if m is not None:
            x, y, z = (
                m[0] * x + m[1] * y + m[2] * z,
                m[3] * x + m[4] * y + m[5] * z,
                m[6] * x + m[7] * y + m[8] * z,
            )
        bx, by, bz = self._offset
        if self._drifts:
            warm = temp_c - 25.0
            sx, sy, sz = self.slope
            bx += sx * warm
            by += sy * warm
            bz += sz * warm
        if self._sigma:
            if not self._noise:
                self._refill()
            nx, ny, nz = self._noise.pop()
            x += nx
            y += ny
            z += nz
        x += bx
        y += by
        z += bz
        limit = self.limit
        if not (-limit < x < limit and -limit < y < limit and -limit < z < limit):
            x = min(max(x, -limit), limit)
            y = min(max(y, -limit), limit)
            z = min(max(z, -limit), limit)
        history = self._history
        history.appendleft((x, y, z))
        if self._empty:
            self._empty = False
            history.extendleft([(x, y, z)] * (_HISTORY - 1))
            self.value = (x, y, z)
            return
        alpha, whole, part = self._filter
        ux, uy, uz = history[whole]
        if part:
            vx, vy, vz = history[whole + 1]
            ux += part * (vx - ux)
            uy += part * (vy - uy)
            uz += part * (vz - uz)
        x, y, z = self.value
        self.value = (x + alpha * (ux - x), y + alpha * (uy - y), z + alpha * (uz - z))

    def _refill(self):
        block = self._generator.standard_normal((_BLOCK, 3))
        self._noise = np.multiply(block, self._sigma, out=block).tolist()

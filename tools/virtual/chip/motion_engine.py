# SPDX-License-Identifier: MIT
"""The motion interrupt of the MPU6050: accelerometer high-pass, threshold, duration."""

import math

from tools.virtual.chip.registers import (
    ACCEL_CONFIG,
    MOT_DETECT_CTRL,
    MOT_DETECT_STATUS,
    MOT_DUR,
    MOT_THR,
)

_THRESHOLD_G = 0.032  # per LSB of MOT_THR
_HIGH_PASS_HZ = {1: 5.0, 2: 2.5, 3: 1.25, 4: 0.63}
_HOLD = 7
_DECREMENT = (None, 1, 2, 4)  # MOT_COUNT; None: back to zero


class MotionEngine:
    """Fires after MOT_DUR samples (1 ms each) above MOT_THR x 32 mg on any axis."""

    def __init__(self, registers):
        self._registers = registers
        self._mode = None
        self._base = None
        self._count = 0

    def step(self, accel_g, rate_hz=1000.0):
        """One filtered sample; True when motion is detected at it."""
        mode = self._registers[ACCEL_CONFIG] & 7
        if self._base is None or (mode != self._mode and mode != 0):
            self._base = accel_g
        self._mode = mode
        if mode == _HOLD:
            keep = 0.0
        elif mode in _HIGH_PASS_HZ:
            keep = 1 - math.exp(-2 * math.pi * _HIGH_PASS_HZ[mode] / rate_hz)
        else:
            keep = 1.0  # 0: the filter's output settles to zero within one sample
        high = [a - b for a, b in zip(accel_g, self._base)]
        self._base = tuple(b + keep * h for b, h in zip(self._base, high))
        if keep == 1.0:
            high = [0.0, 0.0, 0.0]
        return self._judge(high)

    def _judge(self, high):
        threshold = self._registers[MOT_THR] * _THRESHOLD_G
        over = [abs(h) > threshold for h in high]
        if not any(over):
            step = _DECREMENT[self._registers[MOT_DETECT_CTRL] & 3]
            self._count = 0 if step is None else max(0, self._count - step)
            return False
        self._count += 1
        if self._count < max(1, self._registers[MOT_DUR]):
            return False
        self._count = 0
        bits = 0  # MOT_XNEG is bit 7, MOT_XPOS bit 6, ... MOT_ZPOS bit 2
        for axis, (h, beyond) in enumerate(zip(high, over)):
            if beyond:
                bits |= (0x80 if h < 0 else 0x40) >> (2 * axis)
        self._registers[MOT_DETECT_STATUS] = bits
        return True

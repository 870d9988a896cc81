# SPDX-License-Identifier: MIT
"""Smooth random motion in all six degrees of freedom, with exact rates, forces and truth."""

import math
import random

from tools.virtual.motion import quaternions as quat

_RAD = math.pi / 180
_G = 9.80665


class _Wave:
    """A sum of sinusoids that starts at zero: value and two derivatives."""

    def __init__(self, generator, amplitude, lowest_hz, highest_hz, count=3):
        weights = [generator.uniform(0.3, 1.0) for _ in range(count)]
        total = sum(weights)
        self._tones = []
        for weight in weights:
            hz = lowest_hz * (highest_hz / lowest_hz) ** generator.random()
            phase = generator.uniform(0, 2 * math.pi)
            part = amplitude * weight / total
            self._tones.append((part, 2 * math.pi * hz, phase, part * math.sin(phase)))

    def at(self, t):
        value = first = second = 0.0
        for a, w, phase, start in self._tones:
            sine = a * math.sin(w * t + phase)
            value += sine - start
            first += w * a * math.cos(w * t + phase)
            second -= w * w * sine
        return value, first, second


class FreeMotion:
    """Random turning (any orientation) and shifting; starts level, at rest for `rest_s` seconds.

    `angle_deg` are the amplitudes of roll, pitch and yaw, `shift_m` that of the position;
    frequencies lie between `lowest_hz` and `highest_hz`. After the rest it swings in within 1 s.
    """

    duration_s = None

    def __init__(
        self,
        seed=0,
        angle_deg=(60.0, 40.0, 90.0),
        shift_m=0.05,
        lowest_hz=0.1,
        highest_hz=0.8,
        rest_s=0.0,
        temp_c=25.0,
    ):
        generator = random.Random(seed)
        band = (lowest_hz, highest_hz)
        self._angles = [_Wave(generator, a, *band) for a in angle_deg]
        self._places = [_Wave(generator, shift_m, *band) for _ in range(3)]
        self._rest_s, self._temp_c = rest_s, temp_c

    def _pace(self, t_s):
        """The motion's own time, how fast it runs, and how that changes."""
        if not self._rest_s:
            return t_s, 1.0, 0.0
        u = t_s - self._rest_s
        if u <= 0:
            return 0.0, 0.0, 0.0
        if u >= 1:
            return u - 0.5, 1.0, 0.0
        return u**3 - u**4 / 2, u * u * (3 - 2 * u), 6 * u * (1 - u)

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        tau, pace, change = self._pace(t_s)
        roll, pitch, yaw = (wave.at(tau) for wave in self._angles)
        sr, cr = math.sin(roll[0] * _RAD), math.cos(roll[0] * _RAD)
        sp, cp = math.sin(pitch[0] * _RAD), math.cos(pitch[0] * _RAD)
        dr, dp, dy = roll[1] * pace, pitch[1] * pace, yaw[1] * pace
        force = [0.0, 0.0, 1.0]
        for n, wave in enumerate(self._places):
            _, first, second = wave.at(tau)
            force[n] += (second * pace * pace + first * change) / _G
        q = quat.from_euler(roll[0], pitch[0], yaw[0])
        return (
            *quat.to_sensor(q, *force),
            dr - dy * sp,  # body rates of the angles' rates
            dp * cr + dy * sr * cp,
            -dp * sr + dy * cr * cp,
            self._temp_c,
        )

    def truth(self, t_s):
        """(w, x, y, z)."""
        tau = self._pace(t_s)[0]
        return quat.from_euler(*(wave.at(tau)[0] for wave in self._angles))

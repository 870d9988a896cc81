# SPDX-License-Identifier: MIT
"""Turning about one sensor axis: a sinusoid, and a servo's step."""

import math

from tools.virtual.motion import quaternions as quat

_AXES = ("roll", "pitch", "yaw")
_RAD = math.pi / 180
_G = 9.80665


class _OneAxis:
    """Rotation about one sensor axis; `_angle(t)` gives degrees, dps and dps per second.

    `arm_m` is the sensor's place as seen from the axis: off it, the sensor also feels the
    tangential and the centripetal acceleration.
    """

    duration_s = None

    def __init__(self, axis, arm_m, temp_c):
        if axis not in _AXES:
            raise ValueError(f"axis {axis!r} is not one of {', '.join(_AXES)}")
        self._axis = _AXES.index(axis)
        self._arm = tuple(arm_m)
        self._temp_c = temp_c

    def angle_deg(self, t_s):
        """The true angle about the axis, degrees."""
        return self._angle(t_s)[0]

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        angle, rate, acceleration = self._angle(t_s)
        sine, cosine = math.sin(angle * _RAD), math.cos(angle * _RAD)
        n = self._axis
        force = ((0.0, sine, cosine), (-sine, 0.0, cosine), (0.0, 0.0, 1.0))[n]
        if any(self._arm):
            force = self._with_arm(force, rate * _RAD, acceleration * _RAD)
        rates = [0.0, 0.0, 0.0]
        rates[n] = rate
        return (*force, *rates, self._temp_c)

    def truth(self, t_s):
        """(w, x, y, z)."""
        angles = [0.0, 0.0, 0.0]
        angles[self._axis] = self._angle(t_s)[0]
        return quat.from_euler(*angles)

    def _with_arm(self, force, rate, acceleration):
        n = self._axis
        u, v = (n + 1) % 3, (n + 2) % 3
        ru, rv = self._arm[u], self._arm[v]
        force = list(force)
        force[u] += (-acceleration * rv - rate * rate * ru) / _G
        force[v] += (acceleration * ru - rate * rate * rv) / _G
        return force


class Sinusoid(_OneAxis):
    """offset + amplitude sin(2 pi f t + phase) about one axis; degrees and hertz."""

    def __init__(
        self,
        amplitude_deg=20.0,
        frequency_hz=0.5,
        axis="roll",
        offset_deg=0.0,
        phase_deg=0.0,
        arm_m=(0, 0, 0),
        temp_c=25.0,
    ):
        super().__init__(axis, arm_m, temp_c)
        self._amplitude, self._offset = amplitude_deg, offset_deg
        self._omega, self._phase = 2 * math.pi * frequency_hz, phase_deg * _RAD

    def _angle(self, t_s):
        w, a = self._omega, self._amplitude
        sine, cosine = math.sin(w * t_s + self._phase), math.cos(w * t_s + self._phase)
        return self._offset + a * sine, a * w * cosine, -a * w * w * sine


class Step(_OneAxis):
    """A servo goes from 0 to `angle_deg` at `at_s`: second order with a limited rate.

    natural_hz and damping describe the servo's position loop, rate_limit_dps its motor.
    """

    _TICK_S = 0.0005

    def __init__(
        self,
        angle_deg=20.0,
        at_s=0.5,
        axis="roll",
        rate_limit_dps=120.0,
        natural_hz=6.0,
        damping=0.9,
        arm_m=(0, 0, 0),
        temp_c=25.0,
    ):
        super().__init__(axis, arm_m, temp_c)
        self._at_s, self._target = at_s, angle_deg
        self._table = self._run(rate_limit_dps, 2 * math.pi * natural_hz, damping)

    def _run(self, limit, w, damping):
        """(angle, rate) per tick; the rate is linear between ticks and the angle its integral."""
        h, angle, rate, table = self._TICK_S, 0.0, 0.0, [(0.0, 0.0)]
        settled = abs(self._target) * 1e-6
        while abs(self._target - angle) > settled or abs(rate) > settled * w:
            wish = rate + h * (w * w * (self._target - angle) - 2 * damping * w * rate)
            wish = min(max(wish, -limit), limit)
            angle += h * (rate + wish) / 2
            rate = wish
            table.append((angle, rate))
        return table

    def _angle(self, t_s):
        place = (t_s - self._at_s) / self._TICK_S
        if place <= 0:
            return 0.0, 0.0, 0.0
        n = int(place)
        if n + 1 >= len(self._table):
            return self._table[-1][0], 0.0, 0.0
        angle, rate = self._table[n]
        acceleration = (self._table[n + 1][1] - rate) / self._TICK_S
        s = (place - n) * self._TICK_S
        return angle + s * (rate + acceleration * s / 2), rate + acceleration * s, acceleration

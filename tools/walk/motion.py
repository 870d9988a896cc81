# SPDX-License-Identifier: MIT
"""A sensor that is moved as the walk says, without a jump of angle or rate, with exact truth."""

from math import cos, pi, radians, sin

from tools.virtual.motion import quaternions as quat

FADE_S = 0.3  # each motion swells within this time, and dies away


class _Part:
    """One motion: it turns from `q` about axes of the sensor, one after the other.

    turns: (unit vector, angle) pairs; angle(tau) -> degrees and degrees per second.
    shake_g: amplitude of a sideways acceleration of 1.3 Hz.
    """

    def __init__(self, begin_s, q, turns=(), shake_g=0.0):
        self.begin_s, self.end_s = begin_s, None
        self.q, self.turns, self.shake_g = q, turns, shake_g

    def pace(self, t):
        """The motion's own time and how fast that runs."""
        u = (t - self.begin_s) / FADE_S
        if u <= 0:
            return 0.0, 0.0
        if u < 1:
            return FADE_S * (u**3 - u**4 / 2), u * u * (3 - 2 * u)
        until = t if self.end_s is None else min(t, self.end_s - FADE_S)
        tau = until - self.begin_s - FADE_S / 2
        if self.end_s is None or t <= self.end_s - FADE_S:
            return tau, 1.0
        v = min(1.0, (t - self.end_s) / FADE_S + 1)
        return tau + FADE_S * (v - v**3 + v**4 / 2), 1 - v * v * (3 - 2 * v)

    def look(self, t):
        """(quaternion, rate in the sensor's frame deg/s, sideways acceleration g)."""
        tau, pace = self.pace(t)
        q, rate = self.q, (0.0, 0.0, 0.0)
        for axis, angle in self.turns:
            degrees, speed = angle(tau)
            step = quat.from_rotation_vector(*(radians(degrees) * a for a in axis))
            rate = quat.to_sensor(step, *rate)
            rate = tuple(r + speed * pace * a for r, a in zip(rate, axis, strict=True))
            q = quat.product(q, step)
        return q, rate, self.shake_g * pace * sin(2 * pi * 1.3 * tau)


def _swing(amplitude_deg, hz):
    w = 2 * pi * hz

    def angle(tau):
        return amplitude_deg * sin(w * tau), amplitude_deg * w * cos(w * tau)

    return angle


def _tip(angle_deg):
    def angle(tau):
        u = min(max(tau, 0.0), 1.0)
        return angle_deg * u * u * (3 - 2 * u), angle_deg * 6 * u * (1 - u)

    return angle


AXES = {"roll": (1.0, 0.0, 0.0), "pitch": (0.0, 1.0, 0.0), "yaw": (0.0, 0.0, 1.0)}


class Moved:
    """A motion source for a chip. rest(), turn(), swing(), tip(), free(): another motion from
    `now_s` on, after the one before has died away."""

    duration_s = None

    def __init__(self):
        self._parts = [_Part(-10.0, (1.0, 0.0, 0.0, 0.0))]

    def _next(self, now_s, turns, shake_g=0.0):
        last = self._parts[-1]
        last.end_s = max(now_s, last.begin_s + FADE_S) + FADE_S
        q = last.look(last.end_s)[0]
        self._parts.append(_Part(last.end_s, q, turns(q), shake_g))

    def rest(self, now_s):
        """Stand still."""
        self._next(now_s, lambda q: ())

    def turn(self, now_s, rate_dps):
        """Turn about the vertical for ever."""
        self._next(now_s, lambda q: ((quat.gravity(q), lambda t: (rate_dps * t, rate_dps)),))

    def swing(self, now_s, axis, amplitude_deg, hz):
        """Swing about an axis of the sensor for ever."""
        self._next(now_s, lambda q: ((AXES[axis], _swing(amplitude_deg, hz)),))

    def tip(self, now_s, axis, angle_deg):
        """Turn by an angle within a second and stay there."""
        self._next(now_s, lambda q: ((AXES[axis], _tip(angle_deg)),))

    def free(self, now_s, amplitude_deg):
        """All three axes at once, with a little acceleration."""
        turns = [(AXES["roll"], 0.31), (AXES["pitch"], 0.23), (AXES["yaw"], 0.17)]
        made = tuple((axis, _swing(amplitude_deg, hz)) for axis, hz in turns)
        self._next(now_s, lambda q: made, 0.05)

    def _look(self, t_s):
        for part in reversed(self._parts):
            if part.begin_s <= t_s:
                return part.look(t_s)
        return self._parts[0].look(t_s)

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        q, rate, side = self._look(t_s)
        return (*quat.to_sensor(q, side, 0.0, 1.0), *rate, 25.0)

    def truth(self, t_s):
        """(w, x, y, z)."""
        return self._look(t_s)[0]

    def rate_dps(self, t_s):
        """The largest rate of the axes, deg/s."""
        return max(abs(r) for r in self._look(t_s)[1])

    def level_dps(self, t_s):
        """The rate about level axes, which moves gravity, deg/s."""
        q, rate, _ = self._look(t_s)
        up = quat.gravity(q)
        along = sum(r * u for r, u in zip(rate, up, strict=True))
        return max(0.0, sum(r * r for r in rate) - along * along) ** 0.5

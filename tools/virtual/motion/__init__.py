# SPDX-License-Identifier: MIT
"""Motion sources: what the sensor really feels, as a function of time, and its true attitude.

`at(t_s)` gives (ax_g, ay_g, az_g, gx_dps, gy_dps, gz_dps, temp_c): specific force and rate in
the sensor frame; level and still is +1 g on z. `truth(t_s)` gives the quaternion (w, x, y, z)
that turns sensor into earth coordinates, z up. `duration_s` is None for a motion without end.
Sinusoid, Step, FreeMotion and Replay live in files of their own and are found here as well.
"""

import math
import random

from tools.virtual.motion import quaternions as quat
from tools.virtual.motion.free_motion import FreeMotion
from tools.virtual.motion.one_axis import Sinusoid, Step
from tools.virtual.motion.replay import Replay

__all__ = ["FreeMotion", "Replay", "Sequence", "Sinusoid", "Step", "Still", "Temperature"]
__all__ += ["Vibration"]

_RAD = math.pi / 180


class Still:
    """At rest at roll, pitch and yaw (degrees, by the project's convention)."""

    duration_s = None

    def __init__(self, roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, temp_c=25.0):
        self._q = quat.from_euler(roll_deg, pitch_deg, yaw_deg)
        self._sample = (*quat.gravity(self._q), 0.0, 0.0, 0.0, temp_c)

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        return self._sample

    def truth(self, t_s):
        """(w, x, y, z)."""
        return self._q


class Vibration:
    """Motors shake the frame: sinusoids at `rpm` and its harmonics on top of another motion.

    `rpm` is a number or one per motor; `accel_g` and `gyro_dps` are the amplitudes of each
    motor's fundamental on x, y, z; `harmonics` maps multiples of the speed to relative amplitudes.
    Phases come from `seed`.
    """

    def __init__(
        self,
        rpm=6000.0,
        accel_g=(0.3, 0.3, 0.3),
        gyro_dps=(5.0, 5.0, 5.0),
        over=None,
        harmonics=((1, 1.0), (2, 0.4), (3, 0.15)),
        seed=0,
    ):
        self.over = over or Still()
        generator = random.Random(seed)
        self._tones = []
        for speed in rpm if hasattr(rpm, "__iter__") else (rpm,):
            for multiple, part in harmonics:
                sines, cosines = [], []
                for amplitude in (*accel_g, *gyro_dps):
                    phase = generator.uniform(0, 2 * math.pi)
                    sines.append(part * amplitude * math.cos(phase))
                    cosines.append(part * amplitude * math.sin(phase))
                self._tones.append((2 * math.pi * speed / 60 * multiple, sines, cosines))

    @property
    def duration_s(self):
        """That of the motion below."""
        return self.over.duration_s

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        ax, ay, az, gx, gy, gz, temp_c = self.over.at(t_s)
        for omega, p, q in self._tones:
            s, c = math.sin(omega * t_s), math.cos(omega * t_s)
            ax += p[0] * s + q[0] * c
            ay += p[1] * s + q[1] * c
            az += p[2] * s + q[2] * c
            gx += p[3] * s + q[3] * c
            gy += p[4] * s + q[4] * c
            gz += p[5] * s + q[5] * c
        return ax, ay, az, gx, gy, gz, temp_c

    def truth(self, t_s):
        """(w, x, y, z); the shaking turns the sensor by hundredths of a degree."""
        turn = [0.0, 0.0, 0.0]
        for omega, p, q in self._tones:
            s, c = math.sin(omega * t_s), math.cos(omega * t_s)
            for n in range(3):
                turn[n] += (q[n + 3] * s - p[n + 3] * c) / omega * _RAD
        return quat.product(self.over.truth(t_s), quat.from_rotation_vector(*turn))


class Temperature:
    """Another motion while the temperature goes from `start_c` to `end_c` within `over_s`."""

    def __init__(self, over, start_c, end_c, over_s):
        self.over = over
        self._start, self._end, self._over_s = start_c, end_c, over_s
        self.duration_s = over.duration_s

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        part = min(max(t_s / self._over_s, 0.0), 1.0)
        return (*self.over.at(t_s)[:6], self._start + part * (self._end - self._start))

    def truth(self, t_s):
        """(w, x, y, z)."""
        return self.over.truth(t_s)


class Sequence:
    """Motions one after the other: (source, seconds) pairs, each with its own time from 0.

    The last one goes on. There is no motion between the poses: it jumps.
    """

    def __init__(self, *parts):
        if not parts:
            raise ValueError("a sequence needs at least one (source, seconds)")
        self._parts = []
        start = 0.0
        for source, seconds in parts:
            self._parts.append((start, source))
            start += seconds
        self.duration_s = start

    def _part(self, t_s):
        found = self._parts[0]
        for part in self._parts:
            if part[0] <= t_s:
                found = part
        return found

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        start, source = self._part(t_s)
        return source.at(t_s - start)

    def truth(self, t_s):
        """(w, x, y, z)."""
        start, source = self._part(t_s)
        return source.truth(t_s - start)

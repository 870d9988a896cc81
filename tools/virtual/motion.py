# SPDX-License-Identifier: MIT
"""Motion sources: what the sensor really feels, as a function of time, and its true attitude.

`at(t_s)` gives (ax_g, ay_g, az_g, gx_dps, gy_dps, gz_dps, temp_c): specific force and rate in
the sensor frame; level and still is +1 g on z. `truth(t_s)` gives the quaternion (w, x, y, z)
that turns sensor into earth coordinates, z up. `duration_s` is None for a motion without end.
"""

import math

_DEG = math.pi / 180


def quat_from_euler(roll_deg, pitch_deg, yaw_deg=0.0):
    """Quaternion (w, x, y, z), sensor to earth, of yaw, then pitch, then roll (degrees)."""
    cr, sr = math.cos(roll_deg * _DEG / 2), math.sin(roll_deg * _DEG / 2)
    cp, sp = math.cos(pitch_deg * _DEG / 2), math.sin(pitch_deg * _DEG / 2)
    cy, sy = math.cos(yaw_deg * _DEG / 2), math.sin(yaw_deg * _DEG / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def gravity_in_sensor(q):
    """Specific force at rest, g, in the sensor frame: earth's z axis seen from the sensor."""
    w, x, y, z = q
    return 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z


class Still:
    """At rest at roll and pitch (degrees, by the project's convention)."""

    duration_s = None

    def __init__(self, roll_deg=0.0, pitch_deg=0.0, yaw_deg=0.0, temp_c=25.0):
        self._q = quat_from_euler(roll_deg, pitch_deg, yaw_deg)
        self._sample = (*gravity_in_sensor(self._q), 0.0, 0.0, 0.0, temp_c)

    def at(self, t_s):
        """Specific force (g), rate (dps), temperature (degC)."""
        return self._sample

    def truth(self, t_s):
        """(w, x, y, z)."""
        return self._q

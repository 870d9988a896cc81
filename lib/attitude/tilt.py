# SPDX-License-Identifier: MIT
"""Tilt from the accelerometer alone.

Axes are Plumb's, right-handed, +1 g on z when level: roll turns about x, pitch about y. No
function here fails on a zero vector, which reads as level.
"""

from math import atan2, pi, sqrt

_DEG = 180.0 / pi


def wrap_deg(angle_deg):
    """The same direction within [-180, 180) degrees."""
    if -180.0 <= angle_deg < 180.0:
        return angle_deg  # exact: the modulo below would cost digits in single precision
    return (angle_deg + 180.0) % 360.0 - 180.0


def accel_tilt_deg(ax_g, ay_g, az_g):
    """(roll, pitch) in degrees from the specific force in g: roll in [-180, 180], pitch +-90.

    roll = atan2(ay, az), pitch = atan2(-ax, sqrt(ay^2 + az^2)): the pair that rebuilds the
    gravity vector exactly when roll is applied last. Units cancel, so raw counts do as well.
    """
    return (
        atan2(ay_g, az_g) * _DEG,
        atan2(-ax_g, sqrt(ay_g * ay_g + az_g * az_g)) * _DEG,
    )

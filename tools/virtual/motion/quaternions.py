# SPDX-License-Identifier: MIT
"""Quaternions (w, x, y, z), sensor to earth, as plain tuples of floats."""

import math

_HALF = math.pi / 360  # half an angle in degrees, as radians


def from_euler(roll_deg, pitch_deg, yaw_deg=0.0):
    """Yaw about z, then pitch about y, then roll about x (degrees)."""
    cr, sr = math.cos(roll_deg * _HALF), math.sin(roll_deg * _HALF)
    cp, sp = math.cos(pitch_deg * _HALF), math.sin(pitch_deg * _HALF)
    cy, sy = math.cos(yaw_deg * _HALF), math.sin(yaw_deg * _HALF)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def from_rotation_vector(x, y, z):
    """Rotation by the vector's length (radians) about its direction."""
    angle = math.sqrt(x * x + y * y + z * z)
    k = math.sin(angle / 2) / angle if angle > 1e-12 else 0.5
    return math.cos(angle / 2), k * x, k * y, k * z


def product(p, q):
    """p q: the rotation q, then p."""
    a, b, c, d = p
    w, x, y, z = q
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def to_sensor(q, x, y, z):
    """A vector in earth coordinates, seen from the sensor."""
    w, qx, qy, qz = q
    # v + 2 u x (u x v + w v) with u of the conjugate
    tx = 2 * (qz * y - qy * z)
    ty = 2 * (qx * z - qz * x)
    tz = 2 * (qy * x - qx * y)
    return (
        x + w * tx + qz * ty - qy * tz,
        y + w * ty + qx * tz - qz * tx,
        z + w * tz + qy * tx - qx * ty,
    )


def gravity(q):
    """Specific force at rest, g, in the sensor frame: earth's z axis seen from the sensor."""
    w, x, y, z = q
    return 2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z

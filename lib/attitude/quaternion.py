# SPDX-License-Identifier: MIT
"""Quaternions as tuples (w, x, y, z), scalar first, sensor to earth."""

from math import sqrt


def product(p, q):
    """Hamilton product p q."""
    a, b, c, d = p
    w, x, y, z = q
    return (a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y,
            a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w)


def unit(q):
    """q with length 1; the identity for a zero q."""
    w, x, y, z = q
    n = sqrt(w * w + x * x + y * y + z * z)
    if n < 1e-6:
        return (1.0, 0.0, 0.0, 0.0)
    return (w / n, x / n, y / n, z / n)


def rotate(q, x, y, z):
    """A sensor vector in earth axes."""
    w, a, b, c = q
    tx = 2.0 * (b * z - c * y)
    ty = 2.0 * (c * x - a * z)
    tz = 2.0 * (a * y - b * x)
    return (x + w * tx + b * tz - c * ty, y + w * ty + c * tx - a * tz,
            z + w * tz + a * ty - b * tx)


def rotate_back(q, x, y, z):
    """An earth vector in sensor axes."""
    return rotate((q[0], -q[1], -q[2], -q[3]), x, y, z)


def levelling(x, y, z):
    """The shortest rotation that turns the earth vector (x, y, z), not zero, upright."""
    n = sqrt(x * x + y * y + z * z)
    if z < -0.9999 * n:  # upside down: every level axis is as short
        return (0.0, 1.0, 0.0, 0.0)
    return unit((n + z, y, -x, 0.0))

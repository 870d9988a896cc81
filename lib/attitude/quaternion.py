# SPDX-License-Identifier: MIT
"""Quaternions as tuples (w, x, y, z), scalar first, sensor to earth."""

from math import atan2, degrees, sqrt


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


def without_yaw(q):
    """The attitude of the same roll and pitch with yaw 0; straight up or down, q itself."""
    w, x, y, z = q
    s, c = 2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)
    n = sqrt(s * s + c * c)
    if n < 1e-3:
        return q
    if c < -0.9999 * n:
        return product((0.0, 0.0, 0.0, 1.0), q)
    return product(unit((n + c, 0.0, 0.0, -s)), q)


class Orientation:
    """Angles of whatever has a quaternion()."""

    def quaternion(self):
        """(w, x, y, z), sensor to earth: the subclass knows."""
        raise NotImplementedError

    def gravity(self):
        """Unit vector in sensor axes that points up: what it would read at rest, in g."""
        return rotate_back(self.quaternion(), 0.0, 0.0, 1.0)

    @property
    def roll_deg(self):
        """Rotation about x, -180 to 180 degrees."""
        _, y, z = self.gravity()
        return degrees(atan2(y, z))

    @property
    def pitch_deg(self):
        """Rotation about y, -90 to 90 degrees."""
        x, y, z = self.gravity()
        return degrees(atan2(-x, sqrt(y * y + z * z)))

    @property
    def yaw_deg(self):
        """Rotation about the vertical since the start, -180 to 180 degrees."""
        w, x, y, z = self.quaternion()
        return degrees(atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)))

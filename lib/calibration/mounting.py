# SPDX-License-Identifier: MIT
"""How the sensor sits in the robot: the rotation from the sensor's frame to the robot's.

Robot frame: x forward, y left, z up. Rotations are row-major tuples of 9 (robot = R sensor); a
row is a robot axis seen by the sensor. Vectors are accelerometer readings at rest, calibrated
(`cal.apply(rest(imu).accel_g, ...)[0]`); then `cal.mounted(R)`.
"""

from math import acos, degrees, sqrt


def orientation(forward="+x", up="+z"):
    """One of the 24 right-angled mountings: which sensor axes point forward and up.

    ValueError when they are no axes, or the same one.
    """
    x, z = _axis(forward), _axis(up)
    if _dot(x, z):
        raise ValueError("forward=%s and up=%s lie on one axis" % (forward, up))
    return _rows(x, z)


def from_tilt(level, nose_up):
    """Rotation from two readings: the robot level, then with its nose lifted (10 to 80 deg).

    Finds any orientation. ValueError when the tilt is too small to tell, or too large.
    """
    z, tilted = _unit(level), _unit(nose_up)
    tilt = degrees(acos(max(-1.0, min(1.0, _dot(z, tilted)))))
    if not 10 <= tilt <= 80:
        raise ValueError("tilted by %.1f degrees: between 10 and 80 needed" % tilt)
    # the nose points up a little now: what is new in the reading is forward
    along = _dot(tilted, z)
    return _rows(_unit([t - along * a for t, a in zip(tilted, z)]), z)


def refine(rotation, level):
    """The same mounting made exact by one level reading: the smallest turn that sets z right.

    ValueError when that is more than 30 degrees: then `rotation` is the wrong one.
    """
    z = _unit(level)
    off = degrees(acos(max(-1.0, min(1.0, _dot(z, rotation[6:9])))))
    if off > 30:
        raise ValueError("the reading is %.0f degrees from this orientation's up" % off)
    forward = rotation[0:3]
    along = _dot(forward, z)
    return _rows(_unit([f - along * a for f, a in zip(forward, z)]), z)


def level_of(readings):
    """The reading that the robot would give if it could be set level.

    readings: on any one slope, the robot turned in equal steps of heading: 2 by half a turn, 3
    by a third, 4 by a quarter. The slope cancels in the mean. ValueError.
    """
    if len(readings) < 2:
        raise ValueError("at least two readings, half a turn apart, needed")
    return _unit([sum([_unit(r)[i] for r in readings]) for i in range(3)])


def nearest(rotation):
    """(forward, up, degrees): the nearest of the 24 orientations, and how far from it."""
    best = None
    names = ("+x", "-x", "+y", "-y", "+z", "-z")
    for forward in names:
        for up in names:
            if forward[1] != up[1]:
                # trace of R^T other = 1 + 2 cos(angle between them)
                other = orientation(forward, up)
                cosine = (sum([a * b for a, b in zip(rotation, other)]) - 1) / 2
                if best is None or cosine > best[2]:
                    best = (forward, up, cosine)
    assert best is not None
    return best[0], best[1], degrees(acos(max(-1.0, min(1.0, best[2]))))


def _rows(x, z):
    """x forward, z up, and y = z cross x to the left."""
    y = (
        z[1] * x[2] - z[2] * x[1],
        z[2] * x[0] - z[0] * x[2],
        z[0] * x[1] - z[1] * x[0],
    )
    return tuple(x) + y + tuple(z)


def _axis(name):
    if len(name) != 2 or name[0] not in "+-" or name[1] not in "xyz":
        raise ValueError("%s is not one of +x -x +y -y +z -z" % name)
    vector = [0.0, 0.0, 0.0]
    vector["xyz".index(name[1])] = 1.0 if name[0] == "+" else -1.0
    return vector


def _dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _unit(v):
    length = sqrt(_dot(v, v))
    if length < 0.1:
        raise ValueError("a reading of %.2f g has no direction: was the robot at rest?" % length)
    return [a / length for a in v]

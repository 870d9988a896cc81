# SPDX-License-Identifier: MIT
"""Where a filter stands, so that any other can go on there: attitude, rates, bias.

A filter gives standing(): (quaternion sensor to earth, rates and bias in deg/s, the bias as last
seen at rest or None), all of its last sample, or None before the first one; alike(other): whether
the other's state() fits; and takes place(quaternion), begin_at(standing), where a bias seen at
rest and no rate at all say that a rest has shown the tilt. A filter of roll and pitch cannot tell
a turn from a bias: it hands on the one at rest that was handed to it.
"""

from math import atan2, cos, degrees, radians, sin, sqrt

from attitude.quaternion import product, rotate_back, unit


def of_angles(roll_deg, pitch_deg, yaw_deg):
    """The quaternion of these angles: yaw first, roll last."""
    a, b, c = radians(0.5 * roll_deg), radians(0.5 * pitch_deg), radians(0.5 * yaw_deg)
    tilt = product((cos(b), 0.0, sin(b), 0.0), (cos(a), sin(a), 0.0, 0.0))
    return product((cos(c), 0.0, 0.0, sin(c)), tilt)


def angles_deg(q):
    """(roll, pitch, yaw) of a unit quaternion."""
    w, x, y, z = q
    i, j, k = rotate_back(q, 0.0, 0.0, 1.0)
    return (
        degrees(atan2(j, k)),
        degrees(atan2(-i, sqrt(j * j + k * k))),
        degrees(atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))),
    )


def angles_mdeg(q):
    """The same in whole millidegrees."""
    return [round(1000.0 * angle) for angle in angles_deg(q)]


def turned(q, rates_dps, dt_s):
    """q after dt_s at these rates about the sensor's axes."""
    x, y, z = [radians(rate) * dt_s * 0.5 for rate in rates_dps]
    half = sqrt(x * x + y * y + z * z)
    s = sin(half) / half if half > 1e-6 else 1.0
    return unit(product(q, (cos(half), x * s, y * s, z * s)))


def with_yaw(q, yaw_deg):
    """The same roll and pitch with this yaw."""
    more = 0.5 * radians(yaw_deg - angles_deg(q)[2])
    return unit(product((cos(more), 0.0, 0.0, sin(more)), q))


def go_on(own, other, dt_us, yaw_deg):
    """Let `own` start where the other one stands; see its go_on_from()."""
    alike = own.alike(other)
    if alike:
        own.take_state(other)
    stands = (own if alike else other).standing()  # of the very same sample
    if stands is None:
        own.reset()
        return
    q, rates, bias, home = stands
    q = turned(q, rates, dt_us * 1e-6)
    if yaw_deg is not None:
        q = with_yaw(q, yaw_deg)
    if not alike:
        if home and own.knows_yaw and not other.knows_yaw:
            bias = home
        own.begin_at((q, rates, bias, home))
    elif dt_us or yaw_deg is not None:
        own.place(q)

# SPDX-License-Identifier: MIT
"""What is said of the yaw, which nothing but the gyro tells of: it stands still at rest, a turn
that begins slowly is not lost, and the bound grows with all that may put it off."""

from itertools import pairwise

import numpy as np
import pytest

from host_tests.lib.filter_rig import (
    FREE,
    Body,
    angles,
    make,
    matrix,
    product,
    quaternion,
    rest,
    wrap,
    yaw_error,
)

RATE_HZ = 80
POSES = [(0, 0, 0), (35, -20, 100), (-90, 10, -60), (175, 5, 0)]
every = pytest.mark.parametrize("name", FREE)


def started(name, pose=(0, 0, 0), bias=(1.0, -0.8, 0.6)):
    filt, body = make(name, RATE_HZ, lag_s=0), Body(*pose, bias=bias)
    rest(filt, body, 4, RATE_HZ)
    body.yaw = filt.angles_mdeg[2] / 1000
    return filt, body


def turned(filt, body, rates_dps):
    """Feed rates about the earth's vertical; how far the yaw is off afterwards, degrees."""
    total = 0.0
    for dps in rates_dps:
        body.turn(dps * matrix(body.q)[2], 1 / RATE_HZ)
        total += dps / RATE_HZ
        filt.update(body.counts())
    return float(wrap(filt.angles_mdeg[2] / 1000 - body.yaw - total))


@every
@pytest.mark.parametrize("pose", POSES)
def test_at_rest_the_yaw_stands_still_however_the_bias_drifts(name, pose):
    filt, body = started(name, pose)
    for _ in range(60 * RATE_HZ):  # 0.6 deg/s in a minute: the mean lags by 0.06 deg/s
        body.bias += np.array([0.01, -0.01, 0.01]) / RATE_HZ
        filt.update(body.counts())
    assert filt.at_rest
    assert abs(turned(filt, body, [])) < 0.05


@every
@pytest.mark.parametrize("pose", POSES)
@pytest.mark.parametrize("ramp_dps2", [0.2, 0.5, 2, 20])
def test_a_turn_that_begins_slowly_is_counted_from_its_beginning(name, pose, ramp_dps2):
    filt, body = started(name, pose)
    rest(filt, body, 3, RATE_HZ)
    speeding = np.minimum(np.arange(0, 8, 1 / RATE_HZ) * ramp_dps2, 20)
    off = turned(filt, body, [*speeding, *speeding[::-1], *np.zeros(RATE_HZ)])
    assert not filt.uncertain
    print("%.2f of %.1f" % (off, 2 * sum(speeding) / RATE_HZ))
    assert abs(off) < max(0.25, 0.05 * 2 * sum(speeding) / RATE_HZ)


@every
def test_the_bound_grows_at_rest_by_the_gyros_noise(name):
    filt, body = started(name)
    begin_deg = filt.yaw_sigma_deg
    rest(filt, body, 96, RATE_HZ)
    grown = filt.yaw_sigma_deg**2 - begin_deg**2
    assert 0.5 * 96 * 0.005**2 < grown < 2 * 96 * 0.005**2  # PS-MPU-6000A p. 12


@every
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_beyond_the_gyros_range_the_yaw_is_anywhere(name, axis):
    filt, body = started(name)
    rates = np.zeros(3)
    rates[axis] = 900  # of 500
    for _ in range(2 * RATE_HZ):
        body.turn(rates, 1 / RATE_HZ)
        filt.update(body.counts())
    assert 1.96 * filt.yaw_sigma_deg > 100
    blocks = 2 / 0.08  # of 20 degrees each, the bound's factor 0.8
    assert filt.yaw_sigma_deg == pytest.approx(min(92, 0.8 * 20 * blocks**0.5), rel=0.2)
    again, other = started(name)
    for _ in range(2 * RATE_HZ):
        other.turn(rates / 2, 1 / RATE_HZ)
        again.update(other.counts())
    assert again.yaw_sigma_deg < 60


@every
def test_without_a_rest_the_bound_grows_and_keeps_on(name):
    """A bias that nobody has seen at rest may be wrong by the same amount for long."""
    filt, body = make(name, RATE_HZ, lag_s=0), Body(bias=(0.4, -0.3, 0.5))
    bounds = []
    for n in range(180 * RATE_HZ):
        t = n / RATE_HZ
        rates = 30 * np.cos(1.7 * t), 25 * np.cos(1.1 * t + 1), 40 * np.sin(0.3 * t)
        body.turn(rates, 1 / RATE_HZ)
        filt.update(body.counts())
        if n % (30 * RATE_HZ) == 30 * RATE_HZ - 1:
            bounds.append(filt.yaw_sigma_deg)
            assert abs(yaw_error(filt, body.q)) < 1.96 * filt.yaw_sigma_deg
    assert all(b > 1.01 * a for a, b in pairwise(bounds))


@every
@pytest.mark.parametrize("at_s", [3.0, 10.05, 31.7])
def test_zero_yaw_is_where_all_that_was_off_ends(name, at_s):
    """What is learned afterwards makes good what was off since then, not what was before."""
    filt, body = make(name, RATE_HZ, lag_s=0), Body(bias=(0.4, -0.3, 0.8))
    zero_deg = None
    for n in range(60 * RATE_HZ):
        t = n / RATE_HZ
        if t == at_s:
            filt.zero_yaw()
            zero_deg = angles(body.q)[2]
            assert abs(filt.angles_mdeg[2]) < 100
            assert filt.yaw_sigma_deg < 0.1
        to(body, quaternion(35 * np.sin(1.7 * t), 30 * np.sin(1.1 * t), 130 * np.sin(0.3 * t)))
        filt.update(body.counts())
        if zero_deg is not None and n % 40 == 0:
            off = wrap(filt.angles_mdeg[2] / 1000 - (angles(body.q)[2] - zero_deg))
            assert abs(off) < 1.96 * filt.yaw_sigma_deg + 1  # Euler angles share a tilt's error


def to(body, q):
    """Turn to this attitude within a sample."""
    w, x, y, z = product(body.q * (1, -1, -1, -1), q)
    body.rates, body.q = np.degrees([2 * x, 2 * y, 2 * z]) * RATE_HZ / w, q

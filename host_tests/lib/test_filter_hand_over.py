# SPDX-License-Identifier: MIT
"""A new filter starts where the old one stands: tilt, yaw and bias, at rest and moving."""

import numpy as np
import pytest
from attitude.standing import of_angles

from host_tests.lib.filter_rig import (
    ALL,
    FREE,
    INTEGER,
    Body,
    angles,
    make,
    matrix,
    product,
    quaternion,
    rest,
    tilt_error,
    turn,
    wrap,
    yaw_error,
)
from host_tests.lib.fixed_inputs import Skewed

pairs = pytest.mark.parametrize("old, new", [(a, b) for a in ALL for b in ALL])


class Upside:
    """A sensor screwed in upside down and backwards: x forward is -y, z up is -z."""

    gyro_bias_dps = (1.0, -2.0, 3.0)
    accel_bias_g = (0.01, 0.02, -0.03)
    gyro_matrix = accel_matrix = (0.0, -1.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, -1.0)


def bias_of(name):
    """What the old filter can have learned in these tests: the gyros that gravity tells of, with
    rest all three, Complementary none."""
    if name == "float.complementary":
        return (0.0, 0.0, 0.0)
    return (1.5, -1.0, 0.8 if name in FREE else 0.0)


def brought(old, new, cal=None, pose=(0, 0), settle_s=8.0, **ranges):
    """(old filter, body) that has stood there."""
    was = make(old, **ranges)
    body = Body(*pose, bias=bias_of(old), cal=cal)
    if cal:
        was.calibrate(cal)
    rest(was, body, settle_s)
    return was, body


@pairs
@pytest.mark.parametrize("cal", [None, Skewed, Upside])
@pytest.mark.parametrize("pose", [(0, 0), (-146, 35), (100, -60)])
def test_at_rest_nothing_moves(old, new, cal, pose):
    was, body = brought(old, new, cal, pose)
    now = make(new)
    if cal:
        now.calibrate(cal)
    now.go_on_from(was)
    assert tilt_error(now, body.q) < 0.2  # at once, before the first sample
    assert list(now.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.05)
    for _ in range(8):
        rest(now, body, 0.25)
        assert tilt_error(now, body.q) < 0.5
        if new in FREE:
            assert abs(wrap(now.yaw_mdeg / 1000 - was.yaw_mdeg / 1000)) < 0.5
        if new != "float.complementary" or old in FREE:
            assert list(now.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.05)


@pairs
@pytest.mark.parametrize("dt_us", [0, 4000, 30000])
def test_moving_it_is_turned_on(old, new, dt_us):
    was, body = brought(old, new)
    free = old in FREE and new in FREE
    axis = (30.0, -20.0, 48.0) if free else (60.0, 0.0, 0.0)
    turn(was, body, axis, 1.0)
    now = make(new)
    now.go_on_from(was, dt_us)
    # the old filter's own error at that instant is not the new one's
    error = tilt_error(was, body.q)
    body.turn(axis, dt_us * 1e-6)
    assert tilt_error(now, body.q) < error + 0.5
    assert list(now.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.05)
    assert now.rates_mdps[0] == pytest.approx(was.rates_mdps[0], abs=50)
    if free:
        assert abs(yaw_error(now, body.q)) < 0.5
    yaw = now.yaw_mdeg
    turn(now, body, axis, 0.2)
    assert tilt_error(now, body.q) < error + 0.5
    if free:
        assert abs(yaw_error(now, body.q)) < 0.5
        assert abs(wrap((now.yaw_mdeg - yaw) / 1000)) > 5


@pytest.mark.parametrize("old", ALL)
@pytest.mark.parametrize("new", FREE)
def test_a_given_yaw_is_kept(old, new):
    was, body = brought(old, new, pose=(-30, 40))
    now = make(new)
    now.go_on_from(was, yaw_deg=123.0)
    assert now.yaw_mdeg == pytest.approx(123000, abs=20)
    assert tilt_error(now, body.q) < 0.2
    rest(now, body, 1)
    assert now.yaw_mdeg == pytest.approx(123000, abs=500)


@pytest.mark.parametrize("name", ALL)
def test_the_same_kind_takes_over_the_whole_state(name):
    was, body = brought(name, name, pose=(20, -30))
    turn(was, body, (40, 10, -30), 0.5)
    now = make(name)
    now.go_on_from(was)
    assert now.state() == was.state()
    assert list(now.out[0:6]) == list(was.out[0:6]) or name not in INTEGER
    twin = Body(20, -30, bias=body.bias)
    twin.q = body.q
    turn(was, body, (10, 20, 30), 0.3)
    turn(now, twin, (10, 20, 30), 0.3)
    assert list(now.out) == list(was.out)


@pytest.mark.parametrize("name", ALL)
@pytest.mark.parametrize("ranges", [{"rate_hz": 1000}, {"gyro_dps": 2000, "accel_g": 16}])
def test_other_rates_and_ranges_are_taken_over(name, ranges):
    was, body = brought(name, name, pose=(-146, 35))
    now = make(name, **ranges)
    now.go_on_from(was)
    assert tilt_error(now, body.q) < 0.2
    assert list(now.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.05)
    other = Body(
        -146, 35, bias=bias_of(name), **{k: v for k, v in ranges.items() if k != "rate_hz"}
    )
    for _ in range(8):
        rest(now, other, 0.25, ranges.get("rate_hz", 250))
        assert tilt_error(now, other.q) < 0.5
        assert abs(wrap((now.yaw_mdeg - was.yaw_mdeg) / 1000)) < 0.5
        assert list(now.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.06)


@pairs
def test_one_that_has_seen_nothing_brings_nothing(old, new):
    now, body = make(new), Body(30, 20)
    rest(now, body, 1)
    now.go_on_from(make(old))
    rest(now, Body(-50, 10), 0.1)
    assert tilt_error(now, quaternion(-50, 10)) < 0.1


@pytest.mark.parametrize("new", FREE)
def test_a_wrong_bias_that_was_brought_is_mended_at_the_first_rest(new):
    was = make("kalman2")
    rest(was, Body(10, 5, bias=(3, -2, 0)), 8)
    now, body = make(new), Body(10, 5, bias=(1, 1, -4))
    now.go_on_from(was)
    rest(now, body, 12)
    assert list(now.bias_dps) == pytest.approx([1, 1, -4], abs=0.05)
    assert tilt_error(now, body.q) < 0.2


@pytest.mark.parametrize("between", [name for name in ALL if name not in FREE])
@pytest.mark.parametrize("free", FREE)
def test_a_bias_at_rest_outlives_a_filter_that_takes_a_turn_for_a_bias(free, between):
    was, body = brought(free, free, pose=(10, 5))
    per_axis, now = make(between), make(free)
    per_axis.go_on_from(was)
    body.bias = body.bias + (15.0, -15.0, 15.0)  # as a turn looks to it
    rest(per_axis, body, 2)
    now.go_on_from(per_axis)
    assert list(now.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.01)
    assert max(now.bias_sigma_dps) < 0.02
    same = make(between)  # and a change of that one's settings
    same.go_on_from(per_axis)
    again = make(free)
    again.go_on_from(same)
    assert list(again.bias_dps) == pytest.approx(list(was.bias_dps), abs=0.01)


@pytest.mark.parametrize("old", ["kalman2", "float.kalman"])
@pytest.mark.parametrize("new", FREE)
def test_a_bias_that_nobody_saw_at_rest_may_be_as_wrong_as_it_is_large(old, new):
    was = make(old)
    rest(was, Body(bias=(12.0, -2.0, 0.0)), 10)
    now = make(new)
    now.go_on_from(was)
    assert now.bias_sigma_dps[0] == pytest.approx(12.0, abs=0.5)
    assert now.bias_sigma_dps[1] == pytest.approx(3.0, abs=0.1)


@pytest.mark.parametrize("angle", [(0, 0, 0), (-146, 35, 20), (179, 0, -179), (10, 89, 5)])
def test_quaternions_and_angles_go_both_ways(angle):
    from attitude import standing

    q = standing.of_angles(*angle)
    assert np.allclose(q, quaternion(*angle), atol=1e-12)
    assert np.allclose(wrap(np.array(standing.angles_deg(q)) - angle), 0, atol=1e-6)
    assert np.allclose(angles(q), standing.angles_deg(q), atol=1e-9)
    turned = standing.turned(q, (30.0, -20.0, 40.0), 0.5)
    v = np.radians([30, -20, 40]) / 4
    n = np.linalg.norm(v)
    expected = product(q, (np.cos(n), *(v * np.sin(n) / n)))
    assert np.allclose(turned, expected, atol=1e-9)
    again = standing.with_yaw(turned, -77.0)
    assert wrap(standing.angles_deg(again)[2] + 77) == pytest.approx(0, abs=1e-6)
    assert np.allclose(matrix(again)[2], matrix(turned)[2], atol=1e-9)


@pytest.mark.parametrize("name", FREE)
@pytest.mark.parametrize("turning, home, known", [
    (0.0, True, True), (0.0, False, False), (5.0, True, False),
])  # fmt: skip
def test_a_tilt_is_known_from_the_first_block_on_only_where_a_rest_has_shown_it(
    name, turning, home, known
):
    no = (0.0, 0.0, 0.0)
    new, body = make(name), Body(10, 5)
    new.begin_at((of_angles(10.0, 5.0, 0.0), (0.0, 0.0, turning), no, no if home else None))
    rest(new, body, 0.2)
    assert (new.tilt_sigma_deg < 1.0) == known

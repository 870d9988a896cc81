# SPDX-License-Identifier: MIT
"""What the app relies on in every filter, float or integer, one axis or free."""

import numpy as np
import pytest

from host_tests.lib.filter_rig import (
    ALL,
    FREE,
    INTEGER,
    LSB_PER_G,
    Body,
    make,
    matrix,
    rest,
    tilt_error,
    turn,
)
from host_tests.lib.fixed_inputs import Skewed

every = pytest.mark.parametrize("name", ALL)


@every
def test_results_are_live_views_of_one_array(name):
    filt = make(name)
    out, angles, rates = filt.out, filt.angles_mdeg, filt.rates_mdps
    assert len(out) >= 10 and len(angles) == len(rates) == 3
    turn(filt, Body(roll=20), (30, -20, 10), 0.2)
    assert filt.out is out and filt.angles_mdeg is angles and filt.rates_mdps is rates
    assert list(out[0:3]) == list(angles) == [filt.roll_mdeg, filt.pitch_mdeg, filt.yaw_mdeg]
    assert list(out[3:6]) == list(rates)
    assert all(isinstance(value, int) for value in out)
    assert len(set(out[0:6])) > 4  # and they are not all the same


@every
@pytest.mark.parametrize("gyro_dps, accel_g", [(250, 2), (500, 8), (1000, 4), (2000, 16)])
def test_rates_and_force_are_calibrated_and_in_the_robots_frame(name, gyro_dps, accel_g):
    filt = make(name, gyro_dps=gyro_dps, accel_g=accel_g)
    filt.calibrate(Skewed)
    body = Body(10, -5, gyro_dps=gyro_dps, accel_g=accel_g, cal=Skewed)
    turn(filt, body, (40, -30, 20), 0.04)
    # a count, skewed, and what a Kalman filter has learned in ten samples
    assert list(filt.rates_mdps) == pytest.approx([40000, -30000, 20000], abs=150)
    force = np.array(filt.out[6:9]) / LSB_PER_G[accel_g]
    assert force == pytest.approx(matrix(body.q)[2], abs=3e-3)


@every
def test_the_learned_bias_is_taken_off_the_rates(name):
    filt, body = make(name), Body(bias=(2.0, -1.5, 1.0))
    rest(filt, body, 8)
    knows = name != "float.complementary"
    z_too = name in FREE
    assert filt.rates_mdps[0] == pytest.approx(0 if knows else 2000, abs=60)
    assert filt.rates_mdps[1] == pytest.approx(0 if knows else -1500, abs=60)
    assert filt.rates_mdps[2] == pytest.approx(0 if z_too else 1000, abs=60)
    learned = [2.0 * knows, -1.5 * knows, 1.0 * z_too]
    assert list(filt.bias_dps) == pytest.approx(learned, abs=0.06)


@every
def test_rest_is_told_where_it_is_watched(name):
    filt, body = make(name), Body()
    assert not filt.at_rest and filt.out[9] == 0
    rest(filt, body, 3)
    assert bool(filt.at_rest) == (name in FREE)
    assert filt.out[9] == (name in FREE)
    turn(filt, body, (50, 0, 0), 0.1)
    assert not filt.at_rest and filt.out[9] == 0


@every
def test_update_without_a_time_is_one_step_of_the_period(name):
    a, b = make(name), make(name)
    first, second = Body(5, 5), Body(5, 5)
    for _ in range(100):
        first.turn((20, 30, 0), 0.004)
        second.turn((20, 30, 0), 0.004)
        if name in INTEGER:
            a.step(first.counts())
        else:
            a.update(first.counts(), 4000)
        b.update(second.counts())
    assert list(a.out) == list(b.out)
    assert a.timed == (name not in INTEGER)


@every
def test_reset_forgets_and_a_state_continues(name):
    filt, other = make(name), make(name)
    body = Body(10, bias=(1, 1, 1))
    rest(filt, body, 3)
    other.set_state(filt.state())
    twin = Body(10, bias=(1, 1, 1))
    for each, own in ((filt, body), (other, twin)):
        turn(each, own, (10, 20, 30), 0.5)
    assert list(other.out) == list(filt.out)
    filt.reset()
    assert list(filt.bias_dps) == [0, 0, 0]
    fresh, level = Body(-30), Body(-30)
    blank = make(name)
    rest(filt, fresh, 0.1)
    rest(blank, level, 0.1)
    assert list(filt.angles_mdeg) == list(blank.angles_mdeg)
    assert tilt_error(filt, fresh.q) < 0.05


@pytest.mark.parametrize("name", FREE)
@pytest.mark.parametrize("roll, pitch", [(0, 0), (60, -50), (-146, 30)])
def test_linear_acceleration_is_without_gravity_and_in_the_robots_frame(name, roll, pitch):
    filt, body = make(name, rate_hz=250), Body(roll, pitch)
    rest(filt, body, 3)
    assert filt.linear_accel_g() == pytest.approx((0, 0, 0), abs=1e-3)
    counts = body.counts()
    for axis, push in enumerate((0.3, -0.2, 0.1)):
        counts[axis] += round(push * 4096)
    filt.update(counts)
    assert filt.linear_accel_g() == pytest.approx((0.3, -0.2, 0.1), abs=2e-3)
    w, x, y, z = filt.quaternion()
    assert w * w + x * x + y * y + z * z == pytest.approx(1, abs=1e-6)


@pytest.mark.parametrize("name", INTEGER)
def test_a_state_is_of_one_instant_whatever_comes_in_between(name):
    filt, body = make(name), Body()
    turn(filt, body, (50, 0, 0), 0.1)

    def interrupted(state):
        """Reads the state; the first time a tick comes in while it does."""
        got = tuple(state)
        if not ticks:
            ticks.append(1)
            filt.set_state(after)
        return got

    before = filt.state()
    ticks = [1]
    turn(filt, body, (50, 0, 0), 0.004)
    after = filt.state()
    assert before != after
    filt.set_state(before)
    ticks.clear()
    assert filt.whole(interrupted) == after and filt.state() == after
    assert ticks == [1]

# SPDX-License-Identifier: MIT
"""Loops with gaps of their own: update(counts, dt_us); and levelling anew after an outage."""

import random

import numpy as np
import pytest

from host_tests.lib.filter_rig import (
    ALL,
    FREE,
    INTEGER,
    Body,
    make,
    matrix,
    rest,
    tilt_error,
    turn,
    yaw_error,
)

every = pytest.mark.parametrize("name", ALL)
free = pytest.mark.parametrize("name", FREE)


def irregular(seed):
    rng = random.Random(seed)
    return lambda: rng.choice((1000, 2500, 4000, 7000, 10000, 31000, 100000))


SLEEPS = {
    "0.5 ms": lambda: 500,
    "4 ms": lambda: 4000,
    "4.3 ms": lambda: 4300,
    "10 ms": lambda: 10000,
    "30 ms": lambda: 30000,
    "100 ms": lambda: 100000,
    "irregular": irregular(1),
    "irregular too": irregular(2),
}


def feed(filt, body, seconds, sleep, rates=lambda t: (0, 0, 0)):
    """Sample the body after each sleep; between two it turns at rates(t), finely."""
    t = 0.0
    while t < seconds - 1e-9:
        dt_us = min(sleep(), round((seconds - t) * 1e6))
        parts = max(1, dt_us // 1000)
        for k in range(parts):
            body.turn(rates(t + (k + 0.5) * dt_us * 1e-6 / parts), dt_us * 1e-6 / parts)
        t += dt_us * 1e-6
        body.rates = np.array(rates(t), float)
        filt.update(body.counts(), dt_us)
    return filt


def quarter(axis):
    """Rates of a turn by 90 degrees in two seconds, without a jerk."""

    def rates(t):
        out = [0.0, 0.0, 0.0]
        out[axis] = 45.0 * (1 - np.cos(np.pi * t)) if t < 2 else 0.0
        return out

    return rates


@free
@pytest.mark.parametrize("sleep", SLEEPS)
def test_a_quarter_turn_reads_ninety_degrees(name, sleep):
    filt, body = make(name), Body(bias=(1.0, -1.5, 2.0))
    feed(filt, body, 6, SLEEPS[sleep])
    start = filt.yaw_mdeg
    feed(filt, body, 2.3, SLEEPS[sleep], quarter(2))
    assert filt.yaw_mdeg - start == pytest.approx(90000, abs=1000)
    assert tilt_error(filt, body.q) < 0.5


@every
@pytest.mark.parametrize("sleep", SLEEPS)
def test_so_does_one_about_a_level_axis(name, sleep):
    filt, body = make(name), Body(roll=-40)
    feed(filt, body, 2, SLEEPS[sleep])
    feed(filt, body, 2.3, SLEEPS[sleep], quarter(0))
    assert filt.roll_mdeg == pytest.approx(50000, abs=1000)


@pytest.mark.parametrize("name", INTEGER)
@pytest.mark.parametrize("rate_hz, gyro_dps", [(80, 2000), (250, 500), (1000, 1000)])
def test_it_is_as_if_it_had_been_sampled_in_between(name, rate_hz, gyro_dps):
    """A gap of five periods along a straight line is five steps."""
    period_us = 1000000 // rate_hz
    a, b = make(name, rate_hz, gyro_dps), make(name, rate_hz, gyro_dps)
    body = Body(20, gyro_dps=gyro_dps)
    a.update(body.counts(), period_us)
    b.update(body.counts())
    before = list(body.counts())
    after = [v + d for v, d in zip(before, (50, -100, 25, 0, 1000, -500, 250))]
    body.counts()[:] = body.counts()  # the array stays the same
    counts = body.counts()
    for k in range(1, 6):
        for i in range(7):
            counts[i] = before[i] + (after[i] - before[i]) * k // 5
        b.update(counts)
    a.update(counts, 5 * period_us)
    assert list(a.out) == list(b.out)
    assert a.state()[1:] == b.state()[1:]


@pytest.mark.parametrize("name", INTEGER)
def test_a_step_without_a_time_in_between_is_not_bridged_from(name):
    filt, body = make(name), Body()
    rest(filt, body, 3)
    filt.update(body.counts(), 4000)
    turn(filt, body, (0, 0, 0), 1)
    body.rates = np.array([0, 0, 60.0])
    moving = body.counts()
    filt.step(moving)
    filt.update(moving, 100000)  # from the step on it turned at 60 deg/s all the time
    # half a step, the gap, and what lag_s adds
    expected = 120 + 6000 + 288 if name in FREE else 0
    assert filt.yaw_mdeg == pytest.approx(expected, abs=50)


@pytest.mark.parametrize("name", INTEGER)
def test_the_period_stays_the_filters_own(name):
    filt, body = make(name), Body()
    filt.period_us = 4100
    for dt_us in (100, 4000, 33000):
        filt.update(body.counts(), dt_us)
        assert filt.period_us == 4100
    twin = make(name)
    twin.period_us = 4100
    twin.set_state(filt.state())
    body.rates = np.array([30.0, 20, 10])
    filt.update(body.counts())
    twin.update(body.counts())
    assert list(filt.out) == list(twin.out)


@every
def test_after_a_gap_too_long_to_bridge_it_levels_and_keeps_yaw(name):
    filt, body = make(name), Body(yaw=0, bias=(1, -1, 2))
    rest(filt, body, 8)
    turn(filt, body, (0, 0, 60), 1)
    yaw = filt.yaw_mdeg
    moved = Body(25, 10, 60, bias=(1, -1, 2))
    filt.update(moved.counts(), 3_000_000)
    for _ in range(20):
        filt.update(moved.counts(), 4000)
    if name in INTEGER:
        assert tilt_error(filt, moved.q) < 0.5
        # the short way from level to there turns the heading as well by half a degree or two
        assert abs(filt.yaw_mdeg - yaw) < 4000
    assert abs(filt.bias_dps[0] - (0 if "complementary" in name else 1)) < 0.2


# ---- relevel()

POSES = [(0, 0, 0), (0, 0, 90), (60, -50, 90), (-146, 20, -170), (-60, 50, 45), (180, 0, 10)]


@every
@pytest.mark.parametrize("roll, pitch, yaw", POSES)
@pytest.mark.parametrize("bias", [(0, 0, 0), (5.0, -4.0, 3.0)])
def test_relevel_at_rest_keeps_yaw_tilt_and_bias(name, roll, pitch, yaw, bias):
    if name == "float.complementary":
        bias = (0, 0, 0)  # which it leaves in
    filt, body = make(name), Body(roll, pitch, bias=bias)
    rest(filt, body, 8)
    earth = matrix(body.q)[2]
    if name in FREE:
        turn(filt, body, earth * yaw / 2, 2)  # about the vertical
    rest(filt, body, 4)
    known, heading = list(filt.bias_dps), filt.yaw_mdeg
    if name in FREE:
        assert yaw_error(filt, body.q) == pytest.approx(0, abs=1.0)
    for _ in range(3):
        filt.relevel()
        assert list(filt.bias_dps) == pytest.approx(known, abs=0.02)
        for _ in range(10):
            rest(filt, body, 0.4)
            assert abs((filt.yaw_mdeg - heading + 180000) % 360000 - 180000) < 500
            assert tilt_error(filt, body.q) < 0.5
            assert list(filt.bias_dps) == pytest.approx(known, abs=0.05)
    if name in FREE:
        assert filt.at_rest


@every
def test_relevel_before_the_first_sample_changes_nothing(name):
    filt, twin, body = make(name), make(name), Body(30, 10)
    filt.relevel()
    rest(filt, body, 0.5)
    rest(twin, body, 0.5)
    assert list(filt.out) == list(twin.out)


@every
def test_relevel_finds_the_tilt_after_a_move_that_nobody_saw(name):
    filt, body = make(name), Body(10, bias=(2, 1, -1))
    rest(filt, body, 8)
    body = Body(-70, 40, bias=(2, 1, -1))
    filt.relevel()
    rest(filt, body, 0.2)
    assert tilt_error(filt, body.q) < 0.5

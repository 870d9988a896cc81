# SPDX-License-Identifier: MIT
"""Settings change coefficients, never the state: no jump, no lost yaw, the bias kept."""

import numpy as np
import pytest

from host_tests.lib.filter_rig import ALL, FREE, INTEGER, Body, make, rest, turn, wrap
from host_tests.lib.fixed_inputs import Skewed

every = pytest.mark.parametrize("name", ALL)
integer = pytest.mark.parametrize("name", INTEGER)
OWN = {
    "attitude": ({"tau_s": 4.0}, {"rest_tau_s": 1.0, "bias_tau_s": 60.0}, {"rest_s": 3.0}),
    "float.attitude": ({"tau_s": 4.0}, {"rest_tau_s": 1.0}),
    "kalman2": ({"r_measure": 0.3}, {"q_angle": 0.01, "q_bias": 0.001}, {"trust_g": 0.5}),
    "float.kalman": ({"r_measure": 0.3}, {"q_angle": 0.01}),
    "float.complementary": ({"tau_s": 2.0},),
}
CHANGES = [(name, {"settings": change}) for name in ALL for change in OWN[name]]
CHANGES += [(name, {"period_us": value}) for name in ALL for value in (4000, 3820, 4180.5)]
changes = pytest.mark.parametrize("name, change", CHANGES)


@changes
@pytest.mark.parametrize("moving", [False, True])
def test_a_change_moves_nothing(name, change, moving):
    # about one axis where a filter knows no more; Complementary leaves a bias in
    rates = np.array((60.0, -30.0, 45.0) if name in FREE else (60.0, 0, 0)) * moving
    bias = (0, 0, 0) if name == "float.complementary" else (5.0, -4.0, 3.0 * (name in FREE))
    changed, kept = make(name), make(name)
    bodies = Body(10, bias=bias), Body(10, bias=bias)
    for filt, body in zip((changed, kept), bodies, strict=True):
        rest(filt, body, 8)
        turn(filt, body, rates, 0.5)
    state, out, bias = changed.state(), list(changed.out), list(changed.bias_dps)
    changed.prepare(**change)
    assert changed.state() == state and list(changed.out) == out  # before swap() nothing at all
    changed.swap()
    assert list(changed.out) == out
    assert list(changed.bias_dps) == bias
    if name == "attitude":
        assert changed.state() == state
    # from then on the same step, but for what the setting is there for
    for _ in range(5):
        for filt, body in zip((changed, kept), bodies, strict=True):
            turn(filt, body, rates, 0.004)
    apart = wrap((np.array(changed.angles_mdeg) - np.array(kept.angles_mdeg)) / 1000)
    # a period 4.5 % off makes that much of the turn in 20 ms
    assert np.abs(apart).max() < 0.03 + 0.045 * 0.02 * np.linalg.norm(rates)
    assert list(changed.bias_dps) == pytest.approx(list(kept.bias_dps), abs=0.05)


@every
def test_twelve_changes_at_two_hundred_degrees_a_second_lose_nothing(name):
    filt, body = make(name), Body(bias=(1, -1, 2))
    rest(filt, body, 8)
    assert abs(filt.yaw_mdeg) < 10
    for i in range(12):
        turn(filt, body, (0, 0, 200.0), 0.152)
        change = OWN[name][0]
        key = next(iter(change))
        filt.prepare(settings={key: change[key] * (1 + 0.1 * (i % 2))})
        filt.swap()
    # 364.8 degrees, 200 * 4.8 ms of lag, half of the first step, in which the rate jumped
    expected = 364.8 + 0.96 - 0.4 if name in FREE else 0
    assert wrap(filt.yaw_mdeg / 1000 - expected) == pytest.approx(0, abs=0.05)


@every
def test_all_three_at_once_and_one_after_the_other(name):
    change = OWN[name][0]
    a, b = make(name), make(name)
    a.prepare(Skewed, 4100, change)
    a.swap()
    b.prepare(calibration=Skewed)
    b.prepare(settings=change)
    b.prepare(period_us=4100)
    b.swap()
    fresh = make(name, **change)
    fresh.calibrate(Skewed)
    fresh.period_us = 4100
    for filt in (a, b, fresh):
        turn(filt, Body(-20, cal=Skewed), (10, 20, 30), 0.5)
    assert list(a.out) == list(b.out) == list(fresh.out)
    assert a.period_us == b.period_us == 4100


BAD = [
    {"period_us": 4300},
    {"period_us": 3700},
    {"settings": {"colour": 3}},
    {"calibration": Skewed, "settings": {"colour": 3}},
    {"calibration": Skewed, "period_us": 5000, "settings": {}},
]
OWN_BAD = {
    "attitude": (
        {"tau_s": 0},
        {"start_bias_dps": 50},
        {"tau_s": 3.0, "lag_s": -1},
        {"tau_s": None},
    ),
    "float.attitude": ({"tau_s": 0},),
    "kalman2": ({"q_angle": -1}, {"r_measure": 0}, {"q_bias": 1e9}, {"trust_g": 0}),
    "float.kalman": ({"q_angle": -1}, {"r_measure": 0}),
    "float.complementary": ({"tau_s": -1}, {"alpha": 2}),
}


@pytest.mark.parametrize(
    "name, change",
    [(name, change) for name in ALL for change in BAD]
    + [(name, {"settings": bad}) for name in ALL for bad in OWN_BAD[name]],
)
def test_what_is_refused_leaves_all_as_it_was(name, change):
    filt, twin = make(name), make(name)
    filt.prepare(settings=OWN[name][0])  # prepared and not yet taken over
    twin.prepare(settings=OWN[name][0])
    with pytest.raises(ValueError):
        filt.prepare(**change)
    filt.swap()
    twin.swap()
    for each in (filt, twin):
        turn(each, Body(5), (10, 20, 30), 0.3)
    assert list(filt.out) == list(twin.out)
    assert filt.state() == twin.state()
    assert filt.period_us == twin.period_us == 4000


@every
@pytest.mark.parametrize("rate_hz, low, high", [(250, 3800.0, 4200.0), (2000 / 7, 3325.0, 3675.0)])
def test_a_period_out_of_reach_is_refused_with_the_range(name, rate_hz, low, high):
    filt = make(name, rate_hz)
    for value in (low, high, (low + high) / 2):
        filt.period_us = value
        assert filt.period_us == pytest.approx(value, abs=1 / 16)
    for value in (low - 1, high + 1, 0, -4000, 1e9):
        with pytest.raises(ValueError, match=f"must be {low} to {high}"):
            filt.period_us = value
    assert filt.period_us == pytest.approx((low + high) / 2, abs=1 / 16)


@integer
@pytest.mark.parametrize("change", [0.96, 0.99, 1.01, 1.04])
def test_the_bias_is_the_same_at_another_period(name, change):
    """In deg/s: it would move by 4 % of 10 deg/s where it was kept by the sample."""
    filt, body = make(name), Body(bias=(10.0, -8.0, 6.0))
    rest(filt, body, 12)
    bias = list(filt.bias_dps)
    filt.period_us = 4000 * change
    assert list(filt.bias_dps) == bias
    rest(filt, body, 0.2)
    assert list(filt.bias_dps) == pytest.approx(bias, abs=0.01)
    assert np.abs(filt.rates_mdps[:2]).max() < 30


@integer
def test_rates_do_not_depend_on_the_period(name):
    a, b = make(name), make(name)
    b.period_us = 4160
    for filt in (a, b):
        turn(filt, Body(), (100.0, -50.0, 25.0), 0.02)
    assert list(a.rates_mdps) == pytest.approx(list(b.rates_mdps), abs=30)


@pytest.mark.parametrize("change", [0.96, 1.04])
def test_a_turn_reads_right_at_another_period(change):
    filt, body = make("attitude"), Body(bias=(1, 2, 3))
    filt.period_us = 4000 * change
    rest(filt, body, 8)
    start = filt.yaw_mdeg
    for _ in range(500):
        body.turn((0, 0, 45), 0.004 * change)
        filt.update(body.counts())
    assert filt.yaw_mdeg - start == pytest.approx(90000 * change + 45 * 4.8, abs=120)


# ---- the integer Kalman filter's place in its gain table


def gains(filt):
    return filt._s[54], filt._s[55]


@pytest.mark.parametrize("run_s", [0.1, 1.0, 5.0, 60.0])
def test_a_change_of_r_goes_on_at_the_gain_for_the_time_it_has_run(run_s):
    changed, always = make("kalman2"), make("kalman2", r_measure=0.3)
    body = Body(10, 5, bias=(2, -1, 0))
    rest(changed, body, run_s)
    rest(always, body, run_s)
    bias, angles = list(changed.bias_dps), list(changed.angles_mdeg)
    assert gains(changed) != gains(always)
    changed.prepare(settings={"r_measure": 0.3})
    changed.swap()
    assert gains(changed) == gains(always)
    assert (list(changed.bias_dps), list(changed.angles_mdeg)) == (bias, angles)
    rest(changed, body, 1)
    rest(always, body, 1)
    assert gains(changed) == gains(always)


def test_a_calibration_or_a_period_leaves_the_place_alone():
    filt, twin, body = make("kalman2"), make("kalman2"), Body(10)
    for k in range(40):
        filt.prepare(Skewed if k % 2 else None, 4000 + k)
        filt.swap()
        rest(filt, body, 0.004)
        rest(twin, body, 0.004)
        assert gains(filt) == gains(twin)

# SPDX-License-Identifier: MIT
"""The integer filters of one value against the float ones, and the biquads' frequency response."""

import random
from array import array

import attitude
import numpy as np
import pytest
from attitude.fixed import (
    AdaptiveNotch,
    Complementary,
    Kalman1D,
    LowPass,
    MovingAverage,
    Notch,
)


@pytest.mark.parametrize("settings", [{"tau_s": 0.5}, {"alpha": 0.98}, {"alpha": 0.9996}])
def test_complementary_is_its_twin(settings):
    rng, angle = random.Random(3), 0.0
    fixed, exact = Complementary(rate_hz=250, **settings), attitude.Complementary(**settings)
    for _ in range(4000):
        angle = (angle + rng.gauss(0, 2) + 180) % 360 - 180
        mdeg, mdps = round(angle * 1000), rng.randint(-2000000, 2000000)
        expected = exact.update(mdeg / 1000, mdps / 1000, 0.004)
        error = (fixed.update(mdeg, mdps) / 1000 - expected + 180) % 360 - 180
        assert abs(error) < 0.005
    assert Complementary(alpha=0.0).update(5000, 100) == 5000


@pytest.mark.parametrize("size", [3000, 180000])
@pytest.mark.parametrize("q,r,p", [(0.125, 10.0, 1.0), (0.1, 4.0, 100.0), (0.0, 9.0, 4.0)])
def test_kalman1d_is_its_twin(q, r, p, size):
    rng = random.Random(4)
    fixed, exact = Kalman1D(q, r, p), attitude.Kalman1D(q, r, p)
    for _ in range(2000):
        value, change = rng.randint(-size, size), rng.randint(-50, 50)
        assert abs(fixed.update(value, change) - exact.update(value, change)) < 2 + size / 4000


def test_moving_average_is_its_twin():
    rng = random.Random(5)
    fixed, exact = MovingAverage(50), attitude.MovingAverage(50)
    for _ in range(400):
        value = rng.randint(-180000, 180000)
        assert abs(fixed.update(value) - exact.update(value)) <= 0.5


def sine(hz, rate_hz, n, amplitude=3000, mean=1000):
    return np.round(mean + amplitude * np.sin(2 * np.pi * hz / rate_hz * np.arange(n))).astype(int)


def passed(filt, hz, rate_hz=1000, n=2400):
    """Gain at a frequency, and the mean that comes out of a mean of 1000, in each channel."""
    counts, out = array("h", [0] * 7), []
    for value in sine(hz, rate_hz, n):
        counts[0] = counts[1] = counts[4] = counts[6] = int(value)
        counts[2] = counts[5] = -int(value)
        filt.update(counts)
        out.append(list(filt.counts))
    out = np.array(out[n // 2 :], float)
    wave = np.exp(-2j * np.pi * hz / rate_hz * np.arange(n // 2))
    gain = 2 * np.abs(wave @ (out - out.mean(0))) / len(out) / 3000
    assert np.allclose(gain[[0, 1, 2, 4, 5]], gain[6], atol=1e-3)
    assert out[:, 3].max() == 0
    return gain[6], out.mean(0)[6]


@pytest.mark.parametrize("hz", [5, 25, 50, 100, 200])
def test_low_pass_is_butterworths(hz):
    gain, mean = passed(LowPass(50, 1000), hz)
    warped = np.tan(np.pi * hz / 1000) / np.tan(np.pi * 50 / 1000)
    assert gain == pytest.approx(1 / np.sqrt(1 + warped**4), abs=2e-3)
    assert mean == pytest.approx(1000, abs=0.6)


@pytest.mark.parametrize("hz,low,high", [(120, 0, 0.002), (115, 0.2, 0.3), (20, 0.99, 1.001)])
def test_notch_takes_out_its_frequency_only(hz, low, high):
    gain, mean = passed(Notch(120, 1000), hz)
    assert low <= gain <= high
    assert mean == pytest.approx(1000, abs=0.6)


@pytest.mark.parametrize("hz", [50, 83, 200])
def test_adaptive_notch_finds_the_vibration(hz):
    filt = AdaptiveNotch(40, 240, 1000, slew_hz_s=100.0)
    passed(filt, hz)
    assert filt.hz == pytest.approx(hz, abs=2)
    assert passed(filt, hz)[0] < 0.1


def test_a_biquad_starts_on_the_first_sample_and_can_be_retuned():
    filt, counts = LowPass(5, 1000), array("h", [100, 200, -300, 7, 400, 500, -600])
    filt.update(counts)
    assert list(filt.counts) == list(counts)
    filt.tune(100, 0.7071)
    assert passed(filt, 100)[0] == pytest.approx(0.7071, abs=3e-3)
    with pytest.raises(ValueError, match="Hz"):
        filt.tune(300, 1.0)
    with pytest.raises(ValueError, match="quality"):
        filt.tune(100, 0.1)


@pytest.mark.parametrize(
    "make,arguments",
    [
        (lambda: Complementary(tau_s=0.2), (7000, 900)),
        (lambda: Kalman1D(), (500, 3)),
        (lambda: MovingAverage(7), (12345,)),
        (lambda: LowPass(20, 250), (array("h", [1, -2, 3, 4, -5, 6, -700]),)),
        (lambda: AdaptiveNotch(20, 60, 250), (array("h", [1, -2, 3, 4, -5, 6, -700]),)),
    ],
)
def test_a_state_continues_where_it_was_taken(make, arguments):
    first, second = make(), make()
    for _ in range(5):
        first.update(*arguments)
    second.set_state(first.state())
    for _ in range(5):
        assert first.update(*arguments) == second.update(*arguments)
    assert first.state() == second.state()
    first.reset()
    assert first.state() != second.state()

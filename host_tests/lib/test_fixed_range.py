# SPDX-License-Identifier: MIT
"""No input overflows 32 bits: the filters run under the checked viper, which would raise."""

import random
from array import array

import micropython
import pytest
from attitude.counts import Ideal
from attitude.fixed import AdaptiveNotch, Attitude, Complementary, KalmanTilt2, LowPass, Notch

from host_tests.lib.fixed_inputs import KINDS, Skewed, adversarial

SAMPLES = 500
RATES = (80, 250, 1000)
RANGES = ((250, 2), (500, 8), (2000, 16))


def feed(filt, rows):
    counts = array("h", [0] * 7)
    for row in rows:
        counts[:] = array("h", row)
        filt.update(counts)
    return filt


def test_the_check_is_on():
    @micropython.viper
    def square(x: int) -> int:
        return x * x

    with pytest.raises(OverflowError):
        square(50000)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [Attitude, KalmanTilt2])
def test_no_input_overflows(make, kind):
    for i, rate_hz in enumerate(RATES):
        gyro_dps, accel_g = RANGES[(i + len(kind)) % 3]
        for cal in (None, Skewed):
            filt = make(rate_hz, gyro_dps, accel_g)
            if cal:
                filt.calibrate(cal)
            filt.period_us = 1.04e6 / rate_hz
            feed(filt, adversarial(kind, SAMPLES, seed=rate_hz))
            assert -180000 <= filt.roll_mdeg <= 180000
            assert -180000 <= filt.pitch_mdeg <= 180000


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("make", [Attitude, KalmanTilt2])
def test_no_input_overflows_in_gaps_and_changes(make, kind):
    """Gaps of any length, levelling anew, other coefficients, a gap turned through: all mixed."""
    for i, rate_hz in enumerate(RATES):
        gyro_dps, accel_g = RANGES[(i + len(kind)) % 3]
        filt = make(rate_hz, gyro_dps, accel_g)
        rng = random.Random(rate_hz)
        counts = array("h", [0] * 7)
        for n, row in enumerate(adversarial(kind, 150, seed=rate_hz)):
            before = array("h", counts)
            counts[:] = array("h", row)
            filt.update(counts, rng.choice((0, 1, 700, 4000, 30000, 100000, 1001000, 2**30 - 1)))
            if n % 7 == 0:
                filt.prepare(
                    rng.choice((Ideal, Skewed)), rng.choice((0.951, 1.049)) * 1e6 / rate_hz
                )
                filt.swap()
            if n % 41 == 0:
                filt.relevel()
            if n % 11 == 0:
                filt.keep()
                filt.turn(before, counts, rng.choice((1, 5000, 300000, 1000000)))
            assert max(map(abs, filt.angles_mdeg)) <= 180000
            assert max(map(abs, filt.rates_mdps)) < 2**29


@pytest.mark.parametrize("kind", ["spin", "square", "corners"])
@pytest.mark.parametrize("dt_us", [1, 60, 500])
def test_a_loop_much_faster_than_the_filter_does_not_overflow(kind, dt_us):
    for rate_hz, gyro_dps in ((40, 250), (80, 2000), (250, 2000), (1000, 500)):
        filt = Attitude(rate_hz, gyro_dps, 16)
        filt.calibrate(Skewed)
        counts = array("h", [0] * 7)
        for row in adversarial(kind, 600):
            counts[:] = array("h", row)
            filt.update(counts, dt_us)


def test_a_quaternion_stays_one_under_the_worst_input():
    for kind in KINDS:
        filt = feed(Attitude(250, 2000, 16), adversarial(kind, SAMPLES))
        q = [value / 2**30 for value in filt.state()[1:5]]
        assert abs(sum(v * v for v in q) - 1.0) < 5e-3, kind


@pytest.mark.parametrize("kind", ["corners", "noise", "square", "tumble"])
def test_no_input_overflows_the_biquads(kind):
    for filt in (
        LowPass(2, 1000),
        LowPass(250, 1000, 20),
        Notch(2, 1000, 20),
        Notch(120, 1000, 0.5),
        AdaptiveNotch(40, 240, 1000, 20, 400.0),
    ):
        feed(filt, adversarial(kind, 2 * SAMPLES))


def test_a_resonance_at_full_scale_does_not_overflow_the_biquads():
    for filt in (LowPass(125, 1000, 20), Notch(125, 1000, 20), AdaptiveNotch(60, 200, 1000, 20)):
        feed(filt, [[32767] * 7 if i % 8 < 4 else [-32768] * 7 for i in range(4000)])


@pytest.mark.parametrize("make,rate_hz", [(Attitude, 40), (KalmanTilt2, 20)])
def test_the_slowest_rates_do_not_overflow(make, rate_hz):
    for kind in KINDS:
        filt = make(rate_hz, 500, 16)
        filt.calibrate(Skewed)
        feed(filt, adversarial(kind, SAMPLES))


def test_rates_beyond_the_formats_are_refused():
    for make, rate_hz, gyro_dps in (
        (Attitude, 39, 250),
        (Attitude, 79, 2000),
        (KalmanTilt2, 79, 2000),
        (KalmanTilt2, 9, 250),
        (KalmanTilt2, 2001, 250),
    ):
        with pytest.raises(ValueError, match=r"rate_hz \d+: must be \d+ to 2000"):
            make(rate_hz, gyro_dps)


def test_no_rate_overflows_the_complementary_filter():
    for rate_hz in (10, 250, 2000):
        filt = Complementary(tau_s=100.0, rate_hz=rate_hz)
        for n in range(SAMPLES):
            filt.update((-180000, 180000)[n // 50 % 2], (2**30 - 1, -(2**30))[n // 300 % 2])


def test_an_impossible_matrix_is_refused():
    class Blown(Skewed):
        accel_matrix = (2.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)

    with pytest.raises(ValueError, match="accel_matrix row 0"):
        KalmanTilt2().calibrate(Blown)

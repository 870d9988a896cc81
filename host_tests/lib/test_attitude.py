# SPDX-License-Identifier: MIT
"""The six-axis filter against motions whose truth is known, and against absurd input."""

import math
import random
import subprocess
import sys
from array import array
from pathlib import Path

import numpy as np
import pytest
from attitude import Attitude
from attitude.fixed.attitude import Attitude as FixedAttitude
from attitude.quaternion import product, rotate, rotate_back, unit

from tools import recordings

RATE = 250.0
DT = 1 / RATE
LEVEL = (0.0, 0.0, 0.0, 0.0, 0.0, 1.0)


def feed(f, sample, seconds):
    for _ in range(round(seconds * RATE)):
        f.update(*sample, DT)
    return f


def gravity(roll_deg, pitch_deg):
    roll, pitch = math.radians(roll_deg), math.radians(pitch_deg)
    return (-math.sin(pitch), math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch))


def tilt_error(f, up):
    got = rotate_back(f.quaternion(), 0.0, 0.0, 1.0)
    return math.degrees(math.acos(min(1.0, sum(a * b for a, b in zip(got, up)))))


class Body:
    """A body that turns as told, exactly, and what its perfect sensors read."""

    def __init__(self):
        self.q = (1.0, 0.0, 0.0, 0.0)

    def turn(self, rate_dps, dt=DT):
        size = math.sqrt(sum(r * r for r in rate_dps)) or 1.0
        half = math.radians(size * dt) / 2
        self.q = unit(product(self.q, (math.cos(half), *(
            r / size * math.sin(half) for r in rate_dps))))

    def feels(self, ax=0.0, ay=0.0, az=0.0):
        """Specific force in g when it accelerates by this, earth axes."""
        return rotate_back(self.q, ax, ay, az + 1.0)


def test_level_and_noise_free():
    f = feed(Attitude(RATE), LEVEL, 5)
    assert (f.roll_deg, f.pitch_deg, f.yaw_deg) == (0.0, 0.0, 0.0)
    assert f.at_rest and f.bias_dps == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("roll, pitch", [(0, 0), (30, 0), (0, -40), (170, 20), (180, 0), (-90, 0),
                                         (-135, 60), (0, 89.9), (45, -89.9)])
def test_any_attitude_from_the_first_sample_on(roll, pitch):
    f = Attitude(RATE)
    f.update(0, 0, 0, *gravity(roll, pitch), DT)
    for _ in range(2):
        assert tilt_error(f, gravity(roll, pitch)) < 1e-4
        assert f.pitch_deg == pytest.approx(pitch, abs=1e-4)
        assert math.cos(math.radians(f.roll_deg - roll)) > 1 - 1e-9
        feed(f, (0, 0, 0, *gravity(roll, pitch)), 4)


def test_at_the_pole_nothing_breaks():
    f = feed(Attitude(RATE), (0, 0, 0, -1.0, 0.0, 0.0), 4)
    assert f.pitch_deg == pytest.approx(90, abs=1e-4)
    assert math.isfinite(f.roll_deg) and math.isfinite(f.yaw_deg)


def test_signs_and_yaw():
    """+90 degrees about each axis by the right hand, three different rates on the way."""
    for axis, name in enumerate(("roll_deg", "pitch_deg", "yaw_deg")):
        f, body = feed(Attitude(RATE, lag_s=0), LEVEL, 3), Body()
        for rate in (20.0, 50.0, 10.0):
            rates = [0.0] * 3
            rates[axis] = rate
            for _ in range(int(RATE)):
                body.turn(rates)
                f.update(*rates, *body.feels(), DT)
        assert getattr(f, name) == pytest.approx(80.0, abs=0.2)


def test_roll_then_yaw_is_not_roll_alone():
    """Body rates are not Euler rates: on its side, a turn about z is a pitch."""
    f, body = feed(Attitude(RATE, lag_s=0), LEVEL, 3), Body()
    for rates in ((90, 0, 0), (0, 0, 30)):
        for _ in range(int(RATE)):
            body.turn(rates)
            f.update(*rates, *body.feels(), DT)
    up = rotate_back(body.q, 0, 0, 1)
    assert tilt_error(f, up) < 0.3
    assert abs(f.pitch_deg) == pytest.approx(30, abs=0.5)


def test_without_an_accelerometer_the_gyro_is_kept():
    """Zero vector, free fall, not a number: the angle is the integral of a changing rate."""
    for nothing in ((0.0, 0.0, 0.0), (math.nan, 0.0, 1.0)):
        f = feed(Attitude(RATE, lag_s=0), LEVEL, 3)
        feed(f, (0, 0, 0, 0, 0, 0), 0.1)
        expected, last = 0.0, 0.0
        for i in range(250):
            rate = 100 * math.sin(i / 40) + 30
            expected += (rate + last) / 2 * DT
            last = rate
            f.update(rate, 0, 0, *nothing, DT)
        tolerance = 0.05 if nothing[0] == 0.0 else 8.0  # the last good one is kept: it says level
        assert f.roll_deg == pytest.approx(expected, abs=tolerance)


def test_a_gyro_that_is_not_a_number_is_the_last_one():
    f, g = (feed(Attitude(RATE), LEVEL, 3) for _ in range(2))
    f.update(50, 0, 0, 0, 0, 1, DT)
    g.update(50, 0, 0, 0, 0, 1, DT)
    f.update(math.nan, 0, 0, 0, 0, 1, DT)
    g.update(50, 0, 0, 0, 0, 1, DT)
    assert f.quaternion() == g.quaternion()


def test_never_an_accelerometer_from_the_start():
    f = Attitude(RATE, lag_s=0)
    for i in range(round(3 * RATE)):
        f.update(10.0 + 8 * math.cos(math.pi * 4 * i * DT), 0, 0, 0, 0, 0, DT)
    assert f.roll_deg == pytest.approx(30, abs=0.1)
    feed(f, (0, 0, 0, *gravity(-50, 20)), 6)
    assert tilt_error(f, gravity(-50, 20)) < 0.1


def test_exactly_upside_down_is_found():
    """180 degrees wrong, where the level part of gravity says that all is well."""
    f = feed(Attitude(RATE), LEVEL, 10)
    feed(f, (0, 0, 0, 0, 0, -1.0), 8)
    assert abs(f.roll_deg) == pytest.approx(180, abs=0.1)


def test_time_to_converge_after_a_knock_of_30_degrees():
    f = feed(Attitude(RATE), LEVEL, 10)
    target = gravity(30, 0)  # turned without the gyro having seen it
    feed(f, (0, 0, 0, *target), 5)
    assert tilt_error(f, target) < 5
    feed(f, (0, 0, 0, *target), 3)
    assert tilt_error(f, target) < 0.3


def test_an_impact_takes_back_what_it_adds():
    f = feed(Attitude(RATE), LEVEL, 10)
    for strength in (12.0, -12.0):
        feed(f, (0, 0, 0, strength, -strength / 2, 1.0 + strength / 3), 0.012)
    worst = 0.0
    for _ in range(1000):
        f.update(*LEVEL, DT)
        worst = max(worst, tilt_error(f, (0, 0, 1)))
    assert worst < 0.15


def test_saturated_samples_push_nothing():
    """Half an impact lost at the rail must not count as a velocity."""
    f = feed(Attitude(RATE, accel_range_g=8), LEVEL, 10)
    feed(f, (0, 0, 0, 8.0, 0, 1.0), 0.1)
    feed(f, LEVEL, 0.5)
    assert tilt_error(f, (0, 0, 1)) < 0.1
    g = feed(Attitude(RATE, accel_range_g=16, most_dps=1e3), LEVEL, 10)
    feed(g, (0, 0, 0, 8.0, 0, 1.0), 0.1)
    feed(g, LEVEL, 0.5)
    assert tilt_error(g, (0, 0, 1)) > 0.4  # the test can fail


def test_gyro_over_range_recovers():
    f, body = feed(Attitude(RATE, gyro_range_dps=500), LEVEL, 10), Body()
    for _ in range(100):
        body.turn((600, 0, 0))
        f.update(499.99, 0, 0, *body.feels(), DT)
    up = rotate_back(body.q, 0, 0, 1)
    assert tilt_error(f, up) > 20
    for seconds, tolerance in ((6, 5), (7, 0.75)):
        for _ in range(round(seconds * RATE)):
            body.turn((15, 5, 10))
            f.update(15, 5, 10, *body.feels(), DT)
        assert tilt_error(f, rotate_back(body.q, 0, 0, 1)) < tolerance


def test_bounded_motion_is_not_tilt():
    """Shaken by 0.4 g at 1.2 Hz without turning: a plain low-pass of this length sees 2 deg."""
    f = feed(Attitude(RATE), LEVEL, 5)
    worst = 0.0
    for i in range(round(20 * RATE)):
        f.update(0, 0, 0, 0.4 * math.cos(2 * math.pi * 1.2 * i * DT), 0, 1, DT)
        worst = max(worst, tilt_error(f, (0, 0, 1)) if i > 5 * RATE else 0.0)
    assert worst < 0.05


def test_motor_vibration_leaves_rest_alone():
    f = Attitude(RATE)
    worst = 0.0
    for i in range(round(10 * RATE)):
        shake = 0.5 * math.sin(2 * math.pi * 101.3 * i * DT)
        f.update(20 * shake, -10 * shake, 5 * shake, shake, -shake, 1 + shake, DT)
        worst = max(worst, tilt_error(f, (0, 0, 1)) if i > 4 * RATE else 0.0)
    assert worst < 0.4


def mpu6050_at_rest(rng, bias=(3.1, -2.2, 1.7)):
    """Datasheet noise at 44 Hz bandwidth, +-500 deg/s and +-8 g, in physical units."""
    gyro = [round((b + rng.gauss(0, 0.005 * math.sqrt(44 * 1.57))) * 65.5) / 65.5 for b in bias]
    accel = [round((a + rng.gauss(0, 4e-4 * math.sqrt(44 * 1.57))) * 4096) / 4096
             for a in gravity(12, -7)]
    return (*gyro, *accel)


def test_yaw_stands_still_at_rest():
    """Ten minutes; also from the start, where the bias was not known yet."""
    rng = random.Random(1)
    f = Attitude(RATE)
    for _ in range(round(3 * RATE)):
        f.update(*mpu6050_at_rest(rng), DT)
    low = high = f.yaw_deg
    for i in range(round(597 * RATE)):
        f.update(*mpu6050_at_rest(rng), DT)
        if i % 25 == 0:
            low, high = min(low, f.yaw_deg), max(high, f.yaw_deg)
    assert high - low < 0.1
    assert abs(f.yaw_deg) < 0.1
    assert f.at_rest
    assert f.bias_dps == pytest.approx((3.1, -2.2, 1.7), abs=0.01)


def test_slow_turning_is_not_rest_once_the_bias_is_known():
    f = feed(Attitude(RATE), LEVEL, 5)
    feed(f, (0, 0, 6.0, 0, 0, 1), 10)
    assert not f.at_rest
    assert f.yaw_deg == pytest.approx(60, abs=0.1)


@pytest.mark.parametrize("dps", [0.3, 0.5, 0.7, 1.0, -1.5, 3.0, 10.0])
@pytest.mark.parametrize("seconds", [2.0, 4.0, 8.0, 20.0])
@pytest.mark.parametrize("fixed", [False, True], ids=["float", "fixed"])
def test_a_slow_tilt_from_the_first_sample_on_is_not_claimed_as_rest(fixed, dps, seconds):
    """Nor what its rate would make of the tilt, taken for the bias."""
    f = FixedAttitude(RATE, 500, 8) if fixed else Attitude(RATE)
    body, bias, worst, t = Body(), (2.0, -1.5, 3.0), 0.0, 0.0
    while t < seconds + 8.0:
        rates = (dps, 0.0, 0.0) if t < seconds else (0.0, 0.0, 0.0)
        body.turn(rates)
        up = body.feels()
        gyro = [a + b for a, b in zip(rates, bias)]
        if fixed:
            f.update(array("h", [round(4096 * a) for a in up] + [0] + [
                round(65.5 * r) for r in gyro]), 4000)  # PS p. 12, 13: per g and deg/s
        else:
            f.update(*gyro, *up, DT)
        if not f.uncertain:
            worst = max(worst, tilt_error(f, up))
        t += DT
    assert not f.uncertain
    assert worst < (2.0 if abs(dps) > 0.5 else 2.2)  # a slower one ends within its first degree


def test_bias_is_learned_while_moving():
    f, body = feed(Attitude(RATE), LEVEL, 5), Body()
    bias = (0.8, -0.5, 0.6)
    for i in range(round(180 * RATE)):
        t = i * DT
        rates = (120 * math.sin(1.9 * t), 90 * math.sin(2.3 * t + 1), 70 * math.cos(1.1 * t))
        body.turn(rates)
        f.update(*(r + b for r, b in zip(rates, bias)), *body.feels(0.2 * math.cos(7 * t)), DT)
    assert not f.at_rest
    assert f.bias_dps == pytest.approx(bias, abs=0.2)
    assert tilt_error(f, rotate_back(body.q, 0, 0, 1)) < 0.8


def test_lag_is_made_good():
    """At 200 deg/s, 4.8 ms are 0.96 degrees."""
    now, then = Attitude(RATE), Attitude(RATE, lag_s=0)
    for f in (now, then):
        feed(f, LEVEL, 3)
        f.update(200, 0, 0, 0, 0, 1, DT)
    assert now.roll_deg - then.roll_deg == pytest.approx(0.96, abs=0.01)


def test_linear_acceleration():
    f = feed(Attitude(RATE), (0, 0, 0, *gravity(20, 10)), 3)
    assert f.linear_accel_g() == pytest.approx((0, 0, 0), abs=1e-6)
    x, y, z = gravity(20, 10)
    f.update(0, 0, 0, x + 0.3, y - 0.2, z + 0.1, DT)
    assert f.linear_accel_g() == pytest.approx((0.3, -0.2, 0.1), abs=1e-4)


def noisy_walk(n, seed=7):
    rng = random.Random(seed)
    return [[rng.gauss(0, s) for s in (60, 40, 80, 0.3, 0.3, 0.3)] for _ in range(n)]


def test_state_goes_on_identically():
    rows = noisy_walk(900)
    f, g = Attitude(RATE), Attitude(RATE)
    for row in rows[:501]:
        f.update(*row[:5], row[5] + 1)
    saved = f.state()
    for row in rows[501:]:
        f.update(*row[:5], row[5] + 1)
    g.set_state(saved)
    for row in rows[501:]:
        g.update(*row[:5], row[5] + 1)
    assert f.state() == g.state()
    assert f.quaternion() == g.quaternion()


def test_reset_forgets_all():
    f = Attitude(RATE)
    fresh = f.state()
    for row in noisy_walk(300):
        f.update(*row)
    assert f.state() != fresh
    f.reset()
    assert f.state() == fresh


def test_uneven_time_and_gaps():
    """Every third sample missing, and one gap of 100 ms at a steady rate."""
    f, body = feed(Attitude(RATE, lag_s=0), LEVEL, 4), Body()
    rng = random.Random(3)
    for i in range(600):
        dt = 0.1 if i == 300 else DT * rng.choice((1, 1, 2))
        body.turn((60, -25, 40), dt)
        f.update(60, -25, 40, *body.feels(), dt)
    # the start at full rate alone, within one sample, is half a sample wrong: 0.13 degrees
    assert tilt_error(f, rotate_back(body.q, 0, 0, 1)) < 0.15
    before = f.state()[0]
    f.update(60, -25, 40, 0, 0, 1, 0.0)
    assert f.state()[0] == pytest.approx(before, abs=1e-12)


def test_settings_are_checked():
    for bad in ({"rate_hz": 0}, {"tau_s": 0}, {"bias_tau_s": -1}):
        with pytest.raises(ValueError):
            Attitude(**bad)
    with pytest.raises(TypeError):
        Attitude(250, tau=3)


def test_quaternion_helpers_agree_with_matrices():
    q = unit((0.3, -0.4, 0.7, 0.2))
    w, x, y, z = q
    m = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])
    v = (0.2, -1.3, 0.5)
    assert rotate(q, *v) == pytest.approx(m @ v)
    assert rotate_back(q, *v) == pytest.approx(m.T @ v)


@pytest.mark.parametrize("path", recordings.files(), ids=lambda p: p.stem[:2])
def test_recorded_motion_beats_vqf(path):
    """VQF's own real-time figures on these three pieces, computed with the package vqf 2.1."""
    vqf = {"02": 0.387, "21": 1.586, "25": 0.385}[path.stem[:2]]
    rec = recordings.load(path)
    f = Attitude(rec.rate_hz)
    up = np.empty((len(rec), 3))
    for i, row in enumerate(rec.samples().tolist()):
        f.update(*row)
        up[i] = f.gravity()
    assert rec.rmse_deg(up) < vqf


def test_single_precision_is_enough():
    """On the board every float has 24 bits: round each state after each sample."""
    rec = recordings.load(recordings.files()[0])
    f, g = Attitude(rec.rate_hz), Attitude(rec.rate_hz)

    def single(x):
        if isinstance(x, float):
            return float(np.float32(x))
        return tuple(single(v) for v in x) if isinstance(x, tuple) else x

    worst = 0.0
    for row in rec.samples()[2000:6000].tolist():
        f.update(*row)
        g.update(*row)
        g.set_state(single(g.state()))
        worst = max(worst, tilt_error(f, g.gravity()))
    assert worst < 0.02


def test_imports_with_nothing_but_lib():
    lib = Path(__file__).parents[2] / "lib"
    code = ("import sys; sys.path[:0] = [%r]; from attitude import Attitude; f = Attitude(250);"
            "f.update(0, 0, 0, 0, 0, 1, 0.004); print(f.roll_deg)" % str(lib))
    done = subprocess.run([sys.executable, "-I", "-S", "-c", code], capture_output=True, text=True)
    assert done.stdout.strip() == "0.0", done.stderr

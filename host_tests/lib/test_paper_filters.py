# SPDX-License-Identifier: MIT
"""The papers' float filters against references written in numpy, in double and single precision.

The references use the matrix form of the equations, the filters the expanded one.
"""

import math

import numpy as np
import pytest
from attitude import (
    Complementary,
    GyroIntegral,
    Kalman1D,
    KalmanTilt,
    MovingAverage,
    accel_tilt_deg,
    tilt_asin_deg,
    tilt_atan_deg,
    tilt_two_axes_deg,
    wrap_deg,
    yaw_transfer_deg,
)

RATE_HZ = 250
BOUND_DEG = {np.float64: 1e-9, np.float32: 2e-3}
PRECISIONS = pytest.mark.parametrize("real", [np.float64, np.float32])


def sway(seconds=20.0, bias_dps=1.5, seed=3):
    """(true angle, accelerometer angle, gyro rate): a sway of 30 degrees, noise and gyro bias."""
    rng = np.random.default_rng(seed)
    t = np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    truth = 30 * np.sin(2 * math.pi * 0.4 * t) + 5 * np.sin(2 * math.pi * 1.7 * t)
    rate = np.gradient(truth, t) + bias_dps + rng.normal(0, 0.1, t.size)
    return truth, truth + rng.normal(0, 1.0, t.size), rate


def run(update, real, *columns):
    return np.array([update(*(real(x) for x in row)) for row in zip(*columns)], dtype=np.float64)


def kalman_reference(accel, gyro, dt, q_angle=0.001, q_bias=0.003, r=0.03):
    """Paper 000 eqs. 6-14 as matrices."""
    f = np.array([[1, -dt], [0, 1]])
    b = np.array([dt, 0])
    h = np.array([[1.0, 0.0]])
    q = np.diag([q_angle, q_bias]) * dt
    x, p, out = np.zeros(2), np.zeros((2, 2)), []
    for angle, rate in zip(accel, gyro):
        x = f @ x + b * rate
        p = f @ p @ f.T + q
        k = p @ h.T / (h @ p @ h.T + r)
        x = x + k[:, 0] * (angle - x[0])
        p = (np.eye(2) - k @ h) @ p
        out.append(x)
    return np.array(out)


@PRECISIONS
def test_kalman_tilt_is_the_matrix_filter(real):
    _, accel, gyro = sway()
    expected = kalman_reference(accel, gyro, 1 / RATE_HZ)
    filt = KalmanTilt()
    got = run(lambda a, g: filt.update(a, g, real(1 / RATE_HZ)), real, accel, gyro)
    assert np.abs(got - expected[:, 0]).max() < BOUND_DEG[real]
    assert filt.bias_dps == pytest.approx(expected[-1, 1], abs=BOUND_DEG[real])


def test_kalman_tilt_finds_the_bias_and_the_angle():
    truth, accel, gyro = sway(bias_dps=1.5)
    filt = KalmanTilt()
    out = np.array([(filt.update(a, g, 1 / RATE_HZ), filt.bias_dps) for a, g in zip(accel, gyro)])
    late = slice(-5 * RATE_HZ, None)
    got, bias = out[:, 0], out[late, 1]
    assert bias.mean() == pytest.approx(1.5, abs=0.1)
    assert np.sqrt(np.mean((got - truth)[late] ** 2)) < 0.25
    assert np.sqrt(np.mean((accel - truth)[late] ** 2)) > 0.9


@PRECISIONS
def test_complementary_is_equation_1(real):
    _, accel, gyro = sway()
    angle, expected = 0.0, []
    for a, g in zip(accel, gyro):
        angle = 0.95 * (angle + g / RATE_HZ) + 0.05 * a
        expected.append(angle)
    filt = Complementary(alpha=0.95)
    got = run(lambda a, g: filt.update(a, g, real(1 / RATE_HZ)), real, accel, gyro)
    assert np.abs(got - expected).max() < BOUND_DEG[real]


def test_tau_means_the_same_at_each_rate_and_alpha_converts_to_it():
    for rate_hz in (80, 250, 1000):
        filt = Complementary(tau_s=0.5)
        for _ in range(rate_hz // 2):
            filt.update(10.0, 0.0, 1 / rate_hz)
        assert filt.angle_deg == pytest.approx(10 * (1 - math.exp(-1)), abs=0.05)
    # paper 001's 0.9996 at 250 Hz is 10 seconds
    assert Complementary(alpha=0.9996, rate_hz=250).tau_s == pytest.approx(9.996)
    as_printed = Complementary(alpha=0.9)
    converted = Complementary(alpha=0.9, rate_hz=100)
    for accel, gyro in ((3.0, 10.0), (4.0, -5.0), (1.0, 0.0)):
        assert as_printed.update(accel, gyro, 0.01) == pytest.approx(
            converted.update(accel, gyro, 0.01), abs=1e-12
        )


@PRECISIONS
def test_kalman1d_is_equation_15(real):
    _, accel, _ = sway()
    x, p, expected = 0.0, 1.05, []
    for m in accel:
        p = p + 0.125
        k = p / (p + 10.0)
        x = x + k * (m - x)
        p = (1 - k) * p
        expected.append(x)
    filt = Kalman1D(q=0.125, r=10.0, p=1.05)
    got = run(filt.update, real, accel)
    assert np.abs(got - expected).max() < BOUND_DEG[real]


def test_kalman1d_without_process_noise_is_the_mean_since_the_start():
    """Paper 001 eqs. 9-11: why its filter cannot follow, and q is there."""
    values = [5.0] * 500 + [25.0] * 500
    stiff, alive = Kalman1D(q=0.0, r=4.0, p=1e9), Kalman1D(q=0.125, r=10.0)
    for v in values:
        stiff.update(v)
        alive.update(v)
    assert stiff.value == pytest.approx(15.0, abs=1e-3)
    assert alive.value == pytest.approx(25.0, abs=1e-3)


def test_kalman1d_with_the_gyro_is_paper_004s_program():
    truth, accel, gyro = sway(bias_dps=0.0)
    state, uncertainty, expected = 0.0, 2 * 2, []
    for a, g in zip(accel, gyro):
        state = state + 0.004 * g
        uncertainty = uncertainty + 0.004 * 0.004 * 4 * 4
        gain = uncertainty / (uncertainty + 3 * 3)
        state = state + gain * (a - state)
        uncertainty = (1 - gain) * uncertainty
        expected.append(state)
    filt = Kalman1D(q=(4 * 0.004) ** 2, r=9, p=4)
    got = run(lambda a, g: filt.update(a, g * 0.004), float, accel, gyro)
    assert np.abs(got - expected).max() < 1e-9
    assert np.abs((got - truth)[-1000:]).max() < 0.6


@PRECISIONS
def test_moving_average_is_the_mean_of_the_last_n(real):
    _, accel, _ = sway()
    filt = MovingAverage(50)
    got = run(filt.update, real, accel)
    expected = [np.mean(accel[max(0, i - 49) : i + 1]) for i in range(accel.size)]
    assert np.abs(got - expected).max() < (1e-10 if real is np.float64 else 1e-4)


def test_moving_average_forgets_what_has_left_it():
    """In single precision a plain running sum keeps the rounding of 1e6 for ever."""
    filt = MovingAverage(10)
    for value in [np.float32(1e6)] * 7 + [np.float32(0.1)] * 30:
        filt.update(value)
    assert abs(float(filt.mean) - 0.1) < 1e-6


def test_moving_average_state_in_order():
    filt = MovingAverage(4)
    for value in (1.0, 2.0):
        filt.update(value)
    assert filt.state() == [1.0, 2.0]
    for value in (3.0, 4.0, 5.0):
        filt.update(value)
    assert filt.state() == [2.0, 3.0, 4.0, 5.0]


@PRECISIONS
def test_gyro_integral_is_the_trapezoid_rule(real):
    _, _, gyro = sway()
    integral = GyroIntegral()
    got = run(lambda g: integral.update(g, real(1 / RATE_HZ)), real, gyro)
    with_zero = np.concatenate([[0.0], gyro])
    expected = [np.trapezoid(with_zero[: i + 2]) / RATE_HZ for i in range(gyro.size)]
    assert np.abs(got - expected).max() < (1e-9 if real is np.float64 else 2e-3)
    assert integral.increment_deg == pytest.approx((gyro[-2] + gyro[-1]) / 2 / RATE_HZ, abs=1e-6)


# --- accelerometer angles ---------------------------------------------------------------------


def gravity(roll_deg, pitch_deg):
    """What a resting sensor reads at this attitude: Rx(-roll) Ry(-pitch) applied to +z."""
    r, p = math.radians(roll_deg), math.radians(pitch_deg)
    return -math.sin(p), math.sin(r) * math.cos(p), math.cos(r) * math.cos(p)


@pytest.mark.parametrize("roll", [-179, -100, -45, 0, 30, 89, 135])
@pytest.mark.parametrize("pitch", [-89, -40, 0, 12, 75])
def test_accel_tilt_inverts_gravity_everywhere(roll, pitch):
    assert accel_tilt_deg(*gravity(roll, pitch)) == pytest.approx((roll, pitch), abs=1e-6)


@pytest.mark.parametrize("form", [tilt_two_axes_deg, tilt_asin_deg, tilt_atan_deg])
@pytest.mark.parametrize("angle", [-60, -10, 0, 20, 80])
def test_each_papers_form_is_right_about_one_axis(form, angle):
    assert form(*gravity(angle, 0)) == pytest.approx((angle, 0), abs=1e-6)
    assert form(*gravity(0, angle)) == pytest.approx((0, angle), abs=1e-6)


def test_each_papers_form_away_from_one_axis():
    force = gravity(60, 10)
    assert tilt_two_axes_deg(*force)[1] == pytest.approx(19.4254, abs=1e-3)
    upside_down = gravity(180, 0)
    assert abs(tilt_two_axes_deg(*upside_down)[0]) == pytest.approx(180)
    assert tilt_asin_deg(*upside_down)[0] == pytest.approx(0, abs=1e-6)
    assert tilt_atan_deg(*upside_down)[0] == pytest.approx(0, abs=1e-6)
    assert tilt_asin_deg(*force) == pytest.approx(tilt_atan_deg(*force), abs=1e-6)


@pytest.mark.parametrize(
    "form", [accel_tilt_deg, tilt_two_axes_deg, tilt_asin_deg, tilt_atan_deg]
)
def test_ideal_and_absurd_accelerations(form):
    assert form(0.0, 0.0, 0.0) == (0, 0)
    assert form(0.0, 0.0, 1.0) == (0, 0)
    for force in ((1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0), (3e-30, 4e-30, 0.0)):
        assert all(math.isfinite(a) and abs(a) <= 180 for a in form(*force))
    # the quotient by a norm in single precision may exceed 1
    for k in range(200):
        x = np.float32(0.003 + k * 0.01)
        assert all(math.isfinite(a) for a in form(x, np.float32(1e-5), np.float32(0)))


def test_the_papers_sign_of_ax_fights_the_gyro():
    """Paper 001 eq. 6 as printed: gyro y positive, accelerometer angle negative."""
    ax, ay, az = gravity(0, 10)
    printed = math.degrees(math.asin(ax / math.sqrt(ax * ax + ay * ay + az * az)))
    assert printed == pytest.approx(-10)
    assert tilt_asin_deg(ax, ay, az)[1] == pytest.approx(10)


def test_yaw_transfer_carries_the_tilt_round_and_closes_the_circle():
    roll, pitch = 10.0, 0.0
    for _ in range(90):
        roll, pitch = yaw_transfer_deg(roll, pitch, 1.0)
    # a quarter turn to the left: what was on the left is in front
    assert (roll, pitch) == pytest.approx((0.0, -10.0), abs=0.1)
    for _ in range(270 + 3600):
        roll, pitch = yaw_transfer_deg(roll, pitch, 1.0)
    assert math.hypot(roll, pitch) == pytest.approx(10.0, abs=0.1)


def test_yaw_transfer_agrees_with_a_rotated_gravity_vector():
    roll, pitch, step = 4.0, -3.0, 2.0
    x, y, z = gravity(roll, pitch)
    c, s = math.cos(math.radians(step)), math.sin(math.radians(step))
    turned = (c * x + s * y, -s * x + c * y, z)  # seen from a frame that turned by +step
    assert yaw_transfer_deg(roll, pitch, step) == pytest.approx(accel_tilt_deg(*turned), abs=0.02)


# --- misprints that matter ----------------------------------------------------------------------


def test_printed_gain_of_equation_24_is_not_the_filter():
    """K[0] = P01 / S, as paper 000 prints, leaves the angle to the gyro and its drift."""
    truth, accel, gyro = sway(bias_dps=1.5)
    dt, q_angle, q_bias, r = 1 / RATE_HZ, 0.001, 0.003, 0.03
    angle = bias = p00 = p01 = p10 = p11 = 0.0
    worst = 0.0
    for a, g, t in zip(accel, gyro, truth):
        angle += dt * (g - bias)
        p00 += dt * (dt * p11 - p01 - p10 + q_angle)
        p01 -= dt * p11
        p10 -= dt * p11
        p11 += q_bias * dt
        s = p00 + r
        k0, k1 = p01 / s, p10 / s
        angle += k0 * (a - angle)
        bias += k1 * (a - angle)
        p00, p01, p10, p11 = p00 - k0 * p00, p01 - k0 * p01, p10 - k1 * p00, p11 - k1 * p01
        worst = max(worst, abs(angle - t))
    assert worst > 5


def test_printed_blend_of_paper_001_keeps_the_drift():
    """Eq. 7 read literally, 0.9996 of the gyro's own sum, against the filter."""
    truth, accel, gyro = sway(seconds=60, bias_dps=1.0)
    integral = GyroIntegral()
    filt = Complementary(alpha=0.9996)
    for a, g in zip(accel, gyro):
        printed = 0.9996 * integral.update(g, 1 / RATE_HZ) + 0.0004 * a
        good = filt.update(a, g, 1 / RATE_HZ)
    assert abs(printed - truth[-1]) > 50
    assert abs(good - truth[-1]) < 11  # tau 10 s x bias 1 deg/s: what alpha 0.9996 leaves


def test_printed_pseudo_code_of_paper_002_adds_the_turn_again_and_again():
    integral, filt = GyroIntegral(), Complementary(alpha=0.95)
    printed = 0.0
    for k in range(200):
        rate = 100.0 if k < 20 else 0.0
        angle = integral.update(rate, 0.01)
        printed = 0.95 * (printed + angle) + 0.05 * angle
        filt.update(angle, rate, 0.01)
    assert printed > 300
    assert filt.angle_deg == pytest.approx(20, abs=1)


def test_printed_sign_of_equation_25_runs_away():
    values = [float(k) for k in range(100)]
    mean = sum(values[:50]) / 50
    for k in range(50, 100):
        mean = mean + (values[k - 50] - values[k]) / 50
    assert mean == pytest.approx(-25.5)
    filt = MovingAverage(50)
    for v in values:
        filt.update(v)
    assert filt.mean == pytest.approx(74.5)


# --- the ideal and the absurd -------------------------------------------------------------------


@pytest.mark.parametrize("make", [Complementary, lambda: Complementary(tau_s=0.5), KalmanTilt])
def test_roll_through_180_degrees_is_no_jump(make):
    filt = make()
    filt.reset(170.0)
    for k in range(400):
        angle = wrap_deg(170.0 + 0.05 * k)
        got = filt.update(angle, 0.05 * RATE_HZ, 1 / RATE_HZ)
        assert abs(wrap_deg(got - angle)) < 0.2
        assert -180 <= got < 180


@pytest.mark.parametrize("make", [Complementary, KalmanTilt])
def test_level_and_noise_free_stays_level(make):
    filt = make()
    for _ in range(1000):
        assert filt.update(0.0, 0.0, 0.004) == 0.0


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_sample_that_is_no_number_leaves_no_trace(bad):
    for filt in (Complementary(), KalmanTilt()):
        for _ in range(500):
            filt.update(10.0, 0.0, 0.004)
        before = filt.angle_deg
        filt.update(bad, 0.0, 0.004)
        filt.update(10.0, bad, 0.004)
        assert filt.angle_deg == pytest.approx(before, abs=0.01)
    one, mean = Kalman1D(), MovingAverage(3)
    for value in (2.0, bad, 4.0):
        one.update(value, bad)
        mean.update(value)
    assert math.isfinite(one.value)
    assert mean.mean == 3.0


def test_zero_variances_do_not_divide_by_zero():
    silent = Kalman1D(q=0.0, r=0.0, p=0.0)
    assert silent.update(5.0) == 0.0
    filt = KalmanTilt(q_angle=0.0, q_bias=0.0)
    assert filt.update(5.0, 0.0, 0.0) == 0.0


def test_state_makes_a_run_resumable():
    _, accel, gyro = sway()
    for make in (Complementary, KalmanTilt):
        whole, resumed = make(), make()
        for k, (a, g) in enumerate(zip(accel, gyro)):
            if k == 700:
                state = whole.state()
                resumed.reset(*state if isinstance(state, tuple) else (state,))
            if k >= 700:
                assert resumed.update(a, g, 0.004) == whole.update(a, g, 0.004)
            else:
                whole.update(a, g, 0.004)
        whole.reset()
        fresh = make()
        assert whole.update(3.0, 1.0, 0.004) == fresh.update(3.0, 1.0, 0.004)


@pytest.mark.parametrize(
    "build",
    [
        lambda: Complementary(alpha=1.5),
        lambda: Complementary(tau_s=-1),
        lambda: Complementary(alpha=1.0, rate_hz=250),
        lambda: Kalman1D(q=-1),
        lambda: KalmanTilt(r_measure=0),
        lambda: MovingAverage(0),
    ],
)
def test_bad_settings_are_refused(build):
    with pytest.raises(ValueError):
        build()


def test_an_unknown_name_is_an_attribute_error():
    import attitude

    with pytest.raises(AttributeError, match="attitude has no Nonsense"):
        attitude.Nonsense  # noqa: B018

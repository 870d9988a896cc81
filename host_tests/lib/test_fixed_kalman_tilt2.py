# SPDX-License-Identifier: MIT
"""KalmanTilt2 against two KalmanTilt in double precision, written anew in numpy."""

from array import array

import numpy as np
import pytest
from attitude.fixed import KalmanTilt2
from attitude.fixed.gains import gain_rows

from host_tests.lib.fixed_inputs import Skewed, recorded

EXCERPTS = (
    "02_undisturbed_slow_rotation_B",
    "21_undisturbed_fast_combined",
    "25_disturbed_tapping_B",
)
LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
LSB_PER_G = {2: 16384.0, 4: 8192.0, 8: 4096.0, 16: 2048.0}


def wrap(deg):
    return (deg + 180.0) % 360.0 - 180.0


def tilt(accel):
    x, y, z = accel
    return np.degrees([np.arctan2(y, z), np.arctan2(-x, np.hypot(y, z))])


def twin(rows, rate_hz, gyro_dps, accel_g, cal=None, q_angle=0.001, q_bias=0.003, r=0.03):
    """(n x 2) roll and pitch; paper 000, eqs. 6-14, as matrices, started on the first sample."""
    dt = 1.0 / rate_hz
    f, p = np.array([[1.0, -dt], [0.0, 1.0]]), np.zeros((2, 2))
    angle, bias, out = tilt(rows[0][:3]), np.zeros(2), []
    if cal:
        gm, am = np.reshape(cal.gyro_matrix, (3, 3)), np.reshape(cal.accel_matrix, (3, 3))
    for n, row in enumerate(rows):
        accel = np.array(row[:3]) / LSB_PER_G[accel_g]
        gyro = np.array(row[4:]) / LSB_PER_DPS[gyro_dps]
        if cal:
            accel, gyro = am @ (accel - cal.accel_bias_g), gm @ (gyro - cal.gyro_bias_dps)
        if n == 0:
            angle = tilt(accel)
        angle = angle + dt * (gyro[:2] - bias)
        p = f @ p @ f.T + np.diag([q_angle, q_bias]) * dt
        gain = p[:, 0] / (p[0, 0] + r)
        y = wrap(tilt(accel) - angle)
        angle, bias = wrap(angle + gain[0] * y), bias + gain[1] * y
        p = p - np.outer(gain, p[0])
        out.append(angle)
    return np.array(out)


def run(filt, rows):
    counts, out = array("h", [0] * 7), []
    for row in rows:
        counts[:] = array("h", row)
        filt.update(counts)
        out.append((filt.roll_mdeg, filt.pitch_mdeg))
    return np.array(out) / 1000.0


def rms(difference):
    return np.sqrt(np.mean(wrap(difference) ** 2, axis=0)).max()


@pytest.mark.parametrize("rate_hz", [80, 250, 1000])
@pytest.mark.parametrize(
    "q_angle, q_bias, r", [(0.001, 0.003, 0.03), (0.1, 0.001, 0.5), (1e-5, 1e-6, 0.001)]
)
def test_the_gains_are_those_of_the_recursion_sample_by_sample(rate_hz, q_angle, q_bias, r):
    table, shift0, shift1 = gain_rows(rate_hz, q_angle, q_bias, r)
    dt = 1.0 / rate_hz
    f, p = np.array([[1.0, -dt], [0.0, 1.0]]), np.zeros((2, 2))
    k0, k1 = table[:2]
    knots = {0}
    for n in table[2::3]:
        knots.add(max(knots) + n)
    steps = iter(zip(table[2::3], table[3::3], table[4::3], strict=True))
    for n in range(max(knots) + 1):
        p = f @ p @ f.T + np.diag([q_angle, q_bias]) * dt
        gain = p[:, 0] / (p[0, 0] + r)
        p = p - np.outer(gain, p[0])
        if n in knots:
            assert k0 / 2 ** (30 + shift0) == pytest.approx(gain[0], rel=1e-4)
            assert k1 / 2 ** (30 + shift1) / 64 * rate_hz == pytest.approx(
                gain[1], rel=1e-4, abs=1e-9
            )
            samples, d0, d1 = next(steps)
            k0, k1 = k0 + samples * d0, k1 + samples * d1


@pytest.mark.parametrize(
    "name",
    ["02_undisturbed_slow_rotation_B", "21_undisturbed_fast_combined", "25_disturbed_tapping_B"],
)
def test_recordings_agree_with_double_precision(name):
    rows, rate_hz = recorded(name, 5, 20)
    assert rms(run(KalmanTilt2(rate_hz, 2000, 16), rows) - twin(rows, rate_hz, 2000, 16)) < 0.005


@pytest.mark.parametrize(
    "rate_hz,gyro_dps,accel_g", [(80, 250, 2), (333.3, 1000, 4), (1000, 500, 8)]
)
def test_rates_and_ranges_agree_with_double_precision(rate_hz, gyro_dps, accel_g):
    rows, _ = recorded("02_undisturbed_slow_rotation_B", 5, 10, gyro_dps, accel_g)
    filt = KalmanTilt2(rate_hz, gyro_dps, accel_g)
    assert rms(run(filt, rows) - twin(rows, rate_hz, gyro_dps, accel_g)) < 0.005


def test_settings_agree_with_double_precision():
    rows, rate_hz = recorded("25_disturbed_tapping_B", 5, 10)
    settings = {"q_angle": 0.04, "q_bias": 0.4}
    filt = KalmanTilt2(rate_hz, 2000, 16, r_measure=0.43, **settings)
    assert rms(run(filt, rows) - twin(rows, rate_hz, 2000, 16, r=0.43, **settings)) < 0.005


def test_a_calibration_is_folded_in():
    rows, rate_hz = recorded("02_undisturbed_slow_rotation_B", 5, 10)
    filt = KalmanTilt2(rate_hz, 2000, 16)
    filt.calibrate(Skewed)
    out = run(filt, rows)
    assert rms(out - twin(rows, rate_hz, 2000, 16, Skewed)) < 0.02
    assert rms(out - twin(rows, rate_hz, 2000, 16)) > 10  # it does something


def test_the_period_is_corrected():
    rows, rate_hz = recorded("02_undisturbed_slow_rotation_B", 5, 10)
    filt = KalmanTilt2(rate_hz, 2000, 16)
    filt.period_us = 1.02e6 / rate_hz
    slower = run(filt, rows)
    # the gains stay those of the nominal rate, which matters little
    assert rms(slower - twin(rows, rate_hz / 1.02, 2000, 16)) < 0.05
    with pytest.raises(ValueError, match=r"must be 3325.0 to 3675.0"):
        filt.period_us = 5e6 / rate_hz
    assert filt.period_us == pytest.approx(1.02e6 / rate_hz, rel=1e-4)


def level(angle_deg, n):
    a = np.radians(angle_deg)
    return [[0, round(4096 * np.sin(a)), round(4096 * np.cos(a)), 0, 0, 0, 0]] * n


def test_roll_goes_the_short_way_through_180_degrees():
    filt = KalmanTilt2()
    run(filt, level(179.0, 250))
    angles = run(filt, level(-179.0, 500))[:, 0]
    assert np.all(np.abs(angles) > 178.5)
    assert angles[-1] == pytest.approx(-179.0, abs=0.1)


def test_free_fall_and_the_zero_vector_leave_the_prediction():
    filt = KalmanTilt2()
    run(filt, level(20.0, 250))
    before = filt.roll_mdeg
    out = run(filt, [[0, 0, 0, 0, 655, 0, 0]] * 250)  # 10 deg/s for a second
    assert out[-1, 0] == pytest.approx(before / 1000 + 10.0, abs=0.05)


def test_an_untrusted_acceleration_corrects_nothing_and_a_good_one_as_ever():
    shaken = KalmanTilt2(trust_g=0.3)
    run(shaken, level(0.0, 500))
    assert abs(run(shaken, [[0, 4096, 4096, 0, 0, 0, 0]] * 50)[-1, 0]) < 0.01  # 1.41 g
    plain, same = KalmanTilt2(), KalmanTilt2(trust_g=0.3)
    rows = level(10.0, 100) + level(12.0, 300)
    assert rms(run(plain, rows) - run(same, rows)) < 0.01


def test_a_state_continues_where_it_was_taken():
    rows, rate_hz = recorded("25_disturbed_tapping_B", 5, 2)
    whole, first, second = (KalmanTilt2(rate_hz, 2000, 16) for _ in range(3))
    expected = run(whole, rows)[200:]
    run(first, rows[:200])
    second.set_state(first.state())
    assert np.array_equal(run(second, rows[200:]), expected)
    first.reset()
    assert np.array_equal(run(first, rows)[200:], expected)


def test_bad_settings_are_refused_with_the_allowed_ones():
    with pytest.raises(ValueError, match="250, 500, 1000, 2000"):
        KalmanTilt2(gyro_dps=300)
    with pytest.raises(ValueError, match="2, 4, 8, 16"):
        KalmanTilt2(accel_g=3)
    with pytest.raises(ValueError, match="rate_hz"):
        KalmanTilt2(rate_hz=5)
    with pytest.raises(ValueError, match="state of"):
        KalmanTilt2().set_state((1, 2))

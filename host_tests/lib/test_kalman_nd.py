# SPDX-License-Identifier: MIT
"""KalmanND against numpy and scipy; paper 001's example of GPS and accelerometer."""

import math

import numpy as np
import pytest
import scipy.linalg
from attitude import KalmanND, KalmanTilt

DT = 0.1
F = [[1.0, DT], [0.0, 1.0]]
B = [[DT * DT / 2], [DT]]
H = [[1.0, 0.0]]


def random_system(n, m, seed):
    rng = np.random.default_rng(seed)
    f = rng.normal(size=(n, n))
    f *= 0.95 / max(abs(np.linalg.eigvals(f)))
    q, r = rng.normal(size=(n, n)), rng.normal(size=(m, m))
    return f, rng.normal(size=(m, n)), q @ q.T, r @ r.T + np.eye(m), rng.normal(size=(n, 2))


@pytest.mark.parametrize("n,m", [(1, 1), (2, 1), (3, 2), (4, 4), (6, 3)])
def test_equals_the_textbook_form(n, m):
    f, h, q, r, b = random_system(n, m, seed=n)
    filt = KalmanND(f.tolist(), h.tolist(), q.tolist(), r.tolist(), b.tolist())
    x, p = np.zeros(n), np.eye(n)
    rng = np.random.default_rng(9)
    for _ in range(50):
        u, z = rng.normal(size=2), rng.normal(size=m)
        x, p = f @ x + b @ u, f @ p @ f.T + q
        k = p @ h.T @ np.linalg.inv(h @ p @ h.T + r)
        x, p = x + k @ (z - h @ x), (np.eye(n) - k @ h) @ p
        got = filt.update(z.tolist(), u.tolist())
        assert got == pytest.approx(x, rel=1e-9, abs=1e-9)
        assert np.array(filt.P) == pytest.approx(p, rel=1e-8, abs=1e-9)


@pytest.mark.parametrize("n,m", [(2, 1), (4, 2)])
def test_steady_gain_solves_the_riccati_equation(n, m):
    f, h, q, r, _ = random_system(n, m, seed=20 + n)
    filt = KalmanND(f.tolist(), h.tolist(), q.tolist(), r.tolist())
    gain = filt.use_steady_gain(1e-12)
    p = scipy.linalg.solve_discrete_are(f.T, h.T, q, r)
    assert np.array(gain) == pytest.approx(p @ h.T @ np.linalg.inv(h @ p @ h.T + r), rel=1e-6)
    before = [row[:] for row in filt.P]
    filt.update([1.0] * m)
    assert before == filt.P and gain == filt.K


def test_an_unobservable_state_has_no_steady_gain():
    filt = KalmanND([[1.0, 0.0], [0.0, 4.0]], H, [[1.0, 0.5], [0.5, 1.0]], [[1.0]])
    with pytest.raises(ValueError, match="not settled"):
        filt.use_steady_gain(most=300)


def test_josephs_form_lives_where_the_papers_form_goes_deaf():
    """Single precision, a precise measurement of a badly known state: 1 - K rounds to zero."""
    one = np.float32
    filt = KalmanND(
        [[one(1), one(1)], [one(0), one(1)]], [[one(1), one(0)]], [[one(0)] * 2] * 2,
        [[one(1e-4)]], P=[[one(1e6), one(0)], [one(0), one(1e6)]],
    )
    f, h = np.array([[1.0, 1.0], [0.0, 1.0]]), np.array([[1.0, 0.0]])
    exact, printed = np.eye(2) * 1e6, np.eye(2, dtype=one) * one(1e6)
    for _ in range(30):
        filt.update([one(1)])
        exact = f @ exact @ f.T
        k = exact @ h.T / (h @ exact @ h.T + 1e-4)
        exact = (np.eye(2) - k @ h) @ exact
        printed = f.astype(one) @ printed @ f.T.astype(one)
        k = printed @ h.T.astype(one) / (printed[0, 0] + one(1e-4))
        printed = (np.eye(2, dtype=one) - k @ h.astype(one)) @ printed
    assert printed[0, 0] == 0 and exact[0, 0] > 1e-5
    assert filt.P[0][0].dtype == one
    assert 0.3 * exact[0, 0] < filt.P[0][0] < 3 * exact[0, 0]


def test_two_states_are_kalman_tilt():
    dt = 0.004
    nd = KalmanND(
        [[1.0, -dt], [0.0, 1.0]], H, [[0.001 * dt, 0.0], [0.0, 0.003 * dt]], [[0.03]],
        B=[[dt], [0.0]], P=[[0.0, 0.0], [0.0, 0.0]],
    )
    tilt = KalmanTilt()
    rng = np.random.default_rng(4)
    for k in range(2000):
        accel, gyro = 20 * math.sin(k / 200) + rng.normal(), 25 * math.cos(k / 200) + 1.0
        assert nd.update([accel], [gyro])[0] == pytest.approx(
            tilt.update(accel, gyro, dt), abs=1e-9
        )


def test_gps_and_accelerometer_together_beat_each_alone():
    rng = np.random.default_rng(1)
    filt = KalmanND(F, H, [[1e-4, 0.0], [0.0, 1e-3]], [[9.0]], B, P=[[9.0, 0.0], [0.0, 1.0]])
    position = velocity = dead_position = dead_velocity = 0.0
    errors = []
    for k in range(3000):
        accel = math.sin(k * DT / 5)
        position += velocity * DT + accel * DT * DT / 2
        velocity += accel * DT
        measured = accel + 0.02 + rng.normal(0, 0.2)
        dead_position += dead_velocity * DT + measured * DT * DT / 2
        dead_velocity += measured * DT
        filt.predict([measured])
        if k % 10 == 0:
            gps = position + rng.normal(0, 3)
            filt.correct([gps])
            errors.append((filt.x[0] - position, gps - position, dead_position - position))
    fused, gps, dead = np.sqrt(np.mean(np.square(errors[30:]), axis=0))
    assert gps == pytest.approx(3.0, rel=0.1)
    assert dead > 50
    assert fused < 0.6 * gps


def test_wrong_shapes_and_singular_matrices_are_named():
    with pytest.raises(ValueError, match="H must be 1 x 2"):
        KalmanND(F, [[1.0]], [[0.0] * 2] * 2, [[1.0]])
    with pytest.raises(ValueError, match="B must be 2 x 1"):
        KalmanND(F, H, [[0.0] * 2] * 2, [[1.0]], B=[[1.0]])
    silent = KalmanND(F, H, [[0.0] * 2] * 2, [[0.0]], P=[[0.0] * 2] * 2)
    with pytest.raises(ValueError, match="singular"):
        silent.update([1.0])

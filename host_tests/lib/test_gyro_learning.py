# SPDX-License-Identifier: MIT
"""A gyro that calibrates itself while it moves: what it learns, believes and claims."""

from array import array

import numpy as np
import pytest
from attitude import Attitude, fixed
from attitude.gyro_learning import GyroLearning
from attitude.profiles import PROFILES
from attitude.quaternion import product

from tools import recordings
from tools.accuracy.motions import G, Motion, begin, by_hand, shaken

WRONG = np.array([[1.021, 0.004, -0.003], [-0.004, 0.982, 0.005], [0.002, -0.003, 1.015]])


def run(filt, rows, dt_s):
    """(n x 4) attitudes after each sample, and what it claimed with each: (n x 3) sigma of tilt
    and yaw in degrees, uncertain."""
    quats, claims, claim = [], [], None
    for i, row in enumerate(rows.tolist()):
        filt.update(*row, dt_s)
        quats.append(filt.quaternion())
        if i % 10 == 0:
            claim = filt.tilt_sigma_deg, filt.yaw_sigma_deg, filt.uncertain
        claims.append(claim)
    return np.array(quats), np.array(claims, float)


def tracked(motion, rows, **settings):
    filt = Attitude(motion.rate_hz, lag_s=0, **settings)
    return (filt, *run(filt, rows, 1 / motion.rate_hz))


def test_scale_and_cross_axis_are_learned_in_motion():
    motion = Motion(180, by_hand, shaken)
    filt, quats, _ = tracked(motion, motion.read(WRONG, (3.0, -2.0, 4.0)))
    scale, sigma, bias, bias_sigma = filt.learned()
    assert scale == pytest.approx(1 - 1 / np.diag(WRONG), abs=0.003)
    assert max(sigma) < 0.003
    assert bias == pytest.approx((3.0, -2.0, 4.0), abs=0.15) and max(bias_sigma) < 0.2
    late = motion.t > 60
    assert motion.tilt_error_deg(quats)[late].max() < 0.6
    fixed = tracked(motion, motion.read(WRONG, (3.0, -2.0, 4.0)), scale_sigma=0, cross_sigma=0)
    assert motion.tilt_error_deg(fixed[1])[late].max() > 2.0


def test_a_good_gyro_is_left_alone():
    motion = Motion(120, by_hand, shaken)
    filt, quats, _ = tracked(motion, motion.read())
    assert filt.learned()[0] == pytest.approx((0, 0, 0), abs=0.002)
    assert motion.tilt_error_deg(quats).max() < 0.7


@pytest.mark.parametrize("bias", [2.0, 5.0, 15.0])
@pytest.mark.parametrize("axis", [0, 1])
def test_switched_on_while_swinging(bias, axis):
    def angles(t):
        swing = 10 * np.sin(np.pi * t + axis)
        return (swing, 0 * t, 0 * t) if axis == 0 else (0 * t, swing, 0 * t)

    motion = Motion(20, angles, rate_hz=250.0)
    _, quats, claims = tracked(motion, motion.read(bias=(bias, -0.8 * bias, 0.6 * bias)))
    error = motion.tilt_error_deg(quats)
    assert error[motion.t > 5].max() < 2.0
    assert error[motion.t > 15].max() < 0.7
    claimed = claims[:, 2] == 0
    assert error[claimed].max() < 2.0 and claimed[motion.t > 15].all() and not claimed[100:].all()


@pytest.mark.parametrize("rate_dps", [0.3, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("rest_s", [3.0, 10.0])
def test_a_slow_turn_after_a_rest_is_no_bias(rate_dps, rest_s):
    motion = Motion(rest_s + 60, lambda t: (0 * t, 0 * t, rate_dps * np.maximum(t - rest_s, 0)))
    _, quats, _ = tracked(motion, motion.read(bias=(3.0, -2.0, 5.0)))
    error = motion.yaw_error_deg(quats)
    assert abs(error[-1] - error[round(100 * rest_s) - 20]) < 0.03 * 60 * rate_dps


def test_a_tilt_at_power_on_is_no_rest():
    """5 deg/s of tilt for 3 s: a steady rate, but the accelerometer sees it."""
    motion = Motion(8, lambda t: (5.0 * np.minimum(t, 3.0), 0 * t, 0 * t))
    filt, quats, _ = tracked(motion, motion.read())
    assert motion.tilt_error_deg(quats)[-1] < 0.5
    assert filt.bias_dps[0] == pytest.approx(0.0, abs=0.2)


def test_a_gyro_that_warms_without_a_rest():
    """5 deg/s within 20 minutes, as the datasheet has it for 15 degC."""
    motion = Motion(1200, by_hand, shaken, rate_hz=80.0)
    rows = motion.read()
    rows[:, :3] += np.outer(motion.t / 1200, (5.0, -4.0, 5.0))
    _, quats, _ = tracked(motion, rows)
    assert motion.tilt_error_deg(quats).max() < 0.7


def brake(t, at_s=20.0, for_s=5.0):
    force = np.zeros((len(t), 3))
    force[:, 0] = -0.3 * (begin(t, at_s, 0.3) - begin(t, at_s + for_s, 0.3))
    return force


def test_a_gyro_that_is_known_is_believed_while_something_pushes():
    """Braking by 0.3 g for 5 s leads a plain loop of this length 14 degrees astray."""
    motion = Motion(40, lambda t: [3 * a for a in by_hand(0.2 * t, 1.0, (2, 1, 3))], brake)
    _, quats, _ = tracked(motion, motion.read())
    _, plain, _ = tracked(motion, motion.read(), most_dps=1e3)
    assert motion.tilt_error_deg(quats).max() < 6.5
    assert motion.tilt_error_deg(plain).max() > 10.0
    _, careful, _ = tracked(motion, motion.read(), **PROFILES["driving"])
    assert motion.tilt_error_deg(careful).max() < motion.tilt_error_deg(quats).max()


def test_what_would_be_too_fast_is_a_wrong_attitude():
    """Turned by 30 degrees while the gyro said nothing: 5 m/s more each second."""
    motion = Motion(60, lambda t: (15 * np.sin(1.3 * t) * begin(t, 4) + 30 * begin(t, 20, 0.2),
                                   0 * t, 0 * t))
    rows = motion.read()
    rows[(motion.t >= 20) & (motion.t < 20.2), :3] = 0
    _, quats, claims = tracked(motion, rows)
    error = motion.tilt_error_deg(quats)
    assert error[motion.t > 40].max() < 1.5
    _, slow, _ = tracked(motion, rows, top_speed_m_s=1e6)
    assert motion.tilt_error_deg(slow)[motion.t > 40].max() > 10.0
    assert claims[(motion.t > 25) & (error > 10), 2].mean() > 0.9  # and it says so


def test_nothing_is_learned_beyond_the_gyro_s_range():
    motion = Motion(60, lambda t: (by_hand(t)[0], by_hand(t)[1],
                                   360 * 4.0 * np.minimum(np.maximum(t - 20, 0), 3)))
    rows = motion.read()
    rows[:, :3] = np.clip(rows[:, :3], -1000, 1000)
    filt, _, _ = tracked(motion, rows, gyro_range_dps=1000)
    assert np.abs(rows[:, :3]).max() == 1000
    assert filt.learned()[0] == pytest.approx((0, 0, 0), abs=0.008)


def flight(t):
    """Up at 2.5 s, then to and fro by 20 degrees, at last a slope that is held."""
    def pulse(first, last, deg):
        return deg * (begin(t, first) - begin(t, last))
    return (pulse(4, 4.8, 20) + pulse(8, 9.5, -15), pulse(5.5, 6.2, -15) + pulse(9, 16, 8),
            45 * begin(t, 6.7, 2.0))


def test_flying_is_within_a_degree_after_each_manoeuvre():
    """In the air the accelerometer feels thrust and drag: level, whatever the attitude is."""
    motion = Motion(20, flight, rate_hz=250.0)
    ups, speed = np.array([(q[1] * q[3] + q[0] * q[2], q[2] * q[3] - q[0] * q[1])
                           for q in motion.quat]) * 2, np.zeros(2)
    rows = motion.read(bias=(1.0, 2.0, -1.0))
    for n in np.flatnonzero(motion.t > 2.5):
        force = np.array([*(ups[n] - 0.32 * speed / G), 1.0])  # drag of 0.25 N per m/s
        speed = speed + force[:2] * G / motion.rate_hz
        w, x, y, z = motion.quat[n]
        rotation = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                             [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                             [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
        rows[n, 3:] = rotation.T @ force
        rows[n] += 0.05 * np.sin(600.0 * motion.t[n] + np.arange(6)) * (40, 40, 10, 1, 1, 1)
    _, quats, _ = tracked(motion, rows, **PROFILES["flying"])
    assert motion.tilt_error_deg(quats)[motion.t > 2.5].max() < 1.0
    _, other, _ = tracked(motion, rows)
    assert motion.tilt_error_deg(other).max() > 1.3


@pytest.mark.parametrize("path", recordings.files(), ids=lambda p: p.stem[:2])
@pytest.mark.parametrize("scale", [1.0, 0.98])
def test_bounds_hold_on_recordings(path, scale):
    rec = recordings.load(path)
    rows = rec.samples()
    rows[:, :3] *= scale
    filt = Attitude(rec.rate_hz)
    quats, claims = run(filt, rows, 1 / rec.rate_hz)
    error = rec.error_deg(recordings.up_from_quaternion(quats))[rec.counted]
    inside = np.mean(error < 2.45 * claims[rec.counted, 0])
    assert inside > 0.88
    assert np.sqrt(np.mean(claims[rec.counted, 0] ** 2)) < 3 * np.sqrt(np.mean(error**2))


def test_bounds_hold_on_gyros_of_all_kinds():
    """Scale errors drawn from what the filter takes for granted."""
    tilt, yaw = [], []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        matrix = np.eye(3) + np.diag(rng.normal(0, 0.02, 3)) + rng.normal(0, 0.003, (3, 3))
        rest = (4.0, 0.0)[seed % 2]
        motion = Motion(60, lambda t, r=rest: by_hand(t + 4 - r, 4.0, (60, 30, 50)),
                        lambda t, r=rest: shaken(t + 4 - r))
        _, quats, claims = tracked(motion, motion.read(matrix, rng.normal(0, 4, 3), seed=seed))
        later = motion.t > 2
        tilt.append(motion.tilt_error_deg(quats)[later] < 2.45 * claims[later, 0])
        error = motion.yaw_error_deg(quats)
        yaw.append(np.abs(error - error[0])[later] < 1.96 * claims[later, 1])
    assert np.mean(tilt) > 0.90
    assert np.mean(yaw) > 0.90


def ended(monkeypatch, matrix, bias):
    """A filter that does not learn, after a motion in which the gyro had these errors."""
    motion = Motion(25, lambda t: by_hand(t, 2.0), lambda t: shaken(t, 2.0))
    monkeypatch.setattr(GyroLearning, "look", lambda self, *_: [0.0] * 14)
    filt, moves = Attitude(100, lag_s=0, most_dps=1e3), False
    for row in motion.read(matrix, noise=False).tolist():
        rested = filt.at_rest
        filt.update(*(np.add(row[:3], bias) if moves else row[:3]), *row[3:])
        moves = moves or (rested and not filt.at_rest)
    return filt


@pytest.mark.parametrize("error", [0, 2, 3, 4, 8, 11])
def test_the_view_is_the_derivative_of_the_attitude(monkeypatch, error):
    small, matrix, bias = 2e-4, np.eye(3), np.zeros(3)
    if error < 3:
        bias[error] = np.degrees(small)
    else:
        matrix[(error - 3) // 3, (error - 3) % 3] += small
    exact = ended(monkeypatch, np.eye(3), np.zeros(3))
    wrong = ended(monkeypatch, matrix, bias)
    w, x, y, z = exact.quaternion()
    _, x, y, z = product(wrong.quaternion(), (w, -x, -y, -z))
    view, loop = exact._slow.view, wrong._loop
    # turned about x, what was up shows on -y
    near = {"abs": 0.06, "rel": 0.1}  # a block turns by up to 8 degrees
    assert 2 * y / small == pytest.approx(view.tilt[0][error], **near)
    assert -2 * x / small == pytest.approx(view.tilt[1][error], **near)
    px, py = ((getattr(loop, n) - getattr(exact._loop, n)) / small for n in ("px", "py"))
    assert (px, py) == pytest.approx([p[error] for p in view.position], **near)
    if error == 2:  # and what an old bias did to the yaw is forgotten in part
        assert 0.6 < view.yaw[error] / (2 * z / small) < 1.0


def test_a_correction_is_the_inverse_of_the_error():
    learning = GyroLearning()
    learning.matrix = [1.01, 0.002, 0, 0, 0.99, 0.001, -0.002, 0, 1.0]
    learning.bias = [0.02, -0.01, 0.03]
    rate = np.array((0.5, -1.2, 2.0))
    before = np.reshape(learning.matrix, (3, 3)) @ rate - learning.bias
    change = [0.001, 0.002, -0.003] + [0.004, 0.001, 0, 0, -0.002, 0.001, 0.002, 0, 0.003]
    learning.correct(change + [0.1, 0.1])
    after = np.reshape(learning.matrix, (3, 3)) @ rate - learning.bias
    expected = before - change[:3] - np.reshape(change[3:], (3, 3)) @ before
    assert after == pytest.approx(expected, abs=1e-4)  # what it knows already is small
    learning.correct([0.0] * 3 + [0.5] + [0.0] * 10)
    assert learning.matrix[0] == pytest.approx(0.94)  # a fixed limit


def test_settings_are_checked():
    for bad in ({"scale_sigma": -1}, {"start_sigma_dps": 0}, {"top_speed_m_s": 0}):
        with pytest.raises(ValueError):
            Attitude(**bad)
    for settings in PROFILES.values():
        Attitude(**settings)


@pytest.mark.parametrize(("every", "known"), [(150, 0.02), (1500, 0.008)])
def test_a_gap_teaches_nothing_that_nobody_has_seen(every, known):
    """A tenth of a second is bridged by rates that are 1.4 times too large; between gaps that are
    rare it learns."""
    motion = Motion(90, by_hand, shaken)
    rows = motion.read()
    counts = np.column_stack([rows[:, 3:] * 4096, rows[:, 0] * 0, rows[:, :3] * 65.5]).round()
    filt, row = fixed.Attitude(motion.rate_hz, 500, 8, lag_s=0.0), array("h", [0] * 7)

    def around(n):
        return array("h", [int(c) for c in counts[n] * ([1] * 4 + [1.4] * 3)])

    n = 0
    while n < len(counts):
        if n > 500 and n % every == 0:
            filt.keep()
            filt.turn(around(n - 1), around(n + 10), 110000)
            n += 10
        row[:] = array("h", [int(c) for c in counts[n]])
        filt.step(row)
        n += 1
    scale, sigma, *_ = filt.learned()
    assert max(map(abs, scale)) < 0.75 * known and max(sigma) < known


def pushed(t):
    """0.4 g to and fro along x, each for two seconds."""
    along = 0.4 * np.sign(np.sin(np.pi * t / 2)) * (t > 4.0)
    return np.column_stack([along, 0 * t, 0 * t])


@pytest.mark.parametrize("samples", [1, 2, 3, 5, 10, 20])
def test_after_a_gap_in_a_turn_what_pushes_turns_it_by_3_degrees_more_at_most(samples):
    """The gap is bridged by true rates, so that it hides little: no reason to level anew."""
    motion = Motion(40, by_hand, pushed)
    rows = motion.read()
    counts = np.column_stack([rows[:, 3:] * 4096, rows[:, 0] * 0, rows[:, :3] * 65.5]).round()
    worst = []
    for gaps in (False, True):
        filt, row = fixed.Attitude(motion.rate_hz, 500, 8, lag_s=0.0), array("h", [0] * 7)
        quats, n = [], 0
        while n < len(counts):
            if gaps and n > 1000 and n % 300 == 0:
                before, after = [array("h", counts[k].astype(int)) for k in (n - 1, n + samples)]
                filt.keep()
                filt.turn(before, after, round((samples + 1) * 1e6 / motion.rate_hz) - 10000)
                quats += [[np.nan] * 4] * samples
                n += samples
            row[:] = array("h", [int(c) for c in counts[n]])
            filt.step(row)
            quats.append(filt.quaternion())
            n += 1
        worst.append(np.nanmax(motion.tilt_error_deg(np.array(quats))[1000:]))
    assert worst[1] < worst[0] + 3.0

# SPDX-License-Identifier: MIT
"""Replay and tuning: the board's code on a PC, noise beside allantools, advice, the search."""

import json
from array import array

import allantools
import numpy as np
import pytest

from tools import recordings
from tools.replay import engine, grade
from tools.replay.__main__ import main as replay
from tools.track import DEFAULTS, Track, load
from tools.tune import noise, search, vibration

FILES = recordings.files()


def still(seconds=60, hz=250.0, seed=1, **calibration):
    """A sensor at rest: white noise and a bias that wanders."""
    some = np.random.default_rng(seed)
    n = int(seconds * hz)
    wander = np.cumsum(some.normal(0, 0.02, (n, 3)), axis=0)
    counts = np.zeros((n, 7))
    counts[:, 2] = 4096
    counts[:, :3] += some.normal(0, 12, (n, 3))
    counts[:, 4:] = some.normal(0, 6, (n, 3)) + 40 + wander
    return Track(
        "still", np.round(counts).astype(np.int16), np.arange(n) / hz, hz, dict(DEFAULTS),
        calibration=calibration,
    )  # fmt: skip


def test_the_unchecked_code_gives_what_the_checked_twin_gives():
    """The whole of both integer filters, number for number, over a wild piece of a recording."""
    from tools.virtual.viper import unchecked
    from tools.virtual.viper import viper as checked

    rows = [array("H", row) for row in load(FILES[1]).counts[5000:6500].view(np.uint16).tolist()]
    from attitude.fixed import Attitude, KalmanTilt2

    for kind in (Attitude, KalmanTilt2):
        answers = []
        for make in (checked, unchecked.viper):
            filt = kind(285.7, 2000, 16)
            step = make(getattr(kind.step, "__wrapped__", kind.step))
            for row in rows:
                step(filt, row)
            answers.append(filt.state())
        assert answers[0] == answers[1] and len(set(answers[0])) > 10


def test_a_replay_is_as_far_from_the_truth_as_the_accuracy_table_says(tmp_path):
    from tools.accuracy.filters import fixed_attitude

    rec = recordings.load(FILES[2])
    replay([str(FILES[2]), "--json", str(tmp_path / "out.json")])
    figures = json.loads((tmp_path / "out.json").read_text())
    assert figures["against"] == "truth" and figures["settings"]["attitude_tau_s"] == 2.3
    assert figures["rms_deg"] == pytest.approx(
        rec.rmse_deg(fixed_attitude(rec, lambda n: None).up), abs=0.002
    )


def test_a_setting_changes_the_replay_and_one_of_the_chip_is_refused(capsys, tmp_path):
    out = tmp_path / "out.json"
    replay([str(FILES[0]), "--set", "attitude_tau_s=0.2", "--json", str(out)])
    figures = json.loads(out.read_text())
    assert figures["changed"] == {"attitude_tau_s": 0.2}
    assert figures["rms_deg"] > 1.3 * figures["rms_unchanged_deg"]
    with pytest.raises(SystemExit, match="dlpf_hz"):
        replay([str(FILES[0]), "--set", "dlpf_hz=21"])
    with pytest.raises(SystemExit, match="did you mean"):
        replay([str(FILES[0]), "--set", "attitude_tau=1"])


def test_the_hindsight_is_nearer_with_the_learned_scale_and_about_as_near_as_the_filter():
    """Which learns while it goes."""
    track = load(FILES[0])

    def rms(up):
        angle = np.degrees(np.arccos(np.clip(np.sum(up * track.up, axis=1), -1, 1)))
        return np.sqrt(np.nanmean(angle[track.counted] ** 2))

    own = grade.rms_deg(engine.run(track, track.settings), track.up, track.counted)
    hindsight = rms(grade.hindsight(track))
    assert hindsight < 0.95 * rms(grade.smoothed(track, *track.units()))
    assert hindsight < 1.1 * own


def test_the_allan_deviation_is_allantools():
    rate = still(120).units()[0][:, 0]
    taus, own = noise.allan(rate, 250.0)
    _, theirs, _, _ = allantools.oadev(rate, rate=250.0, data_type="freq", taus=taus)
    assert len(theirs) == len(own)
    np.testing.assert_allclose(own, theirs, rtol=0.01)


def test_noise_at_rest_is_found_and_told_raw_and_used():
    track = still(60, gyro_bias_dps=[40 / 65.5] * 3)
    found = noise.at_rest(track)
    true = 6 / 65.5 / np.sqrt(250)
    for axis in found["raw"]["gyro_dps"]:
        assert axis["white"] == pytest.approx(true, rel=0.25)
        assert axis["mean"] == pytest.approx(40 / 65.5, abs=0.1)
    assert abs(found["used"]["gyro_dps"][0]["mean"]) < 0.1
    moving = load(FILES[1]).part(slice(6000, 9000))
    assert noise.at_rest(moving) is None


def shaken(hz, rate_hz, size_g=0.3):
    track = still(20, rate_hz)
    wave = size_g * np.sqrt(2) * 4096 * np.sin(2 * np.pi * hz * track.t_s)
    track.counts[:, 1] += np.round(wave).astype(np.int16)
    return track


def test_a_vibration_is_named_with_what_its_notch_costs():
    [first, *_] = vibration.advice(shaken(60, 250.0))
    assert first["hz"] == pytest.approx(60, abs=0.6) and first["notch"]
    assert first["accel_g"] == pytest.approx(0.3, rel=0.1)
    assert first["delay_ms"] == pytest.approx(1000 / (2 * np.pi * 60 * 3), rel=0.02)
    assert "3600 turns a minute" in first["words"] and "ms" in first["words"]
    assert vibration.advice(still(20)) == []


def test_no_notch_above_0_45_of_the_rate():
    [first, *_] = vibration.advice(shaken(118, 250.0))
    assert not first["notch"] and first["delay_ms"] is None
    assert "No notch" in first["words"] and "alias" in first["words"]


def test_a_notch_delays_slow_motion_by_what_is_said():
    """The integer notch itself, on a slow sinusoid."""
    from attitude.fixed import Notch

    made, hz = Notch(50.0, 1000.0, vibration.QUALITY), 4.0
    t = np.arange(4000) / 1000
    row, out = array("h", [0] * 7), []
    for value in np.round(8000 * np.sin(2 * np.pi * hz * t)).astype(int).tolist():
        row[4] = value
        made.update(row)
        out.append(made.counts[4])
    wave = np.exp(-2j * np.pi * hz * t[1000:])
    phase = np.angle(np.sum(np.array(out[1000:]) * wave) / np.sum(
        8000 * np.sin(2 * np.pi * hz * t[1000:]) * wave))  # fmt: skip
    assert -phase / (2 * np.pi * hz) * 1000 == pytest.approx(vibration.delay_ms(50.0), abs=0.15)


class Bowl:
    """A judge whose errors are known: two recordings, best at tau = 8 s; `other` is against it."""

    def __init__(self, depth, other=False):
        self.depth, self.other = depth, other

    def errors(self, changes):
        away = np.log(changes.get("complementary_tau_s", 0.5) / 8) / np.log(16)
        near = 1 - self.depth * (1 - min(1.0, away * away))
        return np.array([5 * near, 5 * (3 - 2 * near if self.other else near)])


def test_the_search_finds_what_is_clearly_better_and_keeps_the_default_else():
    found = search.tuned(Bowl(0.5), "float.complementary")
    assert found["complementary_tau_s"] == pytest.approx(8, rel=0.3)
    assert search.tuned(Bowl(0.04), "float.complementary") == {}  # the smoother's own ways
    assert search.tuned(Bowl(0.5, other=True), "float.complementary") == {}  # one pays for it

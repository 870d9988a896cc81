# SPDX-License-Identifier: MIT
"""A recording of the virtual board: cable pulled twice, reset, knobs set; what is in the file."""

import json
import time

import numpy as np
import pytest

from tools.link.desk import VirtualBoard
from tools.link.link import Away, Link
from tools.record import Recorder
from tools.replay.__main__ import compared
from tools.track import load


def wait(true, seconds=40):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """(recorder, link's figures, folder with pulled.npz and pulled.csv)."""
    folder, recorder = tmp_path_factory.mktemp("record"), Recorder()
    with VirtualBoard("free") as board:
        link = Link(board.port, recorder.add, ("late_us",)).start()
        wait(lambda: len(recorder) > 1500)
        link.set("attitude_tau_s", 2.5).result(10)
        for what in ("unplug", "unplug", "reset"):
            had = len(recorder)
            board.do(what)
            wait(lambda: link.state)
            with pytest.raises(Away):
                link.call("print(1)")
            time.sleep(0.3)
            if what == "unplug":
                board.do("plug")
            wait(lambda had=had: len(recorder) > had + 300)
        link.stop()
    recorder.save(folder / "pulled.npz")
    recorder.save(folder / "pulled.csv")
    return recorder, link, folder


def test_all_that_arrived_is_there_and_the_gaps_are_marked(recorded):
    recorder, link, folder = recorded
    assert link.away == 3 and link.received[1] == 0
    with np.load(folder / "pulled.npz") as data:
        assert len(data["raw"]) == len(recorder) == link.reader.samples
        losses = json.loads(str(data["losses"]))
        number, t_us = data["number"], data["t_us"]
    assert (np.diff(number) > 0).all() and (np.diff(t_us) > 0).all()
    assert len(losses) >= 3
    for at, missing, seconds in losses:
        assert number[at + 1] - number[at] == missing + 1 and seconds > 0.004
    whole = np.diff(t_us)[np.diff(number) == 1]
    assert np.median(whole) == 4000


def test_settings_units_board_and_marks_are_in_it(recorded):
    _, _, folder = recorded
    with np.load(folder / "pulled.npz") as data:
        headers, marks = json.loads(str(data["headers"])), json.loads(str(data["marks"]))
    first = headers[0][1]
    assert ["gyro_x", "deg/s", pytest.approx(1 / 65.5)] in first["channels"]
    assert first["board"] == "Pico" and first["settings"]["rate_hz"] == 250
    assert {"attitude_tau_s": [2.3, 2.5]} in [changed for _, changed in marks]


def test_csv_and_npz_are_the_same_track_and_both_replay(recorded):
    _, _, folder = recorded
    one, other = load(folder / "pulled.npz"), load(folder / "pulled.csv")
    np.testing.assert_array_equal(one.counts, other.counts)
    np.testing.assert_allclose(one.t_s, other.t_s, atol=1e-5)
    assert one.settings == other.settings and len(one.gaps) == len(other.gaps) >= 3
    assert one.marks and one.marks == other.marks
    figures, _ = compared(one.part(slice(0, int(one.gaps[0]))), {})
    assert figures["against"] == "hindsight" and figures["rms_deg"] < 1.0
    assert abs(figures["rms_deg"] - figures["rms_on_board_deg"]) < 0.1


def test_a_replay_is_the_board_s_own_number(recorded):
    """From the same samples, both settled: the replayed angles are those that the board had."""
    _, _, folder = recorded
    track = load(folder / "pulled.npz")
    track = track.part(slice(0, int(track.gaps[0])))
    from tools.replay import engine

    apart = engine.run(track, track.settings)[-300:, :2] - track.angles_deg[-300:, :2]
    assert np.abs(apart).max() < 0.3


def test_nothing_to_save_is_said(tmp_path):
    with pytest.raises(ValueError, match="nothing came"):
        Recorder().save(tmp_path / "x.npz")

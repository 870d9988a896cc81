# SPDX-License-Identifier: MIT
"""The board's end of the stream, in virtual time: what is in it, losses, the trigger, its end."""

import numpy as np
import pytest

from tools.link.frames import Splitter
from tools.link.reader import Reader
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Sinusoid, Step
from tools.virtual.port import Port

OUTPUTS = 19  # places: firmware.tick.words


class Line:
    """A console whose far end reads, or does not."""

    def __init__(self):
        self.sent, self.reads = bytearray(), True

    def ready(self):
        return self.reads

    def write(self, data):
        assert self.reads and len(data) == 64  # 64 divides the USB buffer: see the module
        self.sent += data

    def key(self):
        return False

    def batches(self, reader=None):
        """What has been sent since the last call."""
        reader = reader or Reader()
        text, contents = Splitter().feed(bytes(self.sent))
        self.sent.clear()
        assert text == b""
        reader.feed(contents)
        return reader, reader.take()


@pytest.fixture(params=[("rp2", (1, 26, 1)), ("rp2", (1, 25, 0)), ("esp32", (1, 25, 0))])
def board(request, tmp_path, monkeypatch):
    """(port, app, line): an app that runs, with hard ticks and with soft ones."""
    monkeypatch.chdir(tmp_path)
    platform, version = request.param
    chip = MPU6050Chip(motion=Sinusoid(20.0, 0.5, "roll"), seed=3)
    wiring = {0: (4, 5) if platform == "rp2" else (21, 22)}
    with Port(platform, {0: Bus(chip)}, wiring=wiring, version=version) as port:
        from firmware.app import App

        app = App(console=Line())
        app.config.set("rest_s", 0.0)
        app.start()
        port.run_ms(100)
        yield port, app, app.telemetry.console
        assert port.errors == [] and app.foreground.error is None and app.stream.error is None


def test_samples_are_the_tick_s_own_and_none_is_missing(board):
    port, app, line = board
    app.stream.start(("rate_x", "late_us", "age_ms"))
    port.run_ms(1000)
    port.run_ms(2)
    reader, batches = line.batches()
    number = np.concatenate([batch.number for batch in batches])
    assert list(np.diff(number)) == [1] * (len(number) - 1) and len(number) > 240
    batch = batches[-1]
    assert reader.lost == 0 and set(np.diff(batch.t_us)) == {4000}
    names = [name for name, _, _ in batch.header["channels"]]
    assert names[:7] == ["accel_x", "accel_y", "accel_z", "temp", "gyro_x", "gyro_y", "gyro_z"]
    assert names[7:] == ["roll", "pitch", "yaw", "rate_x", "late_us", "age_ms"]
    roll, rate = batch.value("roll"), batch.value("rate_x")
    slope = np.gradient(roll, 0.004)
    assert np.abs(slope - rate)[5:-5].max() < 6.0 and np.ptp(roll) > 25
    norm = np.sqrt(sum(batch.value(f"accel_{axis}") ** 2 for axis in "xyz"))
    assert norm.mean() == pytest.approx(1.0, abs=0.03)
    assert batch.value("temp").mean() + batch.header["temp_c_at_0"] == pytest.approx(25, abs=2)
    assert (batch.value("age_ms") == 0).all()


def test_a_reader_who_is_away_for_a_while_misses_nothing_that_fits(board):
    port, app, line = board
    app.stream.start(seconds=0.5)
    port.run_ms(400)
    reader, _ = line.batches()
    line.reads = False
    port.run_ms(300)
    line.reads = True
    port.run_ms(800)
    reader, batches = line.batches(reader)
    assert reader.lost == 0 and app.stream.waits > 0
    assert len(np.concatenate([batch.number for batch in batches])) > 250


def test_a_slow_reader_loses_samples_which_shows(board):
    port, app, line = board
    app.stream.start(seconds=0.1)
    port.run_ms(400)
    reader, _ = line.batches()
    line.reads = False
    port.run_ms(1000)
    line.reads = True
    port.run_ms(900)
    reader, _ = line.batches(reader)
    assert reader.lost > 150 and reader.counts.ring_lost == reader.lost
    assert app.stats()["lost"] == 0 and app.stats()["errors"] == 0


def test_it_ends_when_nobody_keeps_it_and_the_tick_is_as_before(board):
    port, app, line = board
    words, drive = app.tick.words, app.tick.drive
    assert words[OUTPUTS] == 0
    app.stream.start(keep_s=1)
    assert words[OUTPUTS] == 1 and app.tick.drive is not drive
    port.run_ms(700)
    app.stream.keep(1)
    port.run_ms(700)
    assert app.stream.on
    port.run_ms(700)
    assert not app.stream.on and words[OUTPUTS] == 0
    line.sent.clear()
    port.run_ms(200)
    assert not line.sent


def test_outputs_go_on_beside_it_and_can_show_what_they_do(board):
    port, app, line = board
    seen = []

    def update(app):
        seen.append(app.angles_mdeg[0])

    app.outputs.add(update, lambda: None, hard=True)
    app.stream.offer("drive", "permille", 0.5, lambda: len(seen) & 0xFFF)
    app.stream.start(("drive",))
    port.run_ms(400)
    _, batches = line.batches()
    drive = np.concatenate([batch.value("drive") for batch in batches])
    assert list(np.diff(drive)) == [0.5] * (len(drive) - 1) and len(seen) > 90
    app.stream.stop()
    before = len(seen)
    port.run_ms(100)
    assert len(seen) >= before + 24


def test_every_nth_tick(board):
    port, app, line = board
    app.stream.start(every=5)
    port.run_ms(2000)
    _, batches = line.batches()
    t_us = np.concatenate([batch.t_us for batch in batches])
    assert set(np.diff(t_us)) == {20000} and 85 < len(t_us) < 101


def test_a_knob_s_change_is_told_between_the_samples_it_separates(board):
    port, app, line = board
    app.stream.start()
    port.run_ms(1500)
    app.set("attitude_tau_s", 2.5)
    port.run_ms(500)
    reader, _ = line.batches()
    assert reader.headers == 2 and reader.header["settings"]["attitude_tau_s"] == 2.5
    crc = reader.header["crc"]
    app.set("gyro_dps", 1000)  # counts mean something else from now on: all is told anew
    port.run_ms(1500)
    reader, _ = line.batches(reader)
    scale = {name: scale for name, _, scale in reader.header["channels"]}
    assert scale["gyro_x"] == pytest.approx(1 / 32.8) and reader.header["crc"] != crc


def test_unknown_channels_are_named(board):
    _, app, _ = board
    with pytest.raises(ValueError, match="no channel rol; there are accel_x"):
        app.stream.start(("rol",))
    assert not app.stream.on


def test_a_trigger_sends_what_was_around_the_event_and_waits_for_the_next(tmp_path, monkeypatch):
    """A step of 20 degrees a second after it was armed, at 1 kHz."""
    monkeypatch.chdir(tmp_path)
    chip = MPU6050Chip(motion=Step(20.0, at_s=1.2), seed=3)
    with Port("rp2", {0: Bus(chip)}, version=(1, 26, 1)) as port:
        from firmware.app import App

        app = App(console=Line())
        app.config.set("rest_s", 0.0)
        app.config.set("rate_hz", 1000)
        app.start()
        line = app.telemetry.console
        app.stream.trigger("gyro_x", 50, before=100, after=200)
        port.run_ms(900)
        app.stream.keep(9)
        assert line.batches(Reader())[1] == []  # armed: no samples
        port.run_ms(3000)
        reader, batches = line.batches()
        assert batches == [] and reader.header is None  # which came before: a new reader asks
        app.stream.changed()
        port.run_ms(500)
        assert app.stream._ring[9] == 1  # MODE: armed again
        assert port.errors == []

# SPDX-License-Identifier: MIT
"""The stream's header: JSON in a room that it never leaves, and settings that change faster than
they are sent. What goes over the line is in board/test_stream.py.
"""

import json

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.port import Port


@pytest.fixture
def app(tmp_path):
    with Port("rp2", {0: Bus(MPU6050Chip(seed=3))}, version=(1, 26, 1), root=tmp_path) as port:
        from firmware.app import App

        port.run_ms(100)
        app = App()
        app.set("rest_s", 0.1)
        app.start()
        app.stream.start(keep_s=1000)
        yield app
        app.stop()


def told(app):
    text = app.stream._header
    return json.loads(bytes(text.data[: text.size]))


def test_it_is_what_json_makes_of_it(app):
    from firmware import channels

    for head in ({}, {"a": {}, "b": {"c": (1, 2.5), "d": 'x"y'}, "e": True, "f": None}):
        text = channels.Text()
        text.make(head)
        assert json.loads(bytes(text.data[: text.size])) == json.loads(json.dumps(head))
    assert told(app)["settings"]["rest_s"] == 0.1


def test_one_that_has_grown_gets_more_room_and_is_whole(app):
    """A calibration is in it only once there is one."""
    room = len(app.stream._header.data)
    app.calibration = app.calibration.but(date="x" * room)
    app.stream.changed()
    assert app.stream._header.size <= len(app.stream._header.data)
    assert told(app)["calibration"]["date"] == "x" * room


def test_changes_that_come_faster_than_they_are_sent_are_few_and_end_at_the_last_value(app):
    stream = app.stream
    for n in range(40):
        app.set("attitude_rest_tau_s", 0.5 + n / 100)
        app.set("complementary_tau_s", 0.1 + n / 100)
    assert 0 < len(stream._todo) <= 8
    assert stream._todo[-1]["settings"] == {
        "attitude_rest_tau_s": app.config.attitude_rest_tau_s,
        "complementary_tau_s": app.config.complementary_tau_s,
    }
    assert app.config.attitude_rest_tau_s == 0.5 + 39 / 100


@pytest.mark.parametrize("most", [16, 32, 64, 256])
@pytest.mark.parametrize("had", [16, 64, 256])
def test_a_ring_is_never_smaller_than_the_one_before(monkeypatch, had, most):
    """The heap comes to be in pieces while a board runs; `most`: the records of the largest."""
    with Port("rp2"):
        from firmware import stream
        from firmware.tick import tap

        make, size, length = tap.ring, 2, 8  # places of firmware.tick.tap
        old = make(had, 28)
        old[0] = old[1] = 7  # it has been used

        def scarce(records, each):
            if records > most:
                raise MemoryError
            return make(records, each)

        monkeypatch.setattr(stream.tap, "ring", scarce)
        ring = stream._ring(200, 28, old)
        assert ring[size] == max(had, most) and ring[length] == 28
        assert list(ring[:2]) == [0, 0]


@pytest.mark.parametrize("free, records", [(20000, 256), (9000, 128), (5000, 16), (500, 0)])
def test_a_ring_leaves_a_piece_for_a_filters_code_beside_it(monkeypatch, free, records):
    """All that is free is one piece; 28 bytes a record and 104 of its own."""
    with Port("rp2"):
        from firmware import stream

        make, left = stream.tap.ring, [free]

        def scarce(amount):
            if amount > left[0]:
                raise MemoryError
            left[0] -= amount

        def ring(size, length):
            try:
                scarce(104 + size * length)
            except MemoryError:
                left[0] = free
                raise
            return make(size, length)

        def room(amount):
            left[0] = free
            scarce(amount)

        monkeypatch.setattr(stream, "bytearray", room, raising=False)
        monkeypatch.setattr(stream.tap, "ring", ring)
        if records:
            assert stream._ring(200, 28, None)[2] == records  # SIZE of firmware.tick.tap
        else:
            with pytest.raises(MemoryError):
                stream._ring(200, 28, None)


@pytest.mark.parametrize(
    "used, header", [(1000, True), (3300, True), (3400, False), (4100, False)]
)
def test_a_header_waits_where_the_program_is_deep(app, used, header, monkeypatch):
    chunks, seen = app.stream._chunks, []
    monkeypatch.setattr("firmware.stream.stack_use", lambda: used)
    app.telemetry.console.ready, app.telemetry.console.write = lambda: True, seen.append
    app.stream._run = app.stream._make_run()
    for _ in range(50):
        app.stream._run(0)
    assert (app.stream._next > 0) == header and chunks > 4
    for _ in range(400):  # and not for ever
        app.stream._run(0)
    assert app.stream._next == app.stream._chunks


def test_samples_wait_till_half_of_the_ring_where_there_is_hardly_a_stack(app, monkeypatch):
    stream, seen = app.stream, []
    monkeypatch.setattr("firmware.stream.stack_use", lambda: 4300)
    app.telemetry.console.ready, app.telemetry.console.write = lambda: True, seen.append
    run, ring = stream._make_run(), stream._ring  # places of firmware.tick.tap
    for waiting in range(ring[2]):
        ring[0], ring[1] = (ring[1] + waiting) & 0x3FFFFFFF, ring[1]
        before = stream.written
        run(0)
        assert (stream.written > before or ring[1] + waiting > ring[0]) == (waiting >= ring[2] / 2)

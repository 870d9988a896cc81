# SPDX-License-Identifier: MIT
"""Telemetry for Serial Studio, teleplot and PlotJuggler: what each of them reads out of its lines,
by parsers written from the programs' documentation."""

import json
import random
import re

import pytest

from host_tests.firmware.test_telemetry import ESTIMATE, Reader, lines_of
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.port import Port


def serial_studio(stream):
    """Quick Plot: a row a line, ended by CR, LF or both; fields apart by commas; a first row
    without any number names the channels, which are Channel 1, 2 ... without it."""
    names, rows = [], []
    for line in re.split(rb"[\r\n]+", stream.strip(b"\r\n")):
        fields = [field.strip() for field in line.decode().split(",")]
        if not rows and not names and not any(re.match(r"[-+]?\d", field) for field in fields):
            names = fields
        else:
            keys = names or [f"Channel {i}" for i in range(1, len(fields) + 1)]
            rows.append(dict(zip(keys, map(float, fields), strict=True)))
    return rows


def teleplot(stream):
    """A line ">name:number" adds to the variable; others are text for its console."""
    found = {}
    for name, value in re.findall(r"^>([^>:|]+):\s*([-+\d.]+)\s*$", stream.decode(), re.M):
        found.setdefault(name, []).append(float(value))
    return [dict(zip(found, values)) for values in zip(*found.values(), strict=True)]


def plotjuggler(stream):
    """JSON objects anywhere in it; their numbers become series."""
    text, at, rows = stream.decode(), 0, []
    while (at := text.find("{", at)) >= 0:
        row, at = json.JSONDecoder().raw_decode(text, at)
        rows.append(row)
    return rows


@pytest.fixture
def telemetry():
    with Port("rp2"):
        from firmware.telemetry import Telemetry

        made = Telemetry(Reader())
        made.set_rate(50, 250)
        made.begin()
        yield made


DEGREES = ("roll_deg", "pitch_deg", "yaw_deg", "stale")
PLAIN = ("roll", "pitch", "yaw", "stale")
PROGRAMS = [
    ("serial-studio", serial_studio, DEGREES),
    ("teleplot", teleplot, PLAIN),
    ("plotjuggler", plotjuggler, PLAIN),
]
programs = pytest.mark.parametrize("name, read, names", PROGRAMS, ids=[row[0] for row in PROGRAMS])


@programs
def test_a_program_reads_every_angle_out_of_its_lines(telemetry, name, read, names):
    telemetry.set_format(name)
    some = random.Random(5)
    angles = [(0, 0, 0), (-180000, 90000, 179999), (-4, 5, -6), (-90000, -90000, -179999)]
    angles += [[some.randint(-180000, 180000) for _ in range(3)] for _ in range(200)]
    expected = []
    for i, mdeg in enumerate([angles[0], *angles]):
        before = telemetry.lines
        for _ in range(5):
            telemetry.tick((0, 0, *mdeg), i % 3 == 0, 1)
        if telemetry.lines > before:  # else it was the header
            expected.append([angle / 1000 for angle in mdeg] + [int(i % 3 == 0)])
    read_rows = read(b"".join(telemetry.console.written))
    assert len(read_rows) == len(expected) >= len(angles)
    for row, wanted in zip(read_rows, expected, strict=True):
        assert tuple(row) == names
        assert list(row.values()) == pytest.approx(wanted, abs=0.005001)


@pytest.mark.parametrize("name, read, names", PROGRAMS[1:])
def test_what_else_the_board_prints_is_no_data(telemetry, name, read, names):
    telemetry.set_format(name)
    stream = b"".join(lines_of(telemetry, 100))
    noise = b"MicroPython v1.26.1\r\nwarning: x\r\n>>> app.watch()\r\n"
    rows = read(noise + stream + noise)
    assert len(rows) == 20 and {tuple(row) for row in rows} == {names}
    wanted = [ESTIMATE[2] / 1000, ESTIMATE[3] / 1000, ESTIMATE[4] / 1000, 0]
    assert list(rows[0].values()) == pytest.approx(wanted, abs=0.005001)


def test_serial_studio_that_comes_later_numbers_the_channels(telemetry):
    telemetry.set_format("serial-studio")
    lines = lines_of(telemetry, 100)
    assert len(serial_studio(b"".join(lines))) == 19
    assert list(serial_studio(b"".join(lines[1:]))[0]) == [f"Channel {i}" for i in (1, 2, 3, 4)]


def test_each_choice_of_the_knob_has_a_format_that_fits_the_buffer(telemetry):
    from firmware.config import KNOBS

    (knob,) = [knob for knob in KNOBS if knob.name == "telemetry_format"]
    assert knob.default == telemetry.format == "plain"
    assert set(knob.choices) == {"plain", *(row[0] for row in PROGRAMS)}
    for name in knob.choices:
        telemetry.set_format(name)
        line = lines_of(telemetry, 10)[-1]
        assert 256 % len(line) == 0 and len(line) <= 64, name  # 7 ms of a UART, as ever
        assert line.endswith(b"\r\n") and line.isascii()


def test_a_running_app_changes_its_lines_at_once_and_only_when_the_knob_changes(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with Port("rp2", {0: Bus(MPU6050Chip(Still()))}, wiring={0: (4, 5)}) as port:
        from firmware.app import App

        console = Reader()
        app = App(console=console)
        app.start()
        app.telemetry.begin()

        def next_lines(ms):
            console.written.clear()
            port.run_ms(ms)
            return console.written

        assert next_lines(100)[-1].startswith(b"roll_deg: ")
        app.set("telemetry_format", "plotjuggler")
        assert all(line.startswith(b'{"roll":') for line in next_lines(100))
        app.set("telemetry_format", "serial-studio")
        assert next_lines(100)[0] == b"roll_deg,pitch_deg,yaw_deg,stale\r\n"
        app.set("attitude_tau_s", 3.0)  # no header anew
        assert all(serial_studio(line) for line in next_lines(100))
        with pytest.raises(ValueError, match="one of plain, serial-studio, teleplot, plotjuggler"):
            app.set("telemetry_format", "json")
        assert all(serial_studio(line) for line in next_lines(100))
        app.undo()
        app.undo()
        assert next_lines(100)[0].startswith(b'{"roll":')
        app.save()
        app.stop()
        again = App(console=console)
        again.start()
        again.telemetry.begin()
        assert next_lines(100)[0].startswith(b'{"roll":')
        again.stop()

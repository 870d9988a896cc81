# SPDX-License-Identifier: MIT
"""Telemetry: what a line says, when it is written, and that it waits for nobody."""

import random
import re

import pytest

from tools.virtual.port import Port


class Reader:
    """A console whose far end reads or does not."""

    def __init__(self):
        self.written = []
        self.reads = True
        self.taken = 0  # keys that were eaten

    def ready(self):
        return self.reads

    def write(self, data):
        assert self.reads, "written without anybody to take it: this would block"
        self.written.append(bytes(data))

    def key(self):
        return False

    def take(self):
        self.taken += 1


ESTIMATE = (0, 0, -12345, 67, 179996)  # roll, pitch, yaw from the third word on


@pytest.fixture
def telemetry():
    with Port("rp2"):
        from firmware.telemetry import Telemetry

        made = Telemetry(Reader())
        made.set_rate(50, 250)
        yield made


def lines_of(telemetry, ticks, stale=False):
    telemetry.console.written.clear()
    for _ in range(ticks):
        telemetry.tick(ESTIMATE, stale, 1)
    return telemetry.console.written


def test_a_header_without_numbers_names_the_units_and_then_50_lines_come_a_second(telemetry):
    telemetry.begin()
    header, *lines = lines_of(telemetry, 255)
    assert b"degrees" in header and not re.search(rb"\d", header)
    assert len(lines) == 50
    assert telemetry.lines == 50


def test_a_line_has_64_bytes_labels_and_four_numbers(telemetry):
    telemetry.begin()
    line = lines_of(telemetry, 10)[1]
    assert line == b"roll_deg:  -12.35 pitch_deg:    0.07 yaw_deg:  180.00 stale:0 \r\n"
    assert len(line) == 64 and 256 % len(line) == 0
    numbers = re.findall(rb"[-+]?\d+\.?\d*", line)
    assert [float(n) for n in numbers] == [-12.35, 0.07, 180.0, 0]
    assert lines_of(telemetry, 5, stale=True)[0].endswith(b"stale:1 \r\n")


def test_every_angle_is_written_as_python_would(telemetry):
    from firmware.telemetry import put_mdeg

    some = random.Random(4)
    values = [0, 4, 5, -4, -5, -6, 9, 10, 995, 999, -995, 179999, -180000, 99995, -99994]
    values += [some.randint(-180000, 180000) for _ in range(2000)]
    for mdeg in values:
        line = bytearray(b"#" * 10)
        put_mdeg(line, 1, mdeg)
        hundredths = (abs(mdeg) + 5) // 10
        text = "%d.%02d" % (hundredths // 100, hundredths % 100)
        sign = "-" if mdeg < 0 and hundredths else ""
        assert line == b"#" + (sign + text).rjust(8).encode() + b"#", mdeg


def test_nothing_is_written_when_nobody_reads_and_it_goes_on_afterwards(telemetry):
    telemetry.begin()
    lines_of(telemetry, 10)
    telemetry.console.reads = False
    assert lines_of(telemetry, 100) == []
    assert telemetry.dropped == 20
    telemetry.console.reads = True
    assert len(lines_of(telemetry, 100)) == 20


@pytest.mark.parametrize("rate_hz, lines_hz", [(80, 50), (1000, 100), (250, 1), (333, 50)])
def test_other_rates_come_near(telemetry, rate_hz, lines_hz):
    telemetry.begin()
    lines_of(telemetry, 10)
    telemetry.set_rate(lines_hz, rate_hz)
    written = len(lines_of(telemetry, 10 * rate_hz)) / 10
    every = round(rate_hz / lines_hz)  # whole ticks between two lines
    assert written == pytest.approx(rate_hz / every, abs=0.11)


def test_zero_silences_and_so_does_end(telemetry):
    telemetry.begin()
    telemetry.set_rate(0, 250)
    assert lines_of(telemetry, 1000) == []
    telemetry.end()
    assert not telemetry.on


def test_watch_ends_after_its_time_or_with_a_key():
    with Port("esp32") as port:
        from firmware.telemetry import Telemetry

        console = Reader()
        telemetry = Telemetry(console)
        telemetry.watch(0.5)
        assert 0.5e9 <= port.now_ns < 0.6e9 and not telemetry.on
        console.key = lambda: port.now_ns > 2e9
        telemetry.watch()
        assert 2e9 <= port.now_ns < 2.1e9 and not telemetry.on
        assert console.taken == 1  # the key that ended it is not the REPL's

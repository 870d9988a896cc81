# SPDX-License-Identifier: MIT
"""The bus at byte level: acknowledge, repeated START, log, lines, time."""

import pytest

from tools.virtual.bus import ArbitrationLost, Bus, BusStuck
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import LostArbitration, Nack, SdaHeld, Timeout
from tools.virtual.master import Master


def make(*faults):
    bus = Bus(MPU6050Chip(noise=False), faults=faults)
    bus.advance(1000)
    return bus, Master(bus)


def test_only_the_device_answers():
    bus, _ = make()
    found = []
    for address in range(8, 0x78):
        if bus.start(address, False):
            found.append(address)
        bus.stop()
    assert found == [0x68]


def test_address_is_seven_bits():
    bus, _ = make()
    with pytest.raises(ValueError):
        bus.start(0xD0, False)


def test_log_has_one_entry_per_transaction():
    bus, master = make()
    master.read(0x75)
    master.write(0x1B, 0x08)
    bus.start(0x50, False)
    bus.stop()
    first, second, third = bus.log
    assert (first.address, first.written, first.read, first.outcome) == (0x68, b"\x75", b"h", "ok")
    assert (second.written, second.read) == (b"\x1b\x08", b"")
    assert (third.address, third.outcome) == (0x50, "nack")
    assert first.t_ns < second.t_ns < third.t_ns


def test_log_is_bounded():
    bus = Bus(MPU6050Chip(), log_length=10)
    for _ in range(25):
        Master(bus).read(0x75)
    assert len(bus.log) == 10


def test_time_never_goes_back():
    bus, _ = make()
    bus.advance(5000)
    bus.advance(4000)
    assert bus.now_ns == 5000


def test_reading_from_nobody_gives_ones():
    bus, _ = make()
    assert not bus.start(0x20, True)
    assert bus.read(True) == 0xFF
    bus.stop()


def test_lines_are_high_when_idle():
    bus, _ = make()
    assert (bus.sda, bus.scl) == (1, 1)


def test_held_sda_is_freed_by_its_clocks():
    bus, master = make(SdaHeld(clocks=7))
    assert (bus.sda, bus.scl) == (0, 1)
    with pytest.raises(BusStuck) as caught:
        master.read(0x75)
    assert caught.value.line == "sda"
    assert bus.log[-1].outcome == "sda_stuck"
    for clocks in range(7):
        assert bus.sda == 0, clocks
        bus.scl_pulse()
    assert bus.sda == 1
    bus.stop()
    assert master.read(0x75) == b"h"


def test_sda_that_goes_low_within_a_transaction():
    bus, _ = make(SdaHeld(at_s=0.001))
    assert bus.start(0x68, False)
    bus.advance(1_100_000)
    with pytest.raises(ArbitrationLost):
        bus.write(0x75)


def test_stretched_clock_ends():
    bus, master = make(Timeout(at_s=0.001, for_s=0.01))
    master.run_s(0.002)
    assert bus.scl == 0
    with pytest.raises(BusStuck) as caught:
        master.read(0x75)
    assert caught.value.line == "scl"
    master.run_s(0.01)
    assert master.read(0x75) == b"h"


def test_lost_arbitration():
    bus, master = make(LostArbitration(for_s=0.001))
    with pytest.raises(ArbitrationLost):
        master.read(0x75)
    assert bus.log[-1].outcome == "arbitration"
    master.run_s(0.001)
    assert master.read(0x75) == b"h"


def test_fault_concerns_its_address_only():
    bus = Bus(MPU6050Chip(), MPU6050Chip(address=0x69), faults=[Nack(address=0x69)])
    bus.advance(1)
    assert Master(bus, 0x68).read(0x75) == b"h"
    with pytest.raises(OSError):
        Master(bus, 0x69).read(0x75)


def test_next_event_is_the_next_fault():
    bus, _ = make(Nack(at_s=0.5, for_s=0.1))
    assert bus.next_event_ns() == 500_000_000
    bus.advance(500_000_000)
    assert bus.next_event_ns() == 600_000_000
    bus.advance(600_000_000)
    assert bus.next_event_ns() is None

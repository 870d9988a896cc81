# SPDX-License-Identifier: MIT
"""FIFO, interrupts, motion engine and the clones of the chip model."""

from itertools import pairwise

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.master import Master


class Counting:
    """x of the gyro is the time in milliseconds, in dps; a knock of 0.5 g on y at `knock_s`."""

    duration_s = None

    def __init__(self, knock_s=None):
        self.knock_s = knock_s

    def at(self, t_s):
        knock = self.knock_s is not None and self.knock_s <= t_s < self.knock_s + 0.1
        return (0.1, -0.5 if knock else 0.2, 1.0, t_s * 1000, -t_s * 100, 5.0, 25.0)


def make(motion=None, **settings):
    settings.setdefault("noise", False)
    chip = MPU6050Chip(motion or Counting(), **settings)
    master = Master(Bus(chip), bit_ns=0)
    master.run_s(0.01)
    master.write(0x1A, 1)
    master.write(0x1B, 0x18)
    master.write(0x6B, 0x01)
    master.run_s(0.1)
    return chip, master


def count(master):
    return int.from_bytes(master.read(0x72, 2), "big")


def start_fifo(master, enable=0x78):
    master.write(0x6A, 0x00)
    master.write(0x23, enable)
    master.write(0x6A, 0x04)
    master.write(0x6A, 0x40)


# FIFO


@pytest.mark.parametrize(
    "enable, size", [(0x08, 6), (0x70, 6), (0x78, 12), (0xF8, 14), (0x80, 2), (0x40, 2), (0x28, 8)]
)
def test_packet_sizes(enable, size):
    _, master = make()
    start_fifo(master, enable)
    master.run_s(0.0205)
    assert count(master) == 20 * size


def test_packets_are_the_registers_in_order():
    _, master = make()
    start_fifo(master, 0xF8)
    master.run_s(0.0015)
    burst = master.read(0x3B, 14)
    assert count(master) == 14
    assert master.read(0x74, 14) == burst
    assert count(master) == 0


def test_every_sample_is_in_it_once():
    _, master = make()
    start_fifo(master, 0x40)
    master.run_s(0.3)
    data = master.read(0x74, count(master))
    values = [int.from_bytes(data[n : n + 2], "big", signed=True) for n in range(0, len(data), 2)]
    assert len(values) == 300
    steps = {b - a for a, b in pairwise(values)}
    assert steps <= {16, 17}  # 1 dps a sample at 16.4 LSB


def test_overflow_drops_the_oldest_and_misaligns():
    _, master = make()
    start_fifo(master)
    master.run_s(0.0855)
    assert count(master) == 1020
    master.run_s(0.001)
    assert count(master) == 1024
    last = master.read(0x3B, 14)
    data = master.read(0x74, 1024)
    assert data[-12:] == last[:6] + last[8:], "the newest sample is complete"
    assert 1024 % 12 == 4, "and the oldest is not"
    assert data[4:10] == data[16:22], "accelerometer, four bytes on"


def test_empty_fifo_repeats_its_last_byte():
    _, master = make()
    start_fifo(master)
    master.run_s(0.0015)
    master.write(0x6A, 0x00)
    data = master.read(0x74, 20)
    assert data[12:] == data[11:12] * 8
    assert count(master) == 0


def test_reset_works_only_while_disabled():
    _, master = make()
    start_fifo(master)
    master.run_s(0.01)
    master.write(0x6A, 0x44)
    assert count(master) > 0
    master.write(0x6A, 0x04)
    assert count(master) == 0
    assert master.read(0x6A) == b"\x00", "the bit clears itself"


def test_low_count_byte_belongs_to_the_last_high_one():
    _, master = make()
    start_fifo(master)
    master.run_s(0.03)
    assert master.read(0x72) == bytes([360 >> 8])
    master.run_s(0.01)
    assert master.read(0x73) == bytes([360 & 255])
    assert count(master) > 360


# interrupts


class Edges:
    """Records the edges of the INT pin with their times."""

    def __init__(self, chip):
        self.chip, self.seen = chip, []
        chip.on_int = lambda level: self.seen.append((chip.now_ns, level))

    def rising(self):
        return [t for t, level in self.seen if level]


def test_data_ready_pulses():
    chip, master = make()
    edges = Edges(chip)
    master.write(0x19, 3)
    master.write(0x38, 0x01)
    master.run_s(0.1005)
    rises = edges.rising()
    assert len(rises) == 25
    assert {b - a for a, b in pairwise(rises)} == {4_000_000}
    falls = [t for t, level in edges.seen if not level]
    assert falls[0] - rises[0] == 50_000, "a pulse of 50 us"
    assert chip.int_level == 0


def test_latched_until_status_is_read():
    chip, master = make()
    edges = Edges(chip)
    master.write(0x37, 0x20)
    master.write(0x38, 0x01)
    master.run_s(0.01)
    assert (chip.int_level, len(edges.seen)) == (1, 1)
    master.counts()
    assert chip.int_level == 1, "reading data does not clear it"
    assert master.read(0x3A) == b"\x01"
    assert chip.int_level == 0
    assert master.read(0x3A) == b"\x00", "cleared by reading"
    master.run_s(0.0015)
    assert chip.int_level == 1


def test_latched_until_anything_is_read():
    chip, master = make()
    master.write(0x37, 0x30)
    master.write(0x38, 0x01)
    master.run_s(0.002)
    assert chip.int_level == 1
    master.counts()
    assert chip.int_level == 0


def test_sample_within_a_burst_keeps_its_interrupt():
    """Clearing on any read happens at the start of the read: nothing is lost."""
    chip, master = make()
    slow = Master(master.bus)  # 400 kHz: a burst takes 0.4 ms
    master.write(0x37, 0x30)
    master.write(0x38, 0x01)
    sample = chip.next_event_ns()
    master.run_until(sample + 3_900_000)
    assert chip.int_level == 1
    slow.counts()
    assert chip.now_ns > sample + 4_000_000
    assert chip.int_level == 1


def test_active_low():
    chip, master = make()
    master.write(0x37, 0xA0)
    assert chip.int_level == 1
    master.write(0x38, 0x01)
    master.run_s(0.002)
    assert chip.int_level == 0


def test_without_enable_no_interrupt_and_no_status():
    chip, master = make()
    edges = Edges(chip)
    master.run_s(0.01)
    assert master.read(0x3A) == b"\x00"
    assert edges.seen == []


def test_overflow_interrupt():
    chip, master = make()
    edges = Edges(chip)
    master.write(0x37, 0x20)
    master.write(0x38, 0x10)
    start_fifo(master)
    master.run_s(0.0855)
    assert edges.seen == []
    master.run_s(0.001)
    assert len(edges.rising()) == 1
    assert master.read(0x3A)[0] & 0x10


def test_jump_in_time_gives_the_same_status():
    _, master = make()
    master.write(0x38, 0x11)
    start_fifo(master)
    master.bus.advance(master.bus.now_ns + 100_000_000)
    assert master.read(0x3A) == b"\x11"
    assert count(master) == 1024


@pytest.mark.parametrize(
    "threshold, duration, fires", [(20, 5, True), (23, 5, False), (10, 200, 0)]
)
def test_motion_interrupt(threshold, duration, fires):
    """A 0.7 g knock of 100 ms; 32 mg per LSB, 1 ms per LSB."""
    chip, master = make(Counting(knock_s=0.6))
    edges = Edges(chip)
    master.write(0x1C, 0x04)  # high-pass 0.63 Hz
    master.write(0x1F, threshold)
    master.write(0x20, duration)
    master.write(0x37, 0x20)
    master.write(0x38, 0x40)
    master.run_s(0.4)
    assert edges.seen == []
    master.run_s(0.5)
    assert len(edges.rising()) == bool(fires)
    if fires:
        assert 0.600 + duration / 1000 < edges.rising()[0] / 1e9 < 0.610 + duration / 1000
        assert master.read(0x61)[0] & 0x20, "y, negative"
        assert master.read(0x3A) == b"\x40"


def test_motion_interrupt_needs_the_high_pass():
    chip, master = make(Counting(knock_s=0.2))
    edges = Edges(chip)
    master.write(0x1F, 1)
    master.write(0x20, 1)
    master.write(0x38, 0x40)
    master.run_s(0.5)
    assert edges.seen == []


# parts sold as MPU6050

CLONES = {"MPU6050": 0x68, "MPU6500": 0x70, "MPU9250": 0x71, "MPU9255": 0x73, "MPU6515": 0x74}
CLONES["ICM20689"] = 0x98


@pytest.mark.parametrize("name, who", CLONES.items())
def test_who_am_i(name, who):
    for profile in (name, who):
        master = Master(Bus(MPU6050Chip(profile=profile)))
        assert master.read(0x75)[0] == who


def test_unknown_profile():
    with pytest.raises(ValueError, match="MPU6050"):
        MPU6050Chip(profile="BMI160")


@pytest.mark.parametrize("name, lsb, zero", [("MPU6500", 333.87, 21), ("ICM20689", 326.8, 25)])
def test_clone_temperature(name, lsb, zero):
    _, master = make(profile=name)
    assert master.counts()[3] == pytest.approx((25 - zero) * lsb, abs=1)


@pytest.mark.parametrize("name, size", [("MPU6050", 1024), ("MPU6500", 512), ("ICM20689", 4096)])
def test_clone_fifo(name, size):
    _, master = make(profile=name)
    start_fifo(master, 0xF8)
    master.run_s(0.4)
    assert count(master) == size


def test_clone_has_a_second_accelerometer_filter():
    """CONFIG filters the gyro only; register 0x1D filters the accelerometer."""

    class Jump:
        duration_s = None

        def at(self, t_s):
            return (1.0 if t_s >= 0.5 else 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0)

    for second, settled in ((0, True), (6, False)):
        _, master = make(Jump(), profile="MPU6500")
        master.write(0x1A, 6)
        master.write(0x1D, second)
        master.run_until(515_000_000)
        assert (master.counts()[0] > 16000) is settled


def test_clone_accel_offsets_are_elsewhere():
    _, master = make(profile="MPU6500")
    before = master.counts()
    moved = (master.word(0x7A) + 1024) & 0xFFFF
    master.write(0x7A, moved >> 8, moved & 0xFF)
    master.write(0x06, 0x10)
    master.run_s(0.1)
    after = master.counts()
    assert abs(after[1] - before[1] - 8192) <= 16
    assert abs(after[0] - before[0]) <= 1


def test_clone_has_no_motion_engine():
    chip, master = make(Counting(knock_s=0.2), profile="MPU6500")
    edges = Edges(chip)
    master.write(0x1C, 0x04)
    master.write(0x1F, 1)
    master.write(0x20, 1)
    master.write(0x38, 0x40)
    master.run_s(0.5)
    assert edges.seen == []

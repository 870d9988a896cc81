# SPDX-License-Identifier: MIT
"""Each fault does what it says, when it says, and ends; scenario files."""

import json

import pytest

from tools.virtual import faults
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.master import Master
from tools.virtual.motion import FreeMotion


def make(fault=None, **settings):
    chip = MPU6050Chip(FreeMotion(1), **settings)
    bus = Bus(chip)
    master = Master(bus)
    master.write(0x1A, 1)
    master.write(0x1B, 0x08)
    master.write(0x6B, 0x01)
    master.run_until(100_000_000)
    if fault is not None:
        bus.faults.append(fault)
    return chip, master


def test_nack_lasts_as_long_as_told():
    fault = faults.Nack(at_s=0.2, for_s=0.05)
    _, master = make(fault)
    master.run_until(199_000_000)
    master.read(0x75)
    assert (fault.pending, fault.active) == (True, False)
    master.run_until(201_000_000)
    with pytest.raises(OSError):
        master.read(0x75)
    assert fault.active and fault.hits == 1
    master.run_until(250_000_000)
    assert master.read(0x75) == b"h"
    assert fault.done


def test_nack_with_a_probability_follows_its_seed():
    def pattern(seed):
        _, master = make(faults.Nack(p=0.5, seed=seed))
        seen = []
        for _ in range(40):
            try:
                master.read(0x75)
                seen.append(1)
            except OSError:
                seen.append(0)
        return seen

    assert pattern(1) == pattern(1) != pattern(2)
    assert 0 < sum(pattern(1)) < 30


def test_nack_of_data():
    _, master = make(faults.Nack(data=True))
    master.run_s(0.001)
    assert master.bus.start(0x68, False)
    assert not master.bus.write(0x1B)
    master.bus.stop()
    assert master.bus.log[-1].outcome == "data_nack"


def test_fault_ends_at_its_time_without_traffic():
    fault = faults.BrownOut(at_s=0.2, for_s=0.01)
    _, master = make(fault)
    master.bus.advance(10_000_000_000)
    assert fault.done
    assert master.read(0x6B) == b"\x40"


def test_brown_out_forgets_everything():
    _, master = make(faults.BrownOut(at_s=0.2))
    assert any(master.read(0x3B, 14))
    master.run_until(200_500_000)
    with pytest.raises(OSError):
        master.read(0x75)
    master.run_until(230_000_000)
    assert master.read(0x6B) == b"\x40", "asleep"
    assert master.read(0x1B) == b"\x00", "default range"
    assert master.read(0x3B, 14) == bytes(14), "zeros"


def test_unplugged_and_another_part_comes_back():
    chip, master = make(faults.Unplugged(at_s=0.2, for_s=0.3, profile="ICM20689"))
    master.run_until(300_000_000)
    with pytest.raises(OSError):
        master.read(0x75)
    assert chip.int_level == 0
    master.run_until(600_000_000)
    assert master.read(0x75) == b"\x98"


def test_stuck_data_repeats_while_data_ready_goes_on():
    chip, master = make(faults.StuckData(at_s=0.2, for_s=0.1))
    edges = []
    chip.on_int = edges.append
    master.write(0x38, 0x01)
    master.run_until(210_000_000)
    first, before = master.counts(), len(edges)
    master.run_until(290_000_000)
    assert master.counts() == first
    assert len(edges) > before + 100
    master.run_until(310_000_000)
    assert master.counts() != first


@pytest.mark.parametrize("value", [0xFE, 0xFF, 0x00])
def test_filled(value):
    _, master = make(faults.Filled(value, at_s=0.2, for_s=0.1))
    master.run_until(201_000_000)
    assert master.read(0x3B, 14) == bytes([value]) * 14
    assert master.read(0x75) == bytes([value])
    master.run_until(301_000_000)
    assert master.read(0x75) == b"h"


def test_bit_flips_hit_every_bit_and_only_some_bursts():
    fault = faults.BitFlip(p=0.6, seed=5)
    chip, master = make(fault)
    chip.set_frozen(True)
    good = bytes(chip.registers[0x3B:0x49])
    where = set()
    wrong = 0
    for _ in range(1500):
        data = master.read(0x3B, 14)
        bits = [n for n in range(112) if (data[n // 8] ^ good[n // 8]) >> n % 8 & 1]
        assert len(bits) <= 1
        wrong += len(bits)
        where.update(bits)
    assert where == set(range(112))
    assert wrong == fault.hits == pytest.approx(900, rel=0.15)


def test_dead_int_line():
    chip, master = make(faults.IntDead(at_s=0.2, for_s=0.1))
    edges = []
    chip.on_int = lambda level: edges.append(chip.now_ns)
    master.write(0x38, 0x01)
    master.run_until(400_000_000)
    assert edges
    assert not [t for t in edges if 201_000_000 < t < 300_000_000]
    assert [t for t in edges if t > 300_000_000]


def test_clock_off():
    """2 % fast: 1020 samples a second."""
    chip, master = make(faults.ClockOff(0.02, at_s=0.2, for_s=0.4))
    rises = []
    chip.on_int = lambda level: rises.append(chip.now_ns) if level else None
    master.write(0x38, 0x01)
    master.run_until(1_000_000_000)
    fast = len([t for t in rises if 0.2e9 < t <= 0.6e9])
    after = len([t for t in rises if 0.6e9 < t <= 1e9])
    assert abs(fast - 408) <= 1
    assert abs(after - 400) <= 1


def start_fifo(master):
    master.write(0x23, 0x78)
    master.write(0x6A, 0x40)


def test_fifo_overflow():
    chip, master = make(faults.FifoOverflow(at_s=0.15))
    start_fifo(master)
    master.run_until(150_000_000)
    assert len(chip.fifo) == 1024


def test_fifo_misaligned():
    chip, master = make(faults.FifoMisaligned(lost=3, at_s=0.15))
    start_fifo(master)
    master.run_until(149_000_000)
    assert int.from_bytes(master.read(0x72, 2), "big") % 12 == 0
    master.run_until(151_000_000)
    assert int.from_bytes(master.read(0x72, 2), "big") % 12 == 9
    assert chip.fifo


def test_saturation():
    _, master = make(faults.Saturation((20, 0, -20), (0, 3000, 0), at_s=0.2, for_s=0.1))
    master.run_until(290_000_000)
    ax, _, az, _, gx, gy, _ = master.counts()
    assert (ax, az, gy) == (32767, -32768, 32767)
    assert abs(gx) < 32767
    master.run_until(400_000_000)
    assert abs(master.counts()[0]) < 32767


def test_fault_may_be_added_late():
    """Its time has passed already: it begins at once."""
    _, master = make()
    master.run_until(500_000_000)
    master.bus.faults.append(faults.Nack(at_s=0.2))
    with pytest.raises(OSError):
        master.read(0x75)


def test_fault_taken_off_the_list_ends():
    _, master = make(faults.StuckData(at_s=0.2))
    master.run_until(300_000_000)
    frozen = master.counts()
    master.bus.faults.clear()
    master.run_until(400_000_000)
    assert master.counts() != frozen


def test_fault_swapped_for_another():
    _, master = make(faults.Nack(at_s=0.2))
    master.run_until(300_000_000)
    master.bus.faults[:] = [faults.Filled(0xFF, at_s=0.1)]
    master.run_s(0.001)
    assert master.read(0x75) == b"\xff"


def test_unknown_address_is_an_error():
    _, master = make(faults.BrownOut(at_s=0.2, address=0x50))
    with pytest.raises(LookupError, match="80"):
        master.run_until(300_000_000)


# scenario files


def test_scenario_file(tmp_path):
    path = tmp_path / "scenario.json"
    entries = [
        {"at_s": 1.5, "fault": "nack", "for_s": 0.02},
        {"at_s": 2, "fault": "filled", "for_s": 0.1, "value": 255},
        {"at_s": 3, "fault": "sda_held", "clocks": 5},
    ]
    path.write_text(json.dumps(entries))
    nack, filled, held = faults.load_scenario(path)
    assert isinstance(nack, faults.Nack)
    assert (nack.start_ns, nack.end_ns) == (1_500_000_000, 1_520_000_000)
    assert isinstance(filled, faults.Filled)
    assert held.end_ns is None


def test_every_name_makes_a_fault():
    for name in faults.FAULTS:
        fault = faults.make(name, at_s=0.5, for_s=0.1, seed=3)
        assert fault.start_ns == 500_000_000
        assert fault.end_ns == 600_000_000


@pytest.mark.parametrize(
    "entry, text",
    [
        ({"at_s": 1, "fault": "gremlin"}, "sda_held"),
        ({"at_s": 1, "fault": "nack", "volume": 11}, "volume"),
        ({"fault": "nack"}, "at_s"),
        ({"at_s": "soon", "fault": "nack"}, "entry 1"),
        ({"at_s": 1, "fault": "filled", "value": 256}, "256"),
        ({"at_s": 1, "fault": "nack", "for_s": -1}, "negative"),
        ("nack", "entry 1"),
    ],
)
def test_scenario_errors_name_the_entry(entry, text):
    with pytest.raises(ValueError, match=text) as caught:
        faults.load_scenario([{"at_s": 0, "fault": "nack"}, entry])
    assert "entry 1" in str(caught.value)


def test_scenario_that_is_not_json(tmp_path):
    path = tmp_path / "scenario.json"
    path.write_text("[{]")
    with pytest.raises(ValueError, match=r"scenario\.json"):
        faults.load_scenario(path)
    with pytest.raises(ValueError, match="list"):
        path.write_text("{}")
        faults.load_scenario(path)

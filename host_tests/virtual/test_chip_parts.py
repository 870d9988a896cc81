# SPDX-License-Identifier: MIT
"""Parts at their tolerances, and what the 6500 family does in its own way."""

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.chip.tolerances import typical, worst_case
from tools.virtual.master import Master
from tools.virtual.motion import Sinusoid, Still


def make(motion=None, **settings):
    chip = MPU6050Chip(motion or Still(), noise=False, **settings)
    master = Master(Bus(chip))
    master.run_s(0.001)
    master.write(0x1A, 1)
    master.write(0x6B, 0x01)
    master.run_s(0.1)
    return chip, master


def test_worst_part_is_at_the_limits():
    """3 % scale, 50, 50, 80 mg, 20 dps, 2 % cross-axis."""
    part = worst_case(seed=4)
    assert [abs(v) for v in part["accel_bias_g"]] == [0.05, 0.05, 0.08]
    assert [abs(v) for v in part["gyro_bias_dps"]] == [20, 20, 20]
    _, master = make(**part)
    ax, ay, az, _, gx, gy, gz = master.counts()
    gain = part["accel_matrix"][2][2]
    assert abs(gain - 1) == pytest.approx(0.03)
    assert abs(ax) / 16384 == pytest.approx(0.05, abs=0.0201)
    assert abs(ay) / 16384 == pytest.approx(0.05, abs=0.0201)
    assert az / 16384 == pytest.approx(gain + part["accel_bias_g"][2], abs=1e-4)
    assert [abs(g) / 131 for g in (gx, gy, gz)] == pytest.approx([20] * 3, abs=0.01)


def test_typical_parts_differ_and_stay_within_the_limits():
    parts = [typical(seed) for seed in range(50)]
    biases = [part["gyro_bias_dps"][0] for part in parts]
    assert len(set(biases)) == 50
    assert max(map(abs, biases)) <= 20
    assert typical(3) == typical(3)


def test_6500_self_test():
    """2620 x 1.01^(code - 1) LSB at 250 dps and 2 g; codes in 0x00-0x02 and 0x0D-0x0F."""
    _, master = make(profile="MPU6500", trim_codes=((1, 50, 200), (10, 100, 150)))
    assert master.read(0x00, 3) == bytes([1, 50, 200])
    assert master.read(0x0D, 3) == bytes([10, 100, 150])
    off = master.counts()
    master.write(0x1B, 0xE0)
    master.write(0x1C, 0xE0)
    master.run_s(0.2)
    on = master.counts()
    gyro = [2620 * 1.01 ** (code - 1) for code in (1, 50, 200)]
    accel = [2620 * 1.01 ** (code - 1) for code in (10, 100, 150)]
    assert [b - a for a, b in zip(off[4:], on[4:])] == pytest.approx(gyro, abs=1.01)
    assert [b - a for a, b in zip(off[:3], on[:3])] == pytest.approx(accel, abs=1.01)


def test_6500_runs_after_reset():
    chip = MPU6050Chip(profile="MPU6500")
    master = Master(Bus(chip))
    assert master.read(0x6B) == b"\x01"
    master.run_s(0.1)
    assert master.counts()[2] > 15000


def test_6500_fifo_may_stop_when_full():
    """CONFIG bit 6: the oldest samples stay, whole packets only."""
    _, master = make(profile="MPU6500")
    master.write(0x1A, 0x41)
    master.write(0x23, 0x78)
    master.write(0x6A, 0x40)
    master.run_s(0.2)
    assert int.from_bytes(master.read(0x72, 2), "big") == 504


@pytest.mark.parametrize(
    "profile, register, code, hz", [(0x70, 0x1E, 7, 31.25), (0x98, 0x19, 49, 20)]
)
def test_cycle_rate_of_the_clones(profile, register, code, hz):
    chip, master = make(Sinusoid(), profile=profile)
    edges = []
    master.write(register, code)
    master.write(0x38, 0x01)
    master.write(0x6B, 0x21)
    chip.on_int = lambda level: edges.append(level)
    master.run_s(2.0)
    assert sum(edges) == pytest.approx(2 * hz, abs=1.5)

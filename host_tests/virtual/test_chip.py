# SPDX-License-Identifier: MIT
"""The chip model against the datasheet (PS-MPU-6000A, RM-MPU-6000A), its numbers typed again."""

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.master import Master

GYRO_LSB = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
ACCEL_LSB = {2: 16384, 4: 8192, 8: 4096, 16: 2048}


class Constant:
    """The same values for ever."""

    duration_s = None

    def __init__(self, accel=(0.0, 0.0, 1.0), gyro=(0.0, 0.0, 0.0), temp=25.0):
        self.values = (*accel, *gyro, temp)

    def at(self, t_s):
        return self.values

    def truth(self, t_s):
        return (1.0, 0.0, 0.0, 0.0)


class Ramp(Constant):
    """All axes rise together: 100 mg and 100 dps a second, from -1."""

    def at(self, t_s):
        return (*[0.1 * t_s] * 3, *[100 * t_s - 100] * 3, 25.0)


def make(motion=None, wake=True, **settings):
    settings.setdefault("noise", False)
    chip = MPU6050Chip(motion, **settings)
    master = Master(Bus(chip), chip.address)
    master.run_s(0.001)
    if wake:
        master.write(0x1A, 3)
        master.write(0x6B, 0x01)
        master.run_s(0.2)
    return chip, master


def test_reset_values():
    _, master = make(wake=False)
    assert master.read(0x6B) == b"\x40"
    assert master.read(0x75) == b"\x68"
    assert master.read(0x19, 4) == bytes(4)  # divider, CONFIG, GYRO_CONFIG, ACCEL_CONFIG
    assert master.read(0x37, 2) == bytes(2)
    assert master.read(0x3B, 14) == bytes(14)
    assert master.read(0x72, 2) == bytes(2)
    assert any(master.read(0x0D, 4)), "the factory has burnt trim codes in"
    master.run_s(1.0)
    assert master.read(0x3B, 14) == bytes(14), "asleep: no samples"


@pytest.mark.parametrize("code, full", list(enumerate(GYRO_LSB)))
def test_gyro_ranges(code, full):
    rates = (full * 0.99, -full * 0.31, full * 0.07)
    _, master = make(Constant(gyro=rates))
    master.write(0x1B, code << 3)
    master.run_s(0.1)
    for count, rate in zip(master.counts()[4:], rates):
        assert abs(count - rate * GYRO_LSB[full]) <= 1


@pytest.mark.parametrize("code, full", list(enumerate(ACCEL_LSB)))
def test_accel_ranges(code, full):
    forces = (-full * 0.99, full * 0.43, -full * 0.11)
    _, master = make(Constant(accel=forces))
    master.write(0x1C, code << 3)
    master.run_s(0.1)
    for count, force in zip(master.counts()[:3], forces):
        assert abs(count - force * ACCEL_LSB[full]) <= 1


def test_saturation_is_the_int16_range():
    _, master = make(Constant(accel=(2.2, -2.2, 0), gyro=(300, -300, 0)))
    ax, ay, az, _, gx, gy, gz = master.counts()
    assert (ax, ay, az, gx, gy, gz) == (32767, -32768, 0, 32767, -32768, 0)


@pytest.mark.parametrize("temp_c", [-10.0, 36.53, 50.0])
def test_temperature(temp_c):
    _, master = make(Constant(temp=temp_c))
    assert abs(master.counts()[3] / 340 + 36.53 - temp_c) <= 1 / 340


@pytest.mark.parametrize("watching", [False, True])
def test_burst_is_one_instant_and_single_reads_are_not(watching):
    """Also while the chip itself looks at each sample, for the FIFO's overflow interrupt."""
    _, master = make(Ramp())
    if watching:
        master.write(0x38, 0x10)
        master.write(0x23, 0x78)
        master.write(0x6A, 0x40)
    master.write(0x1B, 0x18)
    master.run_s(0.5)
    master.run_s(0.0009)  # the next sample comes within the burst, which takes 0.4 ms
    for _ in range(50):
        ax, ay, az, _, gx, gy, gz = master.counts()
        assert ax == ay == az
        assert gx == gy == gz
        master.run_s(0.0006)
    torn = 0
    for _ in range(50):
        values = [master.word(0x43 + 2 * n) for n in range(3)]
        torn += values != [values[0]] * 3
    assert torn > 10


@pytest.mark.parametrize("value", [-1, 256, 1000, 1.5, None])
def test_values_beyond_a_byte_are_refused(value):
    chip, master = make()
    with pytest.raises((ValueError, TypeError)):
        master.write(0x1B, value)
    with pytest.raises((ValueError, TypeError)):
        chip.write(value)


def test_registers_hold_what_is_written_and_read_only_ones_do_not():
    _, master = make()
    for register in (0x19, 0x1A, 0x1B, 0x1C, 0x1F, 0x20, 0x23, 0x37, 0x38, 0x69, 0x6C, 0x13, 0x06):
        master.write(register, 0x15)
        assert master.read(register) == b"\x15", hex(register)
        master.write(register, 0x00)
    assert master.read(0x02) == b"\x00"
    master.write(0x02, 0xA5)
    assert master.read(0x02) == b"\xa5"
    for register in (0x75, 0x3B, 0x48, 0x61, 0x72):
        before = master.read(register)
        master.write(register, 0xA5)
        assert master.read(register) == before, hex(register)


def test_consecutive_registers_in_one_write():
    _, master = make()
    master.write(0x19, 3, 2, 0x08, 0x10)
    assert master.read(0x19, 4) == bytes([3, 2, 0x08, 0x10])


def test_device_reset_takes_time_and_forgets():
    _, master = make(Constant(gyro=(100, 0, 0)))
    master.write(0x1B, 0x18)
    master.write(0x13, 0x12)
    assert any(master.read(0x3B, 14))
    master.write(0x6B, 0x80)
    assert master.read(0x6B)[0] & 0x80, "still resetting"
    master.write(0x1B, 0x08)
    assert master.read(0x1B) == b"\x00", "a write during the reset is lost"
    master.run_s(0.1)
    assert master.read(0x6B) == b"\x40"
    assert master.read(0x1B) == b"\x00"
    assert master.read(0x13) == b"\x00"
    assert master.read(0x3B, 14) == bytes(14)


def test_sleep_keeps_the_last_sample():
    _, master = make(Ramp())
    master.write(0x6B, 0x41)
    last = master.read(0x3B, 14)
    master.run_s(0.5)
    assert master.read(0x3B, 14) == last
    assert any(last)
    master.write(0x6B, 0x01)
    master.run_s(0.1)
    assert master.read(0x3B, 14) != last


def test_gyro_needs_30_ms_after_sleep():
    _, master = make(Constant(gyro=(100, 100, 100)))
    master.write(0x6B, 0x41)
    master.run_s(0.1)
    master.write(0x6B, 0x01)
    master.run_s(0.005)
    assert abs(master.counts()[4] / 131 - 100) > 5
    master.run_s(0.06)
    assert abs(master.counts()[4] / 131 - 100) < 0.1


def test_standby_axes_stand_still():
    _, master = make(Ramp())
    master.write(0x6C, 0x20 | 0x01)  # STBY_XA, STBY_ZG
    before = master.counts()
    master.run_s(0.5)
    after = master.counts()
    moved = [a != b for a, b in zip(before, after)]
    assert moved == [False, True, True, False, True, True, False]


def test_cycle_mode_samples_at_its_rate():
    """LP_WAKE_CTRL 1 is 5 Hz."""
    _, master = make(Ramp())
    master.write(0x6C, 0x40 | 0x07)
    master.write(0x6B, 0x28)
    seen = set()
    for _ in range(100):
        master.run_s(0.02)
        seen.add(master.counts()[0])
    assert 9 <= len(seen) <= 12


def test_stopped_clock_stops_the_samples():
    _, master = make(Ramp())
    master.write(0x6B, 0x07)
    last = master.counts()
    master.run_s(0.5)
    assert master.counts() == last


@pytest.mark.parametrize("divider", [0, 1, 3, 9, 255])
def test_sample_rate_divider(divider):
    """1 kHz / (1 + SMPLRT_DIV), counted by the FIFO."""
    _, master = make()
    master.write(0x19, divider)
    master.write(0x23, 0x40)  # x of the gyro: 2 bytes a sample
    master.write(0x6A, 0x40)
    master.run_s(0.5)
    count = int.from_bytes(master.read(0x72, 2), "big") / 2
    assert abs(count - 500 / (1 + divider)) <= 1.5


@pytest.mark.parametrize("error", [0.0, 0.01, -0.01])
def test_own_clock(error):
    _, master = make(clock_error=error)
    master.write(0x23, 0x40)
    master.write(0x6A, 0x40)
    master.run_s(0.5)
    count = int.from_bytes(master.read(0x72, 2), "big") / 2
    assert abs(count - 500 * (1 + error)) <= 1.5


def test_gyro_offset_registers():
    """32.8 LSB per dps whatever the range; gone after a reset."""
    _, master = make(Constant(gyro=(10, -20, 30)))
    master.write(0x13, 0x01, 0x48)  # 328: +10 dps
    master.write(0x15, 0xFD, 0x70)  # -656: -20 dps
    for code, lsb in enumerate((131, 65.5, 32.8, 16.4)):
        master.write(0x1B, code << 3)
        master.run_s(0.1)
        gx, gy, gz = master.counts()[4:]
        assert abs(gx - 20 * lsb) <= 1.5
        assert abs(gy + 40 * lsb) <= 1.5
        assert abs(gz - 30 * lsb) <= 1.5


def test_accel_offset_registers_start_from_the_factory_value():
    _, master = make(Constant(accel=(0.5, 0, 1.0)))
    factory = master.word(0x06)
    assert factory != 0
    moved = (factory + 1024) & 0xFFFF  # half a g at 2048 LSB per g
    master.write(0x06, moved >> 8, moved & 0xFF)
    master.run_s(0.1)
    ax, ay, az = master.counts()[:3]
    assert abs(ax - 16384) <= 16
    assert (ay, az) == (0, 16384)
    master.write(0x6B, 0x80)
    master.run_s(0.1)
    assert master.word(0x06) == factory


def test_imperfections():
    """measured = matrix x true + bias + slope x (T - 25)."""
    skewed = ((1.03, 0.02, 0), (0, 0.97, -0.02), (0, 0, 1))
    _, master = make(
        Constant(accel=(0.5, -0.5, 1.0), gyro=(10, 20, 30), temp=35.0),
        accel_matrix=skewed,
        accel_bias_g=(0.05, 0, -0.08),
        gyro_bias_dps=(5, -6, 7),
        gyro_bias_dps_per_c=(0.1, 0, -0.2),
    )
    ax, ay, az, _, gx, gy, gz = master.counts()
    expected = (0.5 * 1.03 - 0.5 * 0.02 + 0.05, -0.5 * 0.97 - 0.02, 0.92)
    for count, value in zip((ax, ay, az), expected):
        assert abs(count - value * 16384) <= 1
    for count, value in zip((gx, gy, gz), (16, 14, 35)):
        assert abs(count - value * 131) <= 1


def test_two_chips_on_one_bus():
    bus = Bus(MPU6050Chip(noise=False), MPU6050Chip(noise=False, address=0x69))
    low, high = Master(bus, 0x68), Master(bus, 0x69)
    high.write(0x1B, 0x18)
    assert low.read(0x1B) == b"\x00"
    assert high.read(0x1B) == b"\x18"
    assert high.read(0x75) == b"\x68", "AD0 is not reflected"


def test_no_power_no_answer():
    chip, master = make()
    chip.power_off()
    with pytest.raises(OSError):
        master.read(0x75)
    chip.power_on()
    with pytest.raises(OSError):
        master.read(0x75)
    master.run_s(0.03)
    assert master.read(0x6B) == b"\x40"


def test_same_seed_same_noise():
    def run(seed):
        _, master = make(seed=seed, noise=True)
        return master.counts()

    assert run(1) == run(1)
    assert run(1) != run(2)

# SPDX-License-Identifier: MIT
"""DLPF, noise, rates and self-test of the chip model, the datasheet's tables typed again."""

import math

import numpy as np
import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.master import Master

# DLPF_CFG: accelerometer Hz, ms; gyro Hz, ms, kHz (RM-MPU-6000A r4.2, register 26)
DLPF = {
    0: (260, 0.0, 256, 0.98, 8),
    1: (184, 2.0, 188, 1.9, 1),
    2: (94, 3.0, 98, 2.8, 1),
    3: (44, 4.9, 42, 4.8, 1),
    4: (21, 8.5, 20, 8.3, 1),
    5: (10, 13.8, 10, 13.4, 1),
    6: (5, 19.0, 5, 18.6, 1),
}


class Tones:
    """A tone on x of the accelerometer (1 g) and one on x of the gyro (100 dps)."""

    duration_s = None

    def __init__(self, accel_hz, gyro_hz):
        self.accel_hz, self.gyro_hz = accel_hz, gyro_hz

    def at(self, t_s):
        accel = math.sin(2 * math.pi * self.accel_hz * t_s)
        gyro = 100 * math.sin(2 * math.pi * self.gyro_hz * t_s)
        return (accel, 0.0, 1.0, gyro, 0.0, 0.0, 25.0)


def samples(chip, settings, seconds, khz=1):
    """What the chip gives at each of its samples after waking: times, accel x g, gyro x dps."""
    master = Master(Bus(chip), bit_ns=0)
    for register, value in settings:
        master.write(register, value)
    master.write(0x6B, 0x01)
    rows = []
    for n in range(1, int(seconds * 1000 * khz)):
        master.run_until(int(n * 1e6 / khz) + 10_000)
        counts = master.counts()
        rows.append((n / 1000 / khz, counts[0] / 16384, counts[4] / 131))
    table = np.array(rows)
    return table[table[:, 0] > 0.25]


def response(times, values, hz, amplitude):
    """Gain and phase lag (radians, 0 to 2 pi) against amplitude x sin(2 pi hz t)."""
    basis = np.column_stack([np.sin(2 * np.pi * hz * times), np.cos(2 * np.pi * hz * times)])
    a, b = np.linalg.lstsq(basis, values, rcond=None)[0]
    return math.hypot(a, b) / amplitude, (-math.atan2(b, a)) % (2 * math.pi)


@pytest.mark.parametrize("code", DLPF)
def test_bandwidth(code):
    accel_hz, _, gyro_hz, _, khz = DLPF[code]
    chip = MPU6050Chip(Tones(accel_hz, gyro_hz), noise=False)
    seconds = 0.6 if accel_hz > 20 else 1.25
    times, accel, gyro = samples(chip, [(0x1A, code)], seconds, khz).T
    assert response(times, gyro, gyro_hz, 100)[0] == pytest.approx(math.sqrt(0.5), rel=0.02)
    kilohertz = np.isclose(np.round(times * 1000) / 1000, times)  # the accelerometer's own
    gain = response(times[kilohertz], accel[kilohertz], accel_hz, 1)[0]
    assert gain == pytest.approx(math.sqrt(0.5), rel=0.05 if code == 0 else 0.02)


@pytest.mark.parametrize("code", range(1, 7))
def test_delay(code):
    """Group delay at 5 Hz, from the phases at 4 and 6 Hz."""
    lags = []
    for hz in (4, 6):
        chip = MPU6050Chip(Tones(hz, hz), noise=False)
        times, accel, gyro = samples(chip, [(0x1A, code)], 1.25).T
        lags.append((response(times, accel, hz, 1)[1], response(times, gyro, hz, 100)[1]))
    for sensor, expected_ms in enumerate((DLPF[code][1], DLPF[code][3])):
        delay_ms = (lags[1][sensor] - lags[0][sensor]) / (2 * math.pi * 2) * 1000
        assert delay_ms == pytest.approx(expected_ms, abs=0.15)


def test_gyro_delay_without_the_filter():
    """DLPF_CFG 0: 0.98 ms at 8 kHz."""
    lags = []
    for hz in (4, 6):
        chip = MPU6050Chip(Tones(hz, hz), noise=False)
        times, _, gyro = samples(chip, [(0x1A, 0)], 0.5, 8).T
        lags.append(response(times, gyro, hz, 100)[1])
    assert (lags[1] - lags[0]) / (2 * math.pi * 2) * 1000 == pytest.approx(0.98, abs=0.05)


def test_dlpf_code_in_the_ext_sync_bits_does_not_filter():
    chip = MPU6050Chip(Tones(100, 100), noise=False)
    times, _, gyro = samples(chip, [(0x1A, 5 << 3)], 0.5, 8).T
    assert response(times, gyro, 100, 100)[0] > 0.85


def test_noise_density():
    """0.005 dps and 400 ug per square root of a hertz: the spread of 100 ms means."""
    chip = MPU6050Chip(seed=3)
    _, accel, gyro = samples(chip, [(0x1A, 1)], 10.25).T
    blocks = len(accel) // 100
    for values, density in ((accel, 400e-6), (gyro, 0.005)):
        means = values[: blocks * 100].reshape(blocks, 100).mean(axis=1)
        assert means.std() == pytest.approx(density * math.sqrt(1 / (2 * 0.1)), rel=0.2)


def test_a_narrow_filter_is_quieter():
    spread = {}
    for code in (1, 5):
        _, accel, _ = samples(MPU6050Chip(seed=1), [(0x1A, code)], 2.0).T
        spread[code] = accel.std()
    assert 3 < spread[1] / spread[5] < 6  # square root of 184 / 10 is 4.3


def test_catching_up_after_a_pause_gives_the_same_as_looking_all_the_time():
    def last(look_every_ms):
        master = Master(Bus(MPU6050Chip(Tones(3, 3), noise=False)), bit_ns=0)
        master.write(0x1A, 6)
        master.write(0x6B, 0x01)
        for ms in range(look_every_ms, 4001, look_every_ms):
            master.run_until(ms * 1_000_000)
            counts = master.counts()
        return counts

    assert last(4000) == last(1)


# self-test


def trims(codes):
    """Factory trim in LSB (PS-MPU-6000A 6.x): gyro at 250 dps, accelerometer at 8 g."""
    gyro = [25 * 131 * 1.046 ** (c - 1) for c in codes[0]]
    gyro[1] = -gyro[1]
    return gyro, [4096 * 0.34 * (0.92 / 0.34) ** ((c - 1) / 30) for c in codes[1]]


@pytest.mark.parametrize("codes", [((1, 16, 31), (31, 1, 13)), ((9, 10, 11), (12, 14, 15))])
def test_self_test_response_is_the_factory_trim(codes):
    master = Master(Bus(MPU6050Chip(noise=False, trim_codes=codes)))
    raw = master.read(0x0D, 4)
    assert tuple(value & 0x1F for value in raw[:3]) == codes[0]
    low = (raw[3] >> 4 & 3, raw[3] >> 2 & 3, raw[3] & 3)
    assert tuple((v >> 5) << 2 | two for v, two in zip(raw[:3], low)) == codes[1]
    master.write(0x6B, 0x01)
    master.write(0x1C, 0x10)
    master.write(0x1A, 2)
    master.run_s(0.2)
    off = master.counts()
    master.write(0x1B, 0xE0)
    master.write(0x1C, 0xF0)
    master.run_s(0.2)
    on = master.counts()
    gyro, accel = trims(codes)
    assert [b - a for a, b in zip(off[4:], on[4:])] == pytest.approx(gyro, abs=1)
    assert [b - a for a, b in zip(off[:3], on[:3])] == pytest.approx(accel, abs=1)


def test_self_test_bits_are_per_axis_and_a_bad_part_shows():
    codes = ((10, 10, 10), (10, 10, 10))
    master = Master(Bus(MPU6050Chip(noise=False, trim_codes=codes, self_test_error=0.3)))
    master.write(0x6B, 0x01)
    master.write(0x1A, 2)
    master.write(0x1B, 0x40)  # YG_ST
    master.run_s(0.2)
    gx, gy, gz = master.counts()[4:]
    assert (gx, gz) == (0, 0)
    assert gy == pytest.approx(1.3 * trims(codes)[0][1], abs=1)


def test_trim_code_0_means_no_response():
    master = Master(Bus(MPU6050Chip(noise=False, trim_codes=((0, 0, 0), (0, 0, 0)))))
    master.write(0x6B, 0x01)
    master.write(0x1B, 0xE0)
    master.run_s(0.2)
    assert master.counts()[4:] == [0, 0, 0]

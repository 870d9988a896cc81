# SPDX-License-Identifier: MIT
"""MinIMU9 against the chip models, facts typed from the ST data sheets; the platform on it."""

import numpy as np
import pytest

from tools.plants import closed_loop
from tools.plants.platform import Base, Platform
from tools.virtual.bus import Bus
from tools.virtual.chip.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.port import Port

# full scale, mdps per digit (L3GD20 table 4); full scale, mg per digit of 12 bits (LSM303DLHC
# table 3); and what the counts must be: the MPU6050's sensitivities at the same range
GYRO = {250: (8.75, 131.0), 500: (17.5, 65.5), 2000: (70.0, 16.4)}
ACCEL = {2: (1.0, 16384), 4: (2.0, 8192), 8: (4.0, 4096), 16: (12.0, 2048)}


class Feel:
    """Three different values on the axes of each sensor."""

    duration_s = None

    def __init__(self, force=(0.25, -0.5, 1.0), rate=(30.0, -60.0, 90.0), temp=25.0):
        self.sample = (*force, *rate, temp)

    def at(self, _t_s):
        return self.sample

    def truth(self, _t_s):
        return (1.0, 0.0, 0.0, 0.0)


def chips(motion=None, **gyro):
    motion = motion or Feel()
    return L3GD20Chip(motion, noise=False, **gyro), LSM303Chip(motion, noise=False)


def driver(port, **settings):
    import machine
    from minimu9 import MinIMU9

    i2c = machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4), freq=400_000)
    imu = MinIMU9(i2c, **settings)
    port.run_ms(100)
    return imu


@pytest.mark.parametrize("gyro_dps", GYRO)
@pytest.mark.parametrize("accel_g", ACCEL)
def test_each_range_in_its_own_digits(gyro_dps, accel_g):
    with Port("rp2", {0: Bus(*chips())}) as port:
        imu = driver(port, gyro_dps=gyro_dps, accel_g=accel_g)
        imu.read()
        mdps, gyro_lsb = GYRO[gyro_dps]
        mg, accel_lsb = ACCEL[accel_g]
        # one digit of the chip, and one count from the scaling
        assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=mdps / 1000 + 1 / gyro_lsb)
        assert imu.accel_g() == pytest.approx((0.25, -0.5, 1), abs=mg / 1000 + 1 / accel_lsb)
        assert imu.counts[2] == pytest.approx(accel_lsb, rel=mg / 1000 + 1e-3)
        assert imu.counts[4] == pytest.approx(30 * gyro_lsb, abs=gyro_lsb * mdps / 1000 + 1)


def test_registers_as_the_data_sheets_name_them():
    gyro, accel = chips()
    with Port("rp2", {0: Bus(gyro, accel)}) as port:
        driver(port, gyro_dps=2000, accel_g=16)
    assert gyro.registers[0x20] == 0b11_11_1_111  # 760 Hz, 100 Hz, awake, x y z
    assert gyro.registers[0x23] == 0b1010_0000  # BDU, 2000 deg/s
    assert accel.registers[0x20] == 0b0111_0111  # 400 Hz, x y z
    assert accel.registers[0x23] == 0b1011_1000  # BDU, 16 g, high resolution


def test_saturation_does_not_wrap():
    with Port("rp2", {0: Bus(*chips(Feel((9, -9, 9), (700, -700, 700))))}) as port:
        imu = driver(port, gyro_dps=500, accel_g=8)
        imu.read()
        assert list(imu.counts[:3]) == pytest.approx([32767, -32768, 32767], abs=20)
        assert list(imu.counts[4:]) == [32767, -32768, 32767]


def test_temperature_falls_by_a_count_each_degree():
    with Port("rp2", {0: Bus(*chips(Feel(temp=35.0)))}) as port:
        imu = driver(port)
        imu.read()
        warm = imu.temp_c()
    with Port("rp2", {0: Bus(*chips(Feel(temp=5.0)))}) as port:
        imu = driver(port)
        imu.read()
        assert warm - imu.temp_c() == 30


def test_a_chip_asleep_a_wrong_one_and_none():
    gyro, accel = chips(who_am_i=0xD7)
    with Port("rp2", {0: Bus(gyro, accel)}) as port, pytest.raises(OSError) as error:
        driver(port)
    assert "0xD7, expected 0xD4" in str(error.value)
    with Port("rp2", {0: Bus(accel)}) as port, pytest.raises(OSError) as error:
        driver(port)
    assert "no L3GD20 at 0x6B" in str(error.value)
    with Port("rp2", {0: Bus(*chips())}) as port, pytest.raises(ValueError, match="gyro_dps=1000"):
        driver(port, gyro_dps=1000)


def test_a_lost_setting_is_found_and_mended():
    gyro, accel = chips()
    with Port("rp2", {0: Bus(gyro, accel)}) as port:
        imu = driver(port)
        assert all(imu.check() for _ in range(imu.rows))
        accel.registers[0x20] = 0x07
        assert not all(imu.check() for _ in range(imu.rows))
        imu.rewind()
        assert [imu.repair() for _ in range(4)] == [False, False, False, True]
        assert accel.registers[0x20] == 0x77
        imu.reset_chip()
        assert gyro.registers[0x20] == 0x07
        imu.configure()
        assert all(imu.check() for _ in range(imu.rows))


def test_the_platform_runs_on_it_as_well():
    gyro, accel = L3GD20Chip(seed=1, gyro_bias_dps=(2, -1, 1)), LSM303Chip(seed=1)
    plant, _, stats = closed_loop.run(
        "platform", lambda port, pins: Platform(port, pins, Base(knock_at_s=4.2)), 5.2,
        chips=(gyro, accel),
    )  # fmt: skip
    log = plant.log()
    counted = log["t_s"] > 3.5
    assert np.abs(log["base_roll"][counted]).max() > 15
    for name in ("top_roll", "top_pitch"):
        assert np.sqrt(np.mean(log[name][counted] ** 2)) < 1.0
        assert np.abs(log[name][counted]).max() < 4.0
    assert stats["errors"] == stats["output_errors"] == 0

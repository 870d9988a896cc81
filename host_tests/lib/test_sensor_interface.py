# SPDX-License-Identifier: MIT
"""Both sensors by one interface: what filters, calibration and the app call on either."""

from contextlib import contextmanager

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.chip.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.faults import make
from tools.virtual.port import Port

both = pytest.mark.parametrize("kind", ("MPU6050", "MinIMU9"))
# the register that holds the gyro's range, at 0x68 and at 0x6B
RANGE = {"MPU6050": 0x1B, "MinIMU9": 0x23}


class Feel:
    """Three different values on the axes of each sensor."""

    duration_s = None

    def __init__(self, force=(0.25, -0.5, 0.75), rate=(30.0, -60.0, 90.0)):
        self.sample = (*force, *rate, 25.0)

    def at(self, _t_s):
        return self.sample

    def truth(self, _t_s):
        return (1.0, 0.0, 0.0, 0.0)


def made(kind, i2c, **settings):
    import minimu9
    import mpu6050

    return (mpu6050.MPU6050 if kind == "MPU6050" else minimu9.MinIMU9)(i2c, **settings)


def chips(kind, motion, **settings):
    if kind == "MPU6050":
        return [MPU6050Chip(motion, **settings)]
    return [L3GD20Chip(motion, **settings), LSM303Chip(motion, **settings)]


@contextmanager
def sensor(kind, motion=None, **settings):
    """(port, chips, driver) of a sensor without noise, running."""
    devices = chips(kind, motion or Feel(), noise=False)
    with Port("rp2", {0: Bus(*devices)}, wiring={0: (4, 5)}) as port:
        import machine

        i2c = machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4), freq=400_000)
        imu = made(kind, i2c, **settings)
        port.run_ms(300)
        yield port, devices, imu


@both
def test_counts_and_units_are_the_same(kind):
    with sensor(kind, gyro_dps=500, accel_g=4) as (_, _, imu):
        imu.read()
        assert (imu.gyro_lsb_per_dps, imu.accel_lsb_per_g) == (65.5, 8192)
        assert (imu.gyro_range_dps, imu.accel_range_g) == (500, 4)
        # one digit of the coarser chip: 17.5 mdps, 2 mg
        assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=0.04)
        assert imu.accel_g() == pytest.approx((0.25, -0.5, 0.75), abs=0.003)
        assert list(imu.counts[4:]) == [pytest.approx(65.5 * w, abs=3) for w in (30, -60, 90)]
        assert imu.plausible()
        assert 0 < imu.delay_s < 0.01
        assert isinstance(imu.temp_c(), float)
        imu.start()
        while not imu.collect():
            pass
        imu.finish()
        assert imu.same_part()


@both
@pytest.mark.parametrize("value", (0x00, 0xFE, 0xFF))
def test_a_filled_burst_is_not_plausible(kind, value):
    with sensor(kind) as (port, _, imu):
        bus = port.buses[0]
        bus.faults.append(make("filled", at_s=port.now_ns / 1e9, value=value))
        port.run_ms(1)
        imu.read()
        assert not imu.plausible()
        bus.faults.clear()
        bus.advance(port.now_ns)
        imu.read()
        assert imu.plausible()


@both
def test_a_lost_row_is_found_again_by_recheck_and_mended(kind):
    with sensor(kind, gyro_dps=2000) as (_, devices, imu):
        kept = devices[0].registers[RANGE[kind]]
        devices[0].registers[RANGE[kind]] = 0
        imu.rewind()
        for _ in range(imu.rows):
            if not imu.check():
                break
        assert not imu.recheck()
        devices[0].registers[RANGE[kind]] = kept
        assert imu.recheck()
        devices[0].registers[RANGE[kind]] = 0
        imu.rewind()
        while not imu.repair():
            pass
        assert devices[0].registers[RANGE[kind]] == kept


@both
def test_data_ready_is_a_verified_setting(kind):
    register, bit = (0x38, 0x01) if kind == "MPU6050" else (0x22, 0x08)
    with sensor(kind) as (_, devices, imu):
        rows = imu.rows
        imu.data_ready()
        assert devices[0].registers[register] & bit
        imu.data_ready(False)
        assert not devices[0].registers[register] & bit
        assert rows <= imu.rows <= rows + 1
        imu.rewind()
        assert all(imu.check() for _ in range(imu.rows))


@both
def test_another_part_in_its_place_is_seen(kind):
    with sensor(kind) as (_, devices, imu):
        if kind == "MPU6050":
            devices[0].power_on("MPU6500")
            assert not imu.same_part()
            assert imu.adopt()
            assert imu.profile.name == "MPU-6500"
        else:
            devices[0].registers[0x0F] = 0xD7  # an L3GD20H, whose ranges differ
            assert not imu.same_part()
            assert not imu.adopt()


@both
def test_it_can_be_calibrated(kind):
    from calibration.poses import Poses
    from calibration.rest import gyro_bias

    with sensor(kind, Feel((0.0, 0.0, 1.0), (1.0, -2.0, 3.0))) as (_, _, imu):
        cal = gyro_bias(imu, seconds=0.2)
        assert cal.gyro_bias_dps == pytest.approx((1, -2, 3), abs=0.04)
        assert cal.temp_c == pytest.approx(imu.temp_c(), abs=0.1)
        assert cal.who_am_i == imu.who_am_i
        assert Poses(imu).add(0.2) == "+z"


@both
def test_the_app_is_back_after_a_tenth_of_a_second_without_an_answer(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    devices = chips(kind, Feel((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)))
    with Port("rp2", {0: Bus(*devices)}, wiring={0: (4, 5)}) as port:
        from firmware.app import App

        app = App()
        app.config.set("rest_s", 0.1)
        app.imu = made(kind, app.board.i2c())
        app.start()
        port.run_ms(500)
        assert not app.stale
        port.buses[0].faults.append(make("nack", at_s=port.now_ns / 1e9, for_s=0.1))
        port.run_ms(100)
        assert app.stale
        port.run_ms(200)
        assert not app.stale
        assert abs(app.roll_deg) < 1 and abs(app.pitch_deg) < 1
        app.stop()
        assert port.errors == []

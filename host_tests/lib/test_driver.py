# SPDX-License-Identifier: MIT
"""The driver's configuration and its behaviour in flight, on each kind of bus."""

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig

PWR_MGMT_1, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, SMPLRT_DIV = 0x6B, 0x1A, 0x1B, 0x1C, 0x19


@pytest.mark.parametrize("kind", BUSES)
def test_construction_leaves_the_chip_as_asked(kind):
    with rig(kind) as r:
        imu = r.sensor(gyro_dps=1000, accel_g=16, dlpf_hz=94, rate_hz=500)
        registers = r.chip.registers
        assert registers[PWR_MGMT_1] == 0x01  # awake, clock from the gyro's PLL
        assert registers[SMPLRT_DIV] == 1  # 1 kHz / (1 + 1)
        assert registers[CONFIG] == 2
        assert registers[GYRO_CONFIG] == 0x10
        assert registers[ACCEL_CONFIG] == 0x18
        assert (imu.address, imu.who_am_i, imu.profile.name) == (0x68, 0x68, "MPU6050")
        assert (imu.gyro_range_dps, imu.accel_range_g, imu.dlpf_hz) == (1000, 16, 94)
        assert imu.rate_hz == 500


def test_reset_waits_as_the_datasheet_says():
    """Writes within the chip's reset are lost; the gyro swings in for 30 ms after waking."""
    with rig(motion=Feel(gyro=(10.0, 20.0, 30.0))) as r:
        imu = r.sensor(gyro_dps=250)
        assert r.port.now_ns >= 230e6
        resets = [t for t in r.transactions() if t.written == b"\x6b\x80"]
        assert len(resets) == 1
        imu.read()
        assert imu.gyro_dps() == pytest.approx((10.0, 20.0, 30.0), abs=0.5)


@pytest.mark.parametrize(
    "dlpf_hz, rate_hz, divider, true_hz",
    [
        (44, 1000, 0, 1000.0),
        (44, 250, 3, 250.0),
        (44, 300, 2, 1000 / 3),
        (5, 4, 249, 4.0),
        (260, 8000, 0, 8000.0),
        (260, 1000, 7, 1000.0),
    ],
)
def test_rate_is_the_nearest_and_told_truly(dlpf_hz, rate_hz, divider, true_hz):
    with rig() as r:
        imu = r.sensor(dlpf_hz=dlpf_hz, rate_hz=rate_hz)
        assert r.chip.registers[SMPLRT_DIV] == divider
        assert imu.rate_hz == pytest.approx(true_hz)


@pytest.mark.parametrize(
    "setting, allowed",
    [
        ({"gyro_dps": 300}, "250, 500, 1000, 2000"),
        ({"accel_g": 1}, "2, 4, 8, 16"),
        ({"dlpf_hz": 42}, "260, 184, 94, 44, 21, 10, 5"),
        ({"rate_hz": 3}, "3.90625 to 1000"),
        ({"rate_hz": 2000}, "3.90625 to 1000"),
    ],
)
def test_a_bad_setting_is_refused_before_the_bus_is_touched(setting, allowed):
    with rig() as r:
        with pytest.raises(ValueError, match=allowed):
            r.sensor(**setting)
        assert r.transactions() == []


def test_a_bad_range_at_run_time_changes_nothing():
    with rig() as r:
        imu = r.sensor()
        before = bytes(r.chip.registers)
        with pytest.raises(ValueError, match="2, 4, 8, 16"):
            imu.set_range(gyro_dps=1000, accel_g=3)
        assert bytes(r.chip.registers) == before


@pytest.mark.parametrize(
    "register, value",
    [(PWR_MGMT_1, 0x41), (0x6C, 0x38), (SMPLRT_DIV, 9), (CONFIG, 0), (GYRO_CONFIG, 0),
     (ACCEL_CONFIG, 0xE0), (0x23, 0x78), (0x37, 0x80), (0x38, 1), (0x6A, 0x40)],
)  # fmt: skip
def test_check_finds_any_changed_register_and_repair_mends_it(register, value):
    with rig() as r:
        imu = r.sensor()
        rows = 10
        assert all(imu.check() for _ in range(2 * rows))
        r.i2c.writeto_mem(0x68, register, bytes([value]))
        assert [imu.check() for _ in range(rows)].count(False) == 1
        imu.rewind()
        assert [imu.repair() for _ in range(rows)] == [False] * (rows - 1) + [True]
        assert all(imu.check() for _ in range(rows))


def test_check_is_one_short_transaction():
    with rig() as r:
        imu = r.sensor()
        for _ in range(10):
            r.transactions()
            imu.check()
            (only,) = r.transactions()
            assert len(only.written) == len(only.read) == 1


def test_check_follows_what_was_changed_on_purpose():
    with rig() as r:
        imu = r.sensor()
        imu.set_range(gyro_dps=2000, accel_g=2)
        imu.data_ready()
        imu.sleep()
        assert all(imu.check() for _ in range(30))
        r.chip.power_off()
        r.chip.power_on()
        r.wait_ms(100)
        imu.configure()
        assert r.chip.registers[GYRO_CONFIG] == 0x18
        assert r.chip.registers[ACCEL_CONFIG] == 0x00
        assert r.chip.registers[0x38] == 0x01


def test_a_register_that_does_not_take_its_value_is_named():
    with rig() as r:
        imu = r.sensor()
        r.fault("filled", value=0xFE)
        with pytest.raises(OSError, match="MPU6050 at 0x68: register 0x6B reads 0xFE, expected"):
            imu.configure()


@pytest.mark.parametrize("kind", BUSES)
@pytest.mark.parametrize("fault", ("nack", "timeout", "arbitration"))
def test_a_failing_bus_is_an_oserror_and_then_all_is_well(kind, fault):
    with rig(kind) as r:
        imu = r.sensor()
        r.fault(fault)
        for call in (imu.read, imu.check, lambda: imu.set_range(gyro_dps=250)):
            with pytest.raises(OSError):
                call()
        r.mend()
        imu.read()
        assert imu.accel_g() == pytest.approx((0, 0, 1), abs=1e-3)


def test_conversions_use_no_bus():
    with rig() as r:
        imu = r.sensor()
        imu.read()
        r.transactions()
        imu.accel_g(), imu.gyro_dps(), imu.temp_c(), imu.plausible()
        assert r.transactions() == []


def test_a_new_bus_object_takes_over():
    with rig("rp2") as r:
        import machine

        imu = r.sensor()
        imu.start()
        r.wait_ms(1)
        imu.use_bus(machine.SoftI2C(scl=machine.Pin(5), sda=machine.Pin(4)))
        assert not imu.split
        imu.read()
        assert imu.collect()
        assert imu.accel_g() == pytest.approx((0, 0, 1), abs=1e-3)

# SPDX-License-Identifier: MIT
"""The driver's core against the chip model, on each kind of bus."""

import json
from itertools import pairwise
from pathlib import Path

import pytest
from sensor_rig import BUSES, Feel, rig

from tools.virtual.chip import MPU6050Chip

LIB = Path(__file__).resolve().parents[1] / "lib"
PWR_MGMT_1, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, SMPLRT_DIV = 0x6B, 0x1A, 0x1B, 0x1C, 0x19


# ---- configuration


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


# ---- who answers


CLONES = [
    (0x70, "MPU-6500", 333.87, 21.0),
    (0x71, "MPU-9250", 333.87, 21.0),
    (0x73, "MPU-9255", 333.87, 21.0),
    (0x74, "MPU-6515", 333.87, 21.0),
    (0x98, "ICM-20689", 326.8, 25.0),
]


@pytest.mark.parametrize("who_am_i, name, lsb, zero", CLONES)
def test_relatives_are_known_and_filtered_too(who_am_i, name, lsb, zero):
    with rig(profile=who_am_i, motion=Feel(temp=40.0)) as r:
        imu = r.sensor(dlpf_hz=21)
        assert (imu.who_am_i, imu.profile.name) == (who_am_i, name)
        assert r.chip.registers[0x1D] & 0x0F == 4  # their accelerometer filter is on its own
        r.wait_ms(300)
        imu.read()
        assert imu.counts[3] == pytest.approx((40.0 - zero) * lsb, abs=1)
        assert imu.temp_c() == pytest.approx(40.0, abs=1 / lsb)
        assert imu.accel_g() == pytest.approx((0, 0, 1), abs=1e-3)


def test_the_genuine_part_has_no_second_filter_register():
    with rig() as r:
        r.sensor()
        assert not [t for t in r.transactions() if t.written[:1] == b"\x1d"]


def test_a_relative_without_divider_tells_its_rate():
    with rig(profile="MPU6500") as r:
        assert r.sensor(dlpf_hz=260, rate_hz=1000).rate_hz == 8000


def test_an_unknown_part_is_refused_with_its_id_unless_allowed():
    stranger = MPU6050Chip(noise=False)
    stranger.profile = stranger.profile._replace(who_am_i=0x42)
    stranger.power_off()
    stranger.power_on()
    with rig("rp2 soft", stranger) as r:
        r.wait_ms(100)
        with pytest.raises(OSError, match=r"0x68.*reads 0x42, expected 0x68.*allow_unknown=True"):
            r.sensor()
        imu = r.sensor(allow_unknown=True)
        assert (imu.who_am_i, imu.profile.name) == (0x42, "unknown 0x42")


@pytest.mark.parametrize("value", (0x00, 0xFF))
def test_a_dead_data_line_is_not_called_a_clone(value):
    with rig() as r:
        r.fault("filled", value=value)
        with pytest.raises(OSError, match="reads 0x%02X.*data line seems dead" % value):
            r.sensor()


@pytest.mark.parametrize("kind", BUSES)
def test_nothing_on_the_bus(kind):
    """No device, no power, or SDA and SCL swapped: all look the same, a NACK."""
    with rig(kind) as r:
        r.bus.devices.clear()
        with pytest.raises(
            OSError, match=r"no answer at 0x68.*Nothing answers.*swapped"
        ) as caught:
            r.sensor()
        assert isinstance(caught.value.args[0], int)


@pytest.mark.parametrize("kind", BUSES)
def test_the_other_address_is_found(kind):
    with rig(kind, MPU6050Chip(address=0x69)) as r:
        with pytest.raises(OSError, match="answers at 0x69: AD0 is wired high, so use"):
            r.sensor()
        assert r.sensor(address=0x69).address == 0x69


def test_another_device_on_the_bus_is_named():
    display = MPU6050Chip(address=0x3C)
    seen = r"Others answer on this bus \(0x3C\).*power and AD0"
    with rig("rp2 soft", display) as r, pytest.raises(OSError, match=seen):
        r.sensor()


@pytest.mark.parametrize("kind", BUSES)
def test_a_stuck_line(kind):
    with rig(kind) as r:
        r.fault("timeout")
        with pytest.raises(OSError, match=r"no answer at 0x68.*held low.*pull-ups"):
            r.sensor()


@pytest.mark.parametrize("kind", BUSES)
def test_two_sensors_on_one_bus(kind):
    low = MPU6050Chip(Feel((0.1, 0.2, 0.3)), noise=False)
    high = MPU6050Chip(Feel((-0.4, -0.5, -0.6)), address=0x69, noise=False)
    with rig(kind, low, high) as r:
        first, second = r.sensor(), r.sensor(address=0x69, accel_g=2)
        r.wait_ms(100)
        first.read()
        second.read()
        assert first.accel_g() == pytest.approx((0.1, 0.2, 0.3), abs=1e-3)
        assert second.accel_g() == pytest.approx((-0.4, -0.5, -0.6), abs=1e-3)


def test_any_object_with_the_methods_will_do():
    with rig() as r:

        class Mine:
            """Neither a machine.I2C, nor able to scan."""

            def readfrom_mem_into(self, address, register, buffer):
                r.i2c.readfrom_mem_into(address, register, buffer)

            def readfrom_mem(self, address, register, n):
                return r.i2c.readfrom_mem(address, register, n)

            def writeto_mem(self, address, register, data):
                r.i2c.writeto_mem(address, register, data)

        imu = r.mpu6050.MPU6050(Mine())
        r.wait_ms(100)
        imu.read()
        assert imu.accel_g() == pytest.approx((0, 0, 1), abs=1e-3)
        r.bus.devices.clear()
        with pytest.raises(OSError, match="Nothing answers"):
            r.mpu6050.MPU6050(Mine())


# ---- in flight


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


# ---- power and INT


def test_sleep_and_wake():
    with rig(motion=Feel(gyro=(1.0, 2.0, 3.0))) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.sleep()
        assert r.chip.registers[PWR_MGMT_1] & 0x40
        r.chip.set_motion(Feel(gyro=(-4.0, -5.0, -6.0)))
        r.wait_ms(100)
        imu.read()
        assert imu.gyro_dps() == pytest.approx((1.0, 2.0, 3.0), abs=0.02)
        imu.wake()
        r.wait_ms(50)
        imu.read()
        assert imu.gyro_dps() == pytest.approx((-4.0, -5.0, -6.0), abs=0.05)


@pytest.mark.parametrize("hz, code", [(1.25, 0), (5, 1), (20, 2), (40, 3)])
def test_cycle_mode(hz, code):
    with rig(motion=Feel((0.5, 0.0, 0.8))) as r:
        imu = r.sensor()
        imu.cycle(hz)
        assert r.chip.registers[PWR_MGMT_1] & 0x68 == 0x28  # CYCLE, not SLEEP, TEMP_DIS
        assert r.chip.registers[0x6C] == code << 6 | 0x07  # the gyro's axes on standby
        r.wait_ms(2000)
        imu.read()
        assert imu.accel_g() == pytest.approx((0.5, 0.0, 0.8), abs=2e-3)
        assert all(imu.check() for _ in range(20))
        imu.wake()
        assert (r.chip.registers[PWR_MGMT_1], r.chip.registers[0x6C]) == (0x01, 0x00)


def test_cycle_mode_refuses():
    with rig() as r, pytest.raises(ValueError, match=r"1\.25, 5, 20, 40"):
        r.sensor().cycle(10)
    with rig(profile="MPU6500") as r, pytest.raises(ValueError, match="MPU-6500"):
        r.sensor().cycle(5)


def _edges(r, imu, ms, after=None):
    import machine

    pin = machine.Pin(6, machine.Pin.IN)
    seen = []
    r.port.connect_int(r.chip, 6)
    pin.irq(lambda p: (seen.append(r.port.now_ns), after and after()), machine.Pin.IRQ_RISING)
    r.wait_ms(ms)
    return seen


def test_data_ready_comes_with_each_sample():
    with rig() as r:
        imu = r.sensor(rate_hz=250)
        imu.data_ready()
        seen = _edges(r, imu, 100)
        assert len(seen) == pytest.approx(25, abs=1)
        gaps = [b - a for a, b in pairwise(seen)]
        assert gaps == pytest.approx([4e6] * len(gaps), abs=5e4)
        imu.data_ready(False)
        seen.clear()
        r.wait_ms(50)
        assert seen == []


def test_latched_data_ready_waits_for_a_read():
    with rig() as r:
        imu = r.sensor(rate_hz=250)
        imu.data_ready(latch=True)
        seen = _edges(r, imu, 48)
        assert len(seen) == 1
        imu.read()
        r.wait_ms(10)
        assert len(seen) == 2


def test_data_ready_active_low_is_open_drain():
    with rig() as r:
        imu = r.sensor()
        imu.data_ready(active_low=True)
        assert r.chip.registers[0x37] & 0xF0 == 0xD0


def test_motion_interrupt():
    with rig() as r:
        from mpu6050 import motion

        imu = r.sensor()
        motion.enable(imu, threshold_mg=96, duration_ms=5)
        assert (r.chip.registers[0x1F], r.chip.registers[0x20]) == (3, 5)
        r.wait_ms(100)
        assert not motion.moved(imu)
        r.chip.set_motion(Feel((0.5, 0.0, 1.0)))
        r.wait_ms(50)
        assert motion.moved(imu)
        assert not motion.moved(imu)
        r.i2c.writeto_mem(0x68, ACCEL_CONFIG, b"\x10")  # the high-pass lost: never again motion
        assert [imu.check() for _ in range(imu.rows)].count(False) == 1
        motion.disable(imu)
        r.chip.set_motion(Feel())
        r.wait_ms(50)
        assert not motion.moved(imu)


def test_motion_interrupt_refuses():
    from importlib import import_module

    with rig() as r:
        motion = import_module("mpu6050.motion")
        with pytest.raises(ValueError, match="threshold_mg"):
            motion.enable(r.sensor(), threshold_mg=10)
    with rig(profile="MPU9250") as r:
        motion = import_module("mpu6050.motion")
        with pytest.raises(ValueError, match="MPU-9250"):
            motion.enable(r.sensor())


@pytest.mark.parametrize("profile", ("MPU6050", "MPU6500", "ICM20689"))
def test_offset_registers(profile):
    with rig(profile=profile, motion=Feel((0.1, 0.2, 0.9), (3.0, -4.0, 5.0))) as r:
        from mpu6050 import offsets

        imu = r.sensor(gyro_dps=250, accel_g=2)
        first = 0x06 if profile == "MPU6050" else 0x77
        step = 2 if profile == "MPU6050" else 3
        low = [r.chip.registers[first + step * i + 1] & 1 for i in range(3)]
        offsets.shift_gyro(imu, -3.0, 4.0, -5.0)
        offsets.shift_accel(imu, -0.1, -0.2, 0.1)
        r.wait_ms(300)
        imu.read()
        assert imu.gyro_dps() == pytest.approx((0, 0, 0), abs=1 / 32.8)
        assert imu.accel_g() == pytest.approx((0, 0, 1), abs=2 / 2048)
        assert [r.chip.registers[first + step * i + 1] & 1 for i in range(3)] == low
        with pytest.raises(ValueError, match="beyond 16 bits"):
            offsets.shift_gyro(imu, 2000, 0, 0)


# ---- packages


@pytest.mark.parametrize("package", ("mpu6050", "attitude", "control"))
def test_package_json_lists_every_file(package):
    """What `mpremote mip install` would fetch is what there is (`python -m tools.packages`)."""
    listed = json.loads((LIB / package / "package.json").read_text())["urls"]
    files = sorted(p.relative_to(LIB / package).as_posix() for p in (LIB / package).rglob("*.py"))
    assert [source for _, source in listed] == files
    assert [target for target, _ in listed] == [f"{package}/{name}" for name in files]

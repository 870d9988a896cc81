# SPDX-License-Identifier: MIT
"""Who answers, and what the driver says when it is nobody or somebody else."""

import cmath
import math

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig
from tools.virtual.chip import MPU6050Chip

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


# dlpf_hz, and the gyro's delay in ms: RM-MPU-6000A p. 13, RM-MPU-6500A p. 13; the ICM-20689's
# data sheet gives bandwidths only, 41 and 20 Hz, of a filter next to first order: 1 / (2 pi f)
DELAYS = [
    (0x68, 44, 4.8), (0x68, 21, 8.3), (0x68, 94, 2.8), (0x70, 44, 5.9), (0x70, 21, 9.9),
    (0x71, 94, 3.9), (0x98, 44, 3.88), (0x98, 21, 7.96),
]  # fmt: skip


class Swing(Feel):
    """A rate about z that swings at 5 Hz, where all of these filters pass it."""

    def at(self, t_s):
        return (0.0, 0.0, 1.0, 0.0, 0.0, 300.0 * math.sin(10 * math.pi * t_s), 25.0)


@pytest.mark.parametrize("who_am_i, dlpf_hz, delay_ms", DELAYS)
def test_the_delay_is_that_of_the_parts_own_low_pass(who_am_i, dlpf_hz, delay_ms):
    with rig(profile=who_am_i, motion=Swing()) as r:
        imu = r.sensor(dlpf_hz=dlpf_hz)
        assert imu.delay_s * 1000 == pytest.approx(delay_ms, abs=0.01)
        r.wait_ms(400)
        seen = 0
        for _ in range(100):  # each phase of the swing and of the sample clock
            r.port.run_ms(24.13)
            now_s = r.port.now_ns / 1e9
            imu.read()
            seen += imu.gyro_dps()[2] * cmath.exp(-10j * math.pi * now_s)
        # sin: a quarter turn behind; and a sample is up to 1 ms old when it is read
        age_ms = (-cmath.phase(seen) - math.pi / 2) / (10 * math.pi) * 1000
        assert age_ms == pytest.approx(delay_ms + 0.5, abs=0.7)


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
        told = r"at 0x68.*0x42 30 times; expected 0x68.*DS3231.*allow_unknown=True"
        with pytest.raises(OSError, match=told):
            r.sensor()
        imu = r.sensor(allow_unknown=True)
        assert (imu.who_am_i, imu.profile.name) == (0x42, "unknown 0x42")


@pytest.mark.parametrize("value", (0x00, 0xFF))
def test_a_dead_data_line_is_not_called_a_clone(value):
    with rig() as r:
        r.fault("filled", value=value)
        with pytest.raises(OSError, match="0x%02X [0-9]+ times.*data line seems dead" % value):
            r.sensor()


@pytest.mark.parametrize("kind", BUSES)
def test_nothing_on_the_bus(kind):
    """No device, no power, or SDA and SCL swapped: all look the same, a NACK."""
    with rig(kind) as r:
        r.bus.devices.clear()
        with pytest.raises(
            OSError, match=r"at 0x68.*(EIO|ENODEV) [0-9]+ times.*Nothing answers.*swapped"
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
        with pytest.raises(OSError, match=r"at 0x68.*ETIMEDOUT.*held low.*pull-ups"):
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

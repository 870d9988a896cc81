# SPDX-License-Identifier: MIT
"""Sleep, cycle mode, INT, motion interrupt and offset registers."""

from importlib import import_module
from itertools import pairwise

import pytest

from host_tests.lib.sensor_rig import Feel, rig

PWR_MGMT_1, ACCEL_CONFIG = 0x6B, 0x1C


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

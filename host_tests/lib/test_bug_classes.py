# SPDX-License-Identifier: MIT
"""One test for each mistake that drivers of this chip are known to make (DESIGN section 5).

Facts are typed again from RM-MPU-6000A r4.2 and PS-MPU-6000A r3.4, not imported.
"""

import math
import re
from pathlib import Path

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig

ROOT = Path(__file__).resolve().parents[2]
LSB_PER_DPS = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}
LSB_PER_G = {2: 16384.0, 4: 8192.0, 8: 4096.0, 16: 2048.0}


@pytest.mark.parametrize("kind", BUSES)
@pytest.mark.parametrize("gyro_dps, accel_g", list(zip(LSB_PER_DPS, LSB_PER_G)))
def test_sensitivity_of_each_range_and_axis(kind, gyro_dps, accel_g):
    feel = Feel((0.31, -1.07, 1.83), (97.0, -181.0, 239.0), 31.0)
    with rig(kind, motion=feel) as r:
        imu = r.sensor(gyro_dps=gyro_dps, accel_g=accel_g)
        r.wait_ms(200)
        imu.read()
        assert list(imu.counts[:3]) == pytest.approx(
            [v * LSB_PER_G[accel_g] for v in feel.sample[:3]], abs=1
        )
        assert list(imu.counts[4:]) == pytest.approx(
            [v * LSB_PER_DPS[gyro_dps] for v in feel.sample[3:6]], abs=1
        )
        assert imu.accel_g() == pytest.approx(feel.sample[:3], abs=1 / LSB_PER_G[accel_g])
        assert imu.gyro_dps() == pytest.approx(feel.sample[3:6], abs=1 / LSB_PER_DPS[gyro_dps])
        assert imu.temp_c() == pytest.approx(31.0, abs=1 / 340)


def test_near_full_scale_both_ends():
    """99 %: 2000 deg/s by 16.4 is beyond 16 bits, so the very end says nothing about scale."""
    with rig(motion=Feel((15.84, -15.84, 7.0), (1980.0, -1980.0, 3.0))) as r:
        imu = r.sensor(gyro_dps=2000, accel_g=16)
        r.wait_ms(200)
        imu.read()
        assert imu.accel_g() == pytest.approx((15.84, -15.84, 7.0), abs=1e-3)
        assert imu.gyro_dps() == pytest.approx((1980.0, -1980.0, 3.0), abs=0.07)


@pytest.mark.parametrize("gyro_dps", LSB_PER_DPS)
@pytest.mark.parametrize("accel_g", LSB_PER_G)
def test_a_range_changed_at_run_time_changes_the_scale(gyro_dps, accel_g):
    feel = Feel((1.0, -0.5, 0.25), (100.0, -50.0, 25.0))
    with rig(motion=feel) as r:
        imu = r.sensor(gyro_dps=500, accel_g=4)
        imu.set_range(gyro_dps=gyro_dps, accel_g=accel_g)
        r.wait_ms(200)
        imu.read()
        assert imu.accel_g() == pytest.approx(feel.sample[:3], abs=1 / LSB_PER_G[accel_g])
        assert imu.gyro_dps() == pytest.approx(feel.sample[3:6], abs=1 / LSB_PER_DPS[gyro_dps])
        assert (imu.gyro_range_dps, imu.accel_range_g) == (gyro_dps, accel_g)


def test_a_range_that_the_chip_did_not_take_leaves_the_scale():
    with rig() as r:
        imu = r.sensor(gyro_dps=500)
        r.fault("nack")
        with pytest.raises(OSError):
            imu.set_range(gyro_dps=2000)
        assert (imu.gyro_range_dps, imu.gyro_lsb_per_dps) == (500, 65.5)


@pytest.mark.parametrize("code, hz", list(enumerate([260, 184, 94, 44, 21, 10, 5])))
def test_the_filter_goes_to_its_own_bits(code, hz):
    """DLPF_CFG is [2:0]; EXT_SYNC_SET [5:3] belongs to somebody else."""
    with rig() as r:
        imu = r.sensor(dlpf_hz=21)
        assert r.chip.registers[0x1A] == 4
        imu = r.sensor(dlpf_hz=hz)
        assert r.chip.registers[0x1A] == code
        r.i2c.writeto_mem(0x68, 0x1A, bytes([0x28 | code]))
        imu.configure()
        assert r.chip.registers[0x1A] == 0x28 | code


def test_the_documented_unit_is_the_unit():
    """90 deg/s for one second is 90 degrees: the sum of 250 samples, 4 ms apart."""
    with rig(motion=Feel(gyro=(90.0, -45.0, 22.5))) as r:
        imu = r.sensor()
        r.wait_ms(100)
        angle = [0.0, 0.0, 0.0]
        for _ in range(250):
            imu.read()
            angle = [a + rate * 0.004 for a, rate in zip(angle, imu.gyro_dps())]
        assert angle == pytest.approx([90.0, -45.0, 22.5], abs=0.01)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("sign", (1, -1))
def test_each_axis_is_its_own(axis, sign):
    accel, gyro = [0.0] * 3, [0.0] * 3
    accel[axis], gyro[2 - axis] = 0.7 * sign, -33.0 * sign
    with rig(motion=Feel(accel, gyro)) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.read()
        assert imu.accel_g() == pytest.approx(accel, abs=1e-3)
        assert imu.gyro_dps() == pytest.approx(gyro, abs=0.02)


@pytest.mark.parametrize("kind", BUSES)
@pytest.mark.parametrize("split", (False, True))
def test_one_sample_is_one_transaction(kind, split):
    """Accelerometer and gyro read apart belong to different instants: a torn sample."""
    with rig(kind) as r:
        imu = r.sensor()
        r.transactions()
        if split:
            imu.start()
            r.wait_ms(1)
            assert imu.collect()
        else:
            imu.read()
        imu.accel_g(), imu.gyro_dps(), imu.temp_c(), imu.plausible()
        (only,) = r.transactions()
        assert (only.address, only.written, len(only.read)) == (0x68, b"\x3b", 14)
        assert only.outcome == "ok"


@pytest.mark.parametrize("value", (0x00, 0xFE, 0xFF))
def test_a_filled_burst_is_not_data(value):
    with rig() as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.read()
        assert imu.plausible()
        r.fault("filled", value=value)
        imu.read()
        assert not imu.plausible()


@pytest.mark.parametrize("tail, is_data", [(-258, False), (-1, True), (0, True)])
def test_a_burst_with_a_filled_end_is_not_data_but_a_clones_zero_is(tail, is_data):
    """0xFEFE is a broken transfer; 0 and -1 a clone's gyro at rest, its temperature at zero."""
    with rig() as r:
        imu = r.sensor()
        for i, value in enumerate((12, -40, 4096, tail, tail, tail, tail)):
            imu.counts[i] = value
        assert imu.plausible() == is_data


def test_the_ideal_sample_is_data():
    """Level, still, noise-free, at the temperature where the register reads 0."""
    with rig(motion=Feel(temp=36.53)) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.read()
        assert list(imu.counts) == [0, 0, 4096, 0, 0, 0, 0]
        assert imu.plausible()


def test_level_and_noise_free_divides_by_nothing():
    from attitude import accel_tilt_deg

    with rig(motion=Feel()) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.read()
        assert accel_tilt_deg(*imu.accel_g()) == pytest.approx((0.0, 0.0), abs=1e-6)
        for absurd in ((0.0, 0.0, 0.0), (0.0, 0.0, -1.0), (1.0, 0.0, 0.0)):
            assert all(math.isfinite(angle) for angle in accel_tilt_deg(*absurd))


def test_asleep_is_not_level():
    """All zeros after a brown-out: not data, and check() finds the register that says why."""
    with rig() as r:
        imu = r.sensor()
        r.chip.power_off()
        r.chip.power_on()
        r.wait_ms(100)
        imu.read()
        assert not imu.plausible()
        assert not all(imu.check() for _ in range(20))


def test_library_modules_import_only_what_the_board_has():
    """An import that fails only on the board: nothing beyond MicroPython, and never `machine`."""
    allowed = {"array", "collections", "errno", "math", "micropython", "sys", "time"}
    for path in sorted((ROOT / "lib" / "mpu6050").glob("*.py")):
        for name in re.findall(r"^\s*(?:from|import) ([\w.]+)", path.read_text(), re.M):
            top = name.split(".")[0]
            assert top in allowed or top == "mpu6050", f"{path.name} imports {name}"

# SPDX-License-Identifier: MIT
"""The self-test by the datasheet: formulas typed again from RM-MPU-6000A r4.2 p. 9-11."""

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig

GYRO_CODES, ACCEL_CODES = (1, 16, 31), (31, 2, 17)


def _run(kind="rp2 soft", **settings):
    with rig(kind, **settings) as r:
        from mpu6050.selftest import passed, self_test

        imu = r.sensor(gyro_dps=1000, accel_g=16)
        axes = self_test(imu)
        after = (imu.gyro_range_dps, imu.accel_range_g, r.chip.registers[0x1B:0x1D])
        assert after == (1000, 16, b"\x10\x18")
        assert all(imu.check() for _ in range(12))
        return axes, passed(axes)


@pytest.mark.parametrize("kind", BUSES)
def test_a_good_part_passes_with_the_datasheets_trims(kind):
    axes, good = _run(kind, trim_codes=(GYRO_CODES, ACCEL_CODES), noise=True)
    assert good
    assert [axis.name for axis in axes] == ["ax", "ay", "az", "gx", "gy", "gz"]
    trims = [4096 * 0.34 * (0.92 / 0.34) ** ((code - 1) / 30) for code in ACCEL_CODES]
    trims += [s * 25 * 131 * 1.046 ** (code - 1) for s, code in zip((1, -1, 1), GYRO_CODES)]
    assert [axis.trim for axis in axes] == pytest.approx(trims)
    # worked ends of the formulas: code 1 and 31
    assert (axes[0].trim, axes[3].trim) == pytest.approx((4096 * 0.92, 25 * 131))
    for axis in axes:
        assert axis.response == pytest.approx(axis.trim, rel=0.02)
        assert abs(axis.change) < 0.02


@pytest.mark.parametrize(
    "error, good", [(0.13, True), (-0.13, True), (0.15, False), (-0.15, False)]
)
def test_fourteen_percent_is_the_limit(error, good):
    axes, result = _run(self_test_error=error)
    assert result is good
    assert all(axis.passed is good for axis in axes)
    assert [axis.change for axis in axes] == pytest.approx([error] * 6, abs=0.005)


def test_a_part_without_trim_codes_does_not_pass_nor_divide_by_zero():
    axes, good = _run(trim_codes=((0, 5, 5), (5, 0, 5)))
    assert not good
    assert [axis.name for axis in axes if axis.change is None] == ["ay", "gx"]
    assert [axis.passed for axis in axes] == [True, False, True, False, True, True]


def test_bias_and_tilt_cancel():
    axes, good = _run(motion=Feel((0.4, -0.3, 0.86)), gyro_bias_dps=(15, -15, 10))
    assert good, axes


@pytest.mark.parametrize("profile", ("MPU6500", "ICM20689"))
def test_relatives_have_their_own_formula(profile):
    axes, good = _run(profile=profile, trim_codes=((60, 90, 120), (50, 80, 110)))
    assert good
    codes = (50, 80, 110, 60, 90, 120)
    assert [axis.trim for axis in axes] == pytest.approx([2620 * 1.01 ** (c - 1) for c in codes])


def test_settings_come_back_after_a_failure():
    with rig() as r:
        from mpu6050.selftest import self_test

        imu = r.sensor(gyro_dps=2000, accel_g=4)
        read, calls = imu.read, []

        def failing():
            calls.append(1)
            if len(calls) == 150:
                raise OSError(5)
            read()

        imu.read = failing
        with pytest.raises(OSError):
            self_test(imu)
        assert (imu.gyro_range_dps, imu.accel_range_g) == (2000, 4)
        assert r.chip.registers[0x1B:0x1D] == b"\x18\x08"

# SPDX-License-Identifier: MIT
"""The burst in two phases: RP2's I2C blocks in the background, the blocking read elsewhere."""

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig
from tools.virtual.chip import MPU6050Chip

FEEL = Feel((0.31, -1.07, 1.83), (97.0, -181.0, 239.0), 31.0)


@pytest.mark.parametrize("machine_name", ("RP2040", "RP2350"))
@pytest.mark.parametrize("bus_id", (0, 1))
def test_both_phases_equal_the_blocking_read(machine_name, bus_id):
    with rig("rp2", motion=FEEL, machine_name=machine_name, bus_id=bus_id) as r:
        imu = r.sensor()
        assert imu.split
        r.wait_ms(100)
        plain = bytearray(14)
        r.i2c.readfrom_mem_into(0x68, 0x3B, plain)
        imu.start()
        r.wait_ms(1)
        assert imu.collect()
        words = [int.from_bytes(plain[i : i + 2], "big", signed=True) for i in range(0, 14, 2)]
        assert list(imu.counts) == words
        imu.read()
        assert list(imu.counts) == words


def test_start_returns_at_once_and_collect_tells_when():
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.wait_ms(100)
        before = r.port.now_ns
        imu.start()
        assert r.port.now_ns - before < 10_000
        assert not imu.collect()
        polls = 0
        while not imu.collect():
            r.port.run_ms(0.02)
            polls += 1
        # 17 bytes of 9 bits at 400 kHz, START, repeated START, STOP
        assert r.port.now_ns - before == pytest.approx(386_000, abs=30_000)
        assert polls > 10
        assert imu.accel_g() == pytest.approx((0.31, -1.07, 1.83), abs=1e-3)


@pytest.mark.parametrize("kind", BUSES)
def test_polling_always_ends_in_a_sample(kind):
    """Without start() collect() begins a burst itself (RP2), or does the read."""
    with rig(kind, motion=FEEL) as r:
        imu = r.sensor()
        r.wait_ms(100)
        for _ in range(100):
            if imu.collect():
                break
            r.port.run_ms(0.05)
        assert imu.accel_g() == pytest.approx((0.31, -1.07, 1.83), abs=1e-3)


@pytest.mark.parametrize("kind", BUSES)
def test_start_twice_is_one_burst(kind):
    with rig(kind, motion=FEEL) as r:
        imu = r.sensor()
        r.transactions()
        imu.start()
        imu.start()
        r.wait_ms(1)
        assert imu.collect()
        assert len(r.transactions()) == 1
        imu.start()
        r.wait_ms(1)
        assert imu.collect()


@pytest.mark.parametrize("between", ("read", "check", "set_range"))
def test_blocking_calls_between_start_and_collect(between):
    """They wait for the burst, which is still there to be collected."""
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.start()
        arguments = {"set_range": {"accel_g": 8}}.get(between, {})
        getattr(imu, between)(**arguments)
        assert imu.collect()
        assert imu.accel_g() == pytest.approx((0.31, -1.07, 1.83), abs=1e-3)
        assert {t.outcome for t in r.transactions()} == {"ok"}


def test_a_burst_is_collected_once():
    """Also one that a blocking call has finished, when another was started after it."""
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        imu.start()
        imu.check()
        imu.start()
        r.wait_ms(1)
        assert imu.collect()
        assert not imu.collect()


def test_a_burst_too_old_to_be_taken_makes_room_for_the_next():
    """After a pause: what was begun before it is not of now, and must not cost another sample."""
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.expire(2000)
        imu.start()
        r.wait_ms(5)
        imu.start()
        assert imu.poll() == 1  # the new one, waited for since the one before came too late
        imu.start()
        r.wait_ms(5)
        assert imu.poll() == 0
        assert imu.poll() == 0  # not begun
        imu.start()
        assert imu.poll() == 1
        imu.start()
        assert imu.poll() == 0  # the one before was in time: not waited for
        r.wait_ms(1)
        assert imu.poll() == 1


def test_the_burst_is_one_instant():
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.wait_ms(100)
        imu.start()
        r.wait_ms(1)
        r.chip.set_motion(Feel())
        r.wait_ms(100)
        assert imu.collect()
        assert imu.gyro_dps() == pytest.approx((97.0, -181.0, 239.0), abs=0.02)


def test_two_sensors_share_a_block():
    low = MPU6050Chip(Feel((0.1, 0.2, 0.3)), noise=False)
    high = MPU6050Chip(Feel((-0.4, -0.5, -0.6)), address=0x69, noise=False)
    with rig("rp2", low, high) as r:
        first, second = r.sensor(), r.sensor(address=0x69)
        r.wait_ms(100)
        first.start()
        second.start()  # waits for the first one's, and keeps it
        r.wait_ms(1)
        assert first.collect()
        assert second.collect()
        assert first.accel_g() == pytest.approx((0.1, 0.2, 0.3), abs=1e-3)
        assert second.accel_g() == pytest.approx((-0.4, -0.5, -0.6), abs=1e-3)


def test_one_sensors_failure_is_not_the_others():
    low = MPU6050Chip(Feel(), noise=False)
    high = MPU6050Chip(Feel((-0.4, -0.5, -0.6)), address=0x69, noise=False)
    with rig("rp2", low, high) as r:
        first, second = r.sensor(), r.sensor(address=0x69)
        r.wait_ms(100)
        r.bus.devices.remove(low)
        first.start()
        second.read()
        assert second.accel_g() == pytest.approx((-0.4, -0.5, -0.6), abs=1e-3)
        with pytest.raises(OSError) as caught:
            first.collect()
        assert caught.value.args[0] == 5


@pytest.mark.parametrize("fault, errno", [("nack", 5), ("arbitration", 5)])
def test_a_failed_burst_is_an_oserror_once(fault, errno):
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.fault(fault)
        imu.start()
        r.wait_ms(1)
        with pytest.raises(OSError) as caught:
            imu.collect()
        assert caught.value.args[0] == errno
        r.mend()
        imu.start()
        r.wait_ms(1)
        assert imu.collect()
        assert imu.accel_g() == pytest.approx((0.31, -1.07, 1.83), abs=1e-3)


@pytest.mark.parametrize("line", ("timeout", "sda_held"))
def test_a_stuck_bus_times_out(line):
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.fault(line)
        imu.start()
        r.wait_ms(0.5)
        assert not imu.collect()
        r.wait_ms(1)
        with pytest.raises(OSError) as caught:
            imu.collect()
        assert caught.value.args[0] == 110
        r.mend()
        imu.read()
        imu.start()
        r.wait_ms(1)
        assert imu.collect()


def test_a_foreign_transfer_breaks_the_burst_and_is_noticed():
    """machine.I2C disables the block at the start of each of its transfers."""
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        imu.start()
        r.port.machine.I2C(0, freq=400_000)  # as a new bus object after a recovery does
        r.wait_ms(4)
        with pytest.raises(OSError) as caught:
            imu.collect()
        assert caught.value.args[0] == 110
        imu.read()
        assert imu.accel_g() == pytest.approx((0.31, -1.07, 1.83), abs=1e-3)


def test_others_use_the_bus_after_finish():
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        r.wait_ms(100)
        r.transactions()
        imu.start()
        imu.finish()
        assert r.i2c.readfrom_mem(0x68, 0x75, 1) == b"\x68"
        assert imu.collect()
        assert imu.accel_g() == pytest.approx((0.31, -1.07, 1.83), abs=1e-3)
        assert [t.outcome for t in r.transactions()] == ["ok", "ok"]


def test_the_time_out_survives_the_timers_wrap():
    """The microsecond counter passes 2^30 and 2^31: no false alarm, no missed one."""
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        for _ in range(3):
            imu.start()
            r.wait_ms(1000)
            assert imu.collect()
        r.port.clock.now_ns += (2**30 - 4_000_000) * 1000
        for _ in range(8):
            imu.start()
            r.wait_ms(999.7)
            imu.start()
            r.wait_ms(0.5)
            assert imu.collect()


@pytest.mark.parametrize("bits", (30, 31, 32))
def test_a_time_out_across_the_timers_wrap(bits):
    with rig("rp2", motion=FEEL) as r:
        imu = r.sensor()
        us = r.port.timer_us()
        r.port.clock.now_ns += ((2**bits - us) % 2**bits - 300) * 1000
        r.fault("timeout")
        imu.start()
        assert not imu.collect()
        r.wait_ms(2)
        with pytest.raises(OSError) as caught:
            imu.collect()
        assert caught.value.args[0] == 110


def test_a_slow_bus_has_the_time_it_needs():
    with rig("rp2", motion=FEEL) as r:
        import machine

        imu = r.sensor()
        imu.use_bus(machine.I2C(0, freq=100_000))
        imu.start()
        r.wait_ms(1.3)
        assert not imu.collect()
        r.wait_ms(0.4)
        assert imu.collect()


def test_only_the_hardware_block_splits():
    with rig("rp2") as r:
        assert r.sensor().split
    for kind in ("rp2 soft", "esp32"):
        with rig(kind) as r:
            assert not r.sensor().split

# SPDX-License-Identifier: MIT
"""FIFO mode: every sample of the chip arrives once, in order; what is lost is counted."""

from itertools import pairwise

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig


class Ramp:
    """Every sample has its own value: the gyro turns ever faster, by 20 counts a millisecond."""

    duration_s = None

    def at(self, t_s):
        rate = 20_000 * t_s / 65.5 - 480
        return (0.5, -0.25, 1.0, rate, -rate, 10.0, 25.0)

    def truth(self, t_s):
        return (1.0, 0.0, 0.0, 0.0)


def _sensor(r, temp=True, **settings):
    from mpu6050.fifo import Fifo

    imu = r.sensor(dlpf_hz=184, rate_hz=1000, **settings)
    fifo = Fifo(imu, temp=temp)
    return imu, fifo


@pytest.mark.parametrize("kind", BUSES)
@pytest.mark.parametrize("temp", (True, False))
def test_every_sample_once_and_in_order(kind, temp):
    """1 kHz collected, taken at 250 Hz for a second: 4 a time."""
    with rig(kind, motion=Ramp()) as r:
        _, fifo = _sensor(r, temp)
        seen = []
        fifo.start()
        begun = r.port.now_ns
        for _ in range(250):
            r.wait_ms(4)
            fifo.read(lambda counts: seen.append(tuple(counts)))
        expected = (r.port.now_ns - begun) / 1e6
        assert len(seen) == fifo.samples == pytest.approx(expected, abs=4)
        assert (fifo.overflows, fifo.misaligned) == (0, 0)
        steps = {b[4] - a[4] for a, b in pairwise(seen[5:])}
        assert all(18 <= step <= 22 for step in steps), "a sample is missing or came twice"
        ax, ay, az, temp_counts, _, _, gz = seen[-1]
        assert (ax, ay, az) == pytest.approx((2048, -1024, 4096), abs=1)
        assert gz == pytest.approx(655, abs=1)
        assert temp_counts == (pytest.approx((25 - 36.53) * 340, abs=1) if temp else 0)


def test_packets_are_what_read_gives():
    with rig(motion=Feel((0.31, -1.07, 1.83), (97.0, -181.0, 239.0))) as r:
        imu, fifo = _sensor(r)
        r.wait_ms(100)
        fifo.start()
        r.wait_ms(10)
        assert fifo.read(lambda counts: None) > 5
        imu.read()
        assert list(fifo.counts) == list(imu.counts)


@pytest.mark.parametrize("temp", (True, False))
def test_a_long_pause_is_an_overflow_and_then_all_is_aligned(temp):
    with rig(motion=Feel((0.31, -1.07, 1.83), (97.0, -181.0, 239.0))) as r:
        imu, fifo = _sensor(r, temp)
        r.wait_ms(100)
        fifo.start()
        r.wait_ms(200)  # 1024 bytes are full after 73 or 85 ms
        assert fifo.read(lambda counts: None) == 0
        assert fifo.overflows == 1
        seen = []
        r.wait_ms(20)
        fifo.read(lambda counts: seen.append(list(counts)))
        imu.read()
        wanted = list(imu.counts)
        if not temp:
            wanted[3] = 0
        assert len(seen) >= 18
        assert all(sample == wanted for sample in seen)
        assert (fifo.overflows, fifo.misaligned) == (1, 0)


@pytest.mark.parametrize(
    "profile, size", [("MPU6050", 1024), ("MPU6500", 512), ("ICM20689", 4096)]
)
def test_each_part_overflows_at_its_own_size(profile, size):
    with rig(profile=profile) as r:
        _, fifo = _sensor(r)
        fifo.start()
        r.wait_ms(size / 14 - 6)
        assert fifo.read(lambda counts: None) == pytest.approx(size / 14 - 6, abs=2)
        r.wait_ms(size / 14 + 10)
        assert fifo.read(lambda counts: None) == 0
        assert fifo.overflows == 1


@pytest.mark.parametrize("lost", (1, 2, 7, 11))
@pytest.mark.parametrize("temp", (True, False))
def test_lost_bytes_are_noticed_and_no_wrong_sample_gets_through(lost, temp):
    with rig(motion=Feel((0.31, -1.07, 1.83), (97.0, -181.0, 239.0))) as r:
        _, fifo = _sensor(r, temp)
        r.wait_ms(100)
        fifo.start()
        seen = []
        r.wait_ms(10)
        fifo.read(lambda counts: seen.append(list(counts)))
        right = seen[-1]
        for _ in range(lost):
            r.chip.fifo.pop()
        for _ in range(5):
            r.wait_ms(10)
            fifo.read(lambda counts: seen.append(list(counts)))
        assert fifo.misaligned == 1
        assert all(sample == right for sample in seen)
        assert len(seen) > 30


def test_a_packet_swapped_in_flight_shows_in_its_temperature():
    """A byte lost within a burst shifts what follows, while the count still fits."""
    with rig(motion=Feel((0.31, -1.07, 1.83), (97.0, -181.0, 239.0))) as r:
        _, fifo = _sensor(r)
        r.wait_ms(100)
        fifo.start()
        r.wait_ms(10)
        seen = []
        fifo.read(lambda counts: seen.append(list(counts)))
        right = seen[-1]
        r.wait_ms(10)
        r.chip.advance(r.port.now_ns)
        for _ in range(14):  # a whole packet less one, plus one: count fits, bytes do not
            r.chip.fifo.pop()
        r.wait_ms(1)
        r.chip.fifo.pop()
        r.chip.fifo.push(b"\0")
        fifo.read(lambda counts: seen.append(list(counts)))
        assert fifo.misaligned == 1
        assert all(sample == right for sample in seen)


def test_a_broken_transfer_is_mended_by_the_next_call():
    with rig(motion=Feel((0.31, -1.07, 1.83))) as r:
        _, fifo = _sensor(r)
        r.wait_ms(100)
        fifo.start()
        r.wait_ms(10)
        r.fault("nack")
        with pytest.raises(OSError):
            fifo.read(lambda counts: None)
        r.mend()
        r.wait_ms(10)
        seen = []
        fifo.read(lambda counts: seen.append(tuple(counts[:3])))
        r.wait_ms(10)
        fifo.read(lambda counts: seen.append(tuple(counts[:3])))
        assert len(seen) > 8
        assert set(seen) == {(1270, -4383, 7496)}


def test_configuration_checks_know_the_fifo():
    with rig() as r:
        imu, fifo = _sensor(r)
        fifo.start()
        assert all(imu.check() for _ in range(20))
        fifo.stop()
        assert all(imu.check() for _ in range(20))
        r.wait_ms(10)
        assert r.chip.registers[0x23] == 0
        assert r.chip.registers[0x6A] & 0x40 == 0


def test_a_filter_takes_its_samples_from_the_fifo():
    with rig("rp2", motion=Feel((0.0, 0.5, 0.8660254))) as r:
        from attitude.fixed import KalmanTilt2

        imu, fifo = _sensor(r)
        tilt = KalmanTilt2(rate_hz=imu.rate_hz, gyro_dps=500, accel_g=8)
        update = tilt.update
        r.wait_ms(100)
        fifo.start()
        for _ in range(50):
            r.wait_ms(4)
            fifo.read(update)
        assert tilt.roll_mdeg == pytest.approx(30_000, abs=50)
        assert tilt.pitch_mdeg == pytest.approx(0, abs=50)

# SPDX-License-Identifier: MIT
"""Every sensor by one interface: what filters, calibration and the app call on any of them."""

import errno
from contextlib import contextmanager

import pytest

from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.chip.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.faults import make

KINDS = ("MPU6050", "MPU6500", "MPU9250", "ICM20689", "MinIMU9")
every = pytest.mark.parametrize("kind", KINDS)
both = pytest.mark.parametrize("platform", ["rp2", "esp32"])
SDA_SCL = {"rp2": (4, 5), "esp32": (21, 22)}
# the register that holds the gyro's range, at 0x68 and at 0x6B; data ready
RANGE = {"MinIMU9": 0x23}
READY = {"MinIMU9": (0x22, 0x08)}
NAMES = [
    "counts", "gyro_lsb_per_dps", "accel_lsb_per_g", "gyro_range_dps", "accel_range_g", "rate_hz",
    "dlpf_hz", "delay_s", "who_am_i", "address", "profile", "split", "asleep", "read", "collect",
    "plausible", "accel_g", "gyro_dps", "temp_c", "lock", "start", "poll", "fetch", "expire",
    "finish", "set_up", "data_ready", "bus", "use_bus", "rows", "rewind", "check", "recheck",
    "repair", "same_part", "adopt", "reset_chip", "reset_paths", "reset", "configure", "wake",
]  # fmt: skip


class Feel:
    """Three different values on the axes of each sensor."""

    duration_s = None

    def __init__(self, force=(0.25, -0.5, 0.75), rate=(30.0, -60.0, 90.0)):
        self.sample = (*force, *rate, 25.0)

    def at(self, _t_s):
        return self.sample

    def truth(self, _t_s):
        return (1.0, 0.0, 0.0, 0.0)


REST = Feel((0.0, 0.0, 1.0), (0.0, 0.0, 0.0))


def made(kind, i2c, **settings):
    import minimu9
    import mpu6050

    return (minimu9.MinIMU9 if kind == "MinIMU9" else mpu6050.MPU6050)(i2c, **settings)


def chips(kind, motion, **settings):
    if kind == "MinIMU9":
        return [L3GD20Chip(motion, **settings), LSM303Chip(motion, **settings)]
    return [MPU6050Chip(motion, profile=kind, **settings)]


@contextmanager
def sensor(kind, motion=None, platform="rp2", noise=False, **settings):
    """(port, chips, driver) of a sensor, running."""
    devices = chips(kind, motion or Feel(), noise=noise)
    sda, scl = SDA_SCL[platform]
    with Port(platform, {0: Bus(*devices)}, wiring={0: (sda, scl)}) as port:
        import machine

        i2c = machine.I2C(0, scl=machine.Pin(scl), sda=machine.Pin(sda), freq=400_000)
        imu = made(kind, i2c, **settings)
        port.run_ms(300)
        yield port, devices, imu


def fault(port, name, **parameters):
    port.buses[0].faults.append(make(name, at_s=port.now_ns / 1e9, **parameters))
    port.run_ms(1)


def mend(port):
    port.buses[0].faults.clear()
    port.buses[0].advance(port.now_ns)


class Lock:
    """A lock that counts, and knows whether it is held."""

    def __init__(self):
        self.taken = self.depth = 0

    def __enter__(self):
        self.taken += 1
        self.depth += 1

    def __exit__(self, *error):
        self.depth -= 1


@every
def test_all_of_the_interface_is_there(kind):
    import mpu6050

    with sensor(kind) as (_, _, imu):
        assert [name for name in NAMES if not hasattr(imu, name)] == []
        assert [n for n in ("name", "temp_lsb_per_c", "temp_offset_c")
                if not hasattr(imu.profile, n)] == []  # fmt: skip
    for name in NAMES:  # and written down
        assert "`%s" % name in mpu6050.__doc__, name


@both
@every
def test_counts_and_units_are_the_same(kind, platform):
    with sensor(kind, platform=platform, gyro_dps=500, accel_g=4) as (_, _, imu):
        counts = imu.counts
        imu.read()
        assert (imu.gyro_lsb_per_dps, imu.accel_lsb_per_g) == (65.5, 8192)
        assert (imu.gyro_range_dps, imu.accel_range_g) == (500, 4)
        # one digit of the coarser chip: 17.5 mdps, 2 mg
        assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=0.04)
        assert imu.accel_g() == pytest.approx((0.25, -0.5, 0.75), abs=0.003)
        assert list(imu.counts[4:]) == [pytest.approx(65.5 * w, abs=3) for w in (30, -60, 90)]
        assert imu.counts is counts
        assert imu.plausible()
        assert 0 < imu.delay_s < 0.01
        assert isinstance(imu.temp_c(), float)
        imu.start()
        while not imu.collect():
            pass
        imu.finish()
        assert imu.same_part()


@both
@every
def test_the_ticks_calls_never_raise_and_take_no_lock(kind, platform):
    with sensor(kind, platform=platform) as (port, _, imu):
        imu.lock = lock = Lock()
        imu.expire(3000)
        imu.start()
        port.run_ms(0.5)
        assert imu.poll() == 1
        assert imu.fetch() == 1
        assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=0.1)
        fault(port, "nack")
        nack = -(errno.EIO if platform == "rp2" else errno.ENODEV)
        assert imu.fetch() == nack
        imu.start()
        port.run_ms(0.5)
        assert imu.poll() == nack
        mend(port)
        imu.start()
        port.run_ms(0.5)
        assert imu.poll() == 1
        assert (imu.burst is not None) == imu.split
        if imu.burst:
            poll, *arguments = imu.burst
            assert len(arguments) == 3
            assert poll(*arguments) == 0
            imu.start()
            port.run_ms(0.5)
            assert poll(*arguments) == 1
        assert lock.taken == 0


@every
def test_a_burst_of_before_a_pause_is_not_of_now(kind):
    with sensor(kind) as (port, _, imu):
        imu.expire(3000)
        imu.start()
        port.run_ms(50)
        if imu.split:
            assert imu.poll() == 0
        imu.start()
        port.run_ms(0.5)
        assert imu.poll() == 1


@every
def test_the_foregrounds_calls_take_the_lock_and_give_it_back(kind):
    with sensor(kind) as (port, _, imu):
        imu.lock = lock = Lock()
        imu.use_bus(imu.bus)
        calls = [
            imu.read, imu.check, imu.recheck, imu.repair, imu.same_part,
            lambda: imu.set_up(250, 4, 21, 500), lambda: imu.data_ready(True), imu.reset_chip,
        ]  # fmt: skip
        for call in calls:
            taken = lock.taken
            call()
            assert lock.taken > taken and lock.depth == 0, call
        port.run_ms(150)
        fault(port, "nack")
        for call in calls:
            if call != imu.reset_chip:
                with pytest.raises(OSError):
                    call()
            assert lock.depth == 0


@both
@every
def test_other_settings_while_it_measures(kind, platform):
    with sensor(kind, platform=platform) as (port, _, imu):
        for gyro_dps, accel_g, dlpf_hz in ((250, 16, 94), (2000, 2, 21), (500, 8, 44)):
            imu.set_up(gyro_dps, accel_g, dlpf_hz, 500)
            port.run_ms(300)
            imu.read()
            assert (imu.gyro_range_dps, imu.accel_range_g) == (gyro_dps, accel_g)
            assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=0.1)
            assert imu.accel_g() == pytest.approx((0.25, -0.5, 0.75), abs=0.013)
            assert all(imu.check() for _ in range(imu.rows))
        before = imu.gyro_lsb_per_dps, imu.accel_lsb_per_g, imu.dlpf_hz
        with pytest.raises(ValueError, match="choose"):
            imu.set_up(gyro_dps=333)
        with pytest.raises(ValueError, match="choose"):
            imu.set_up(gyro_dps=250, accel_g=3)
        assert (imu.gyro_lsb_per_dps, imu.accel_lsb_per_g, imu.dlpf_hz) == before
        imu.set_up()
        imu.read()
        assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=0.1)


@every
@pytest.mark.parametrize("value", (0x00, 0xFE, 0xFF))
def test_a_filled_burst_is_not_plausible_and_the_judge_sees_it(kind, value):
    with sensor(kind) as (port, _, imu):
        from firmware.tick import judge

        memory = judge.memory()
        judge.allow(memory, 10)
        imu.read()
        assert judge.judge(imu.counts, memory) == 0
        fault(port, "filled", value=value)
        imu.read()
        assert not imu.plausible()
        assert judge.judge(imu.counts, memory) == judge.FILL
        mend(port)
        imu.read()
        assert imu.plausible()
        assert judge.judge(imu.counts, memory) == 0


@every
def test_a_lost_row_is_found_again_by_recheck_and_mended(kind):
    register = RANGE.get(kind, 0x1B)
    with sensor(kind, gyro_dps=2000) as (_, devices, imu):
        kept = devices[0].registers[register]
        devices[0].registers[register] = 0
        imu.rewind()
        for _ in range(imu.rows):
            if not imu.check():
                break
        assert not imu.recheck()
        devices[0].registers[register] = kept
        assert imu.recheck()
        devices[0].registers[register] = 0
        imu.rewind()
        while not imu.repair():
            pass
        assert devices[0].registers[register] == kept


@every
def test_a_reset_and_a_configuration_bring_all_back(kind):
    with sensor(kind, gyro_dps=2000) as (port, devices, imu):
        for how in ("steps", "whole", "power"):
            if how == "steps":
                imu.reset_chip()
                port.run_ms(100)
                imu.reset_paths()
                port.run_ms(100)
            elif how == "whole":
                imu.reset()
            else:
                for device in devices:
                    device.power_off()
                    device.power_on()
                port.run_ms(50)
            imu.rewind()
            assert not all(imu.check() for _ in range(imu.rows))
            imu.configure()
            port.run_ms(100)
            imu.read()
            assert imu.gyro_dps() == pytest.approx((30, -60, 90), abs=0.2), how
            assert all(imu.check() for _ in range(imu.rows))


@every
def test_data_ready_is_a_verified_setting(kind):
    register, bit = READY.get(kind, (0x38, 0x01))
    with sensor(kind) as (port, devices, imu):
        port.connect_int(devices[0], 6)
        rows = imu.rows
        imu.data_ready()
        assert devices[0].registers[register] & bit
        edges = []
        import machine

        def edge(_pin):
            edges.append(port.now_ns)
            imu.fetch()

        machine.Pin(6, machine.Pin.IN).irq(edge, machine.Pin.IRQ_RISING)
        port.run_ms(100)
        assert len(edges) == pytest.approx(imu.rate_hz / 10, abs=2)
        imu.data_ready(False)
        assert not devices[0].registers[register] & bit
        assert rows <= imu.rows <= rows + 1
        imu.rewind()
        assert all(imu.check() for _ in range(imu.rows))


@every
def test_another_part_in_its_place_is_seen(kind):
    with sensor(kind) as (_, devices, imu):
        if kind == "MinIMU9":
            devices[0].registers[0x0F] = 0xD7  # an L3GD20H, whose ranges differ
            assert not imu.same_part()
            assert not imu.adopt()
            return
        other, name = ("MPU6500", "MPU-6500") if kind != "MPU6500" else ("ICM20689", "ICM-20689")
        devices[0].power_on(other, silent_ns=0)
        assert not imu.same_part()
        assert imu.adopt()
        assert imu.profile.name == name


@every
def test_it_can_be_calibrated(kind):
    from calibration.poses import Poses
    from calibration.rest import gyro_bias

    motion = Feel((0.0, 0.0, 1.0), (1.0, -2.0, 3.0))
    with sensor(kind, motion, noise=True) as (_, _, imu):  # without it, the data stand still
        cal = gyro_bias(imu, seconds=0.2)
        assert cal.gyro_bias_dps == pytest.approx((1, -2, 3), abs=0.04)
        assert cal.temp_c == pytest.approx(imu.temp_c(), abs=0.1)
        assert cal.who_am_i == imu.who_am_i
        assert Poses(imu).add(0.2) == "+z"


@every
@pytest.mark.parametrize("late_ms", [0, 60, 150])
def test_it_may_come_up_late_and_a_bad_wire_is_asked_again(kind, late_ms):
    devices = chips(kind, REST)
    for device in devices:
        device.power_off()
        device.power_on(silent_ns=late_ms * 1_000_000)
    noisy = make("nack", at_s=0.0, p=0.02, seed=late_ms)
    with Port("rp2", {0: Bus(*devices, faults=[noisy])}, wiring={0: (4, 5)}) as port:
        import machine

        i2c = machine.I2C(0, scl=machine.Pin(5), sda=machine.Pin(4))
        imu = made(kind, i2c)
        port.run_ms(50)
        assert all(imu.check() for _ in range(imu.rows))


# ---- in the app


def app_with(kind, bus, **knobs):
    from firmware.app import App

    app = App()
    for name, value in {"rest_s": 0.1, **knobs}.items():
        app.config.set(name, value)
    if kind == "MinIMU9":
        app.imu = made(kind, app.board.i2c())
    app.start()
    return app


@both
@every
@pytest.mark.parametrize("name, for_s", [
    ("nack", 0.1), ("timeout", 0.1), ("filled", 0.1), ("brown_out", 0.005), ("unplugged", 0.2),
    ("stuck_data", 0.1),
])  # fmt: skip
def test_the_app_is_back_after_a_fault(kind, name, for_s, platform, tmp_path):
    devices = chips(kind, REST)
    with Port(platform, {0: Bus(*devices)}, root=tmp_path) as port:
        app = app_with(kind, port.buses[0])
        port.run_ms(500)
        assert not app.stale
        for device in devices if name in ("brown_out", "unplugged", "stuck_data") else (None,):
            address = None if device is None else device.address
            port.buses[0].faults.append(
                make(name, at_s=port.now_ns / 1e9, for_s=for_s, address=address)
            )
        port.run_ms(1000 * for_s)
        port.run_ms(400)
        assert not app.stale
        assert abs(app.roll_deg) < 1 and abs(app.pitch_deg) < 1
        app.imu.rewind()
        assert all(app.imu.check() for _ in range(app.imu.rows))
        app.stop()
        assert port.errors == []


@both
@every
def test_knobs_reach_the_sensor(kind, platform, tmp_path):
    devices = chips(kind, REST)
    with Port(platform, {0: Bus(*devices)}, root=tmp_path) as port:
        app = app_with(kind, port.buses[0])
        imu = app.imu
        for knob, value in (("gyro_dps", 2000), ("accel_g", 4), ("dlpf_hz", 21)):
            app.set(knob, value)
        port.run_ms(300)
        assert app.imu is imu and not app.stale
        assert (imu.gyro_range_dps, imu.accel_range_g, imu.dlpf_hz) == (2000, 4, 21)
        if kind == "MinIMU9":
            with pytest.raises(ValueError, match="250, 500, 2000"):
                app.set("gyro_dps", 1000)
            assert app.config.gyro_dps == 2000
            port.run_ms(100)
            assert not app.stale
        app.stop()
        app.start()
        port.run_ms(300)
        assert app.imu is imu and not app.stale and abs(app.roll_deg) < 1

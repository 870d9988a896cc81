# SPDX-License-Identifier: MIT
"""Taking over a chip that runs, waking on motion and its cause, and what sits behind the chip."""

import pytest

from host_tests.lib.sensor_rig import BUSES, Feel, rig
from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.chip.behind import Behind
from tools.virtual.faults import make
from tools.virtual.motion import Still

PWR_MGMT_1, INT_PIN_CFG, INT_ENABLE = 0x6B, 0x37, 0x38
RESET = b"\x6b\x80"
PARTS = ("MPU6050", "MPU6500", "ICM20689")

parts = pytest.mark.parametrize("profile", PARTS)


@parts
@pytest.mark.parametrize("kind", BUSES)
def test_attaching_neither_resets_nor_waits(kind, profile):
    with rig(kind, motion=Feel(gyro=(10.0, 20.0, 30.0)), profile=profile) as r:
        r.sensor(gyro_dps=1000, dlpf_hz=94)
        r.wait_ms(300)
        r.transactions()
        before = r.port.now_ns
        imu = r.sensor(gyro_dps=1000, dlpf_hz=94, attach=True)
        assert r.port.now_ns - before < 10e6
        log = r.transactions()
        assert RESET not in [t.written for t in log]
        assert not [t for t in log if len(t.written) > 1]  # nothing differs, nothing is written
        imu.read()
        assert imu.gyro_dps() == pytest.approx((10.0, 20.0, 30.0), abs=0.1)
        assert all(imu.check() for _ in range(imu.rows))


@parts
@pytest.mark.parametrize("register, value", [(0x1B, 0x18), (0x1A, 0x06), (0x19, 9), (0x6A, 0x40)])
def test_attaching_writes_what_differs(profile, register, value):
    with rig(profile=profile, motion=Feel(gyro=(10.0, 20.0, 30.0))) as r:
        r.sensor()
        r.i2c.writeto_mem(0x68, register, bytes([value]))
        imu = r.sensor(attach=True)
        assert all(imu.check() for _ in range(imu.rows))
        r.wait_ms(300)
        imu.read()
        assert imu.gyro_dps() == pytest.approx((10.0, 20.0, 30.0), abs=0.1)


@parts
def test_attaching_wakes_a_chip_and_waits_for_its_gyro(profile):
    with rig(profile=profile, motion=Feel(gyro=(10.0, 20.0, 30.0))) as r:
        r.sensor().sleep()
        r.wait_ms(100)
        imu = r.sensor(attach=True)
        r.wait_ms(20)
        imu.read()
        assert imu.gyro_dps() == pytest.approx((10.0, 20.0, 30.0), abs=1.0)


# ---- woken by motion

PINS = {"rp2": (4, 5, 6), "esp32": (21, 22, 19)}


@pytest.mark.parametrize("platform", ["rp2", "esp32"])
@pytest.mark.parametrize("active_low", [False, True])
def test_motion_wakes_once_stays_on_int_and_tells_its_cause(platform, active_low):
    sda, scl, int_pin = PINS[platform]
    chip = MPU6050Chip(Still(), seed=3)
    idle = 1 if active_low else 0

    def board():
        """The board after its reset: nothing is left but the chip."""
        return Port(platform, {0: Bus(chip)}, wiring={0: (sda, scl)})

    with board() as port:
        port.connect_int(chip, int_pin)
        import machine
        from mpu6050 import MPU6050, motion

        i2c = machine.I2C(0, scl=machine.Pin(scl), sda=machine.Pin(sda))
        imu = MPU6050(i2c)
        imu.data_ready(True, active_low=active_low, latch=True)
        motion.enable(imu, duration_ms=1)
        imu.cycle(20)
        port.run_ms(1000)
        assert chip.int_level == idle  # nothing moved: deep sleep would not end at once
        chip.set_motion(Feel((0.6, 0.0, 0.8)))
        port.run_ms(300)
        assert chip.int_level != idle
        chip.set_motion(Still())
        port.run_ms(2000)
        assert chip.int_level != idle  # it stays, though it lies still again
        assert imu.check()  # and a look at a register does not take it away
        assert chip.int_level != idle
        slept_ns = port.now_ns
    chip.now_ns = slept_ns
    with board() as port:
        port.clock.sleep(slept_ns)
        import machine
        from mpu6050 import MPU6050, motion

        i2c = machine.I2C(0, scl=machine.Pin(scl), sda=machine.Pin(sda))
        assert motion.woke(i2c)
        assert chip.int_level == idle
        assert not motion.woke(i2c)
        imu = MPU6050(i2c, attach=True)
        assert chip.registers[PWR_MGMT_1] == 0x01
        assert chip.registers[INT_ENABLE] == 0x40  # motion is watched for on
        chip.set_motion(Feel((0.6, 0.0, 0.8)))
        port.run_ms(300)
        imu.read()
        assert motion.moved(imu) and not motion.moved(imu)


def test_a_power_on_is_no_motion():
    with rig() as r:
        from mpu6050 import motion

        assert not motion.woke(r.i2c)


# ---- behind the chip


class Compass:
    """An AK8963's name register at 0x0C."""

    address = 0x0C
    now_ns = 0

    def __init__(self):
        self._pointer = None

    def start(self, read):
        self._pointer = self._pointer if read else None
        return True

    def write(self, value):
        self._pointer = value
        return True

    def read(self):
        return 0x48 if self._pointer == 0 else 0x00

    def stop(self):
        """End of the transfer."""

    def advance(self, now_ns):
        """Nothing happens."""

    def next_event_ns(self):
        return None


@pytest.mark.parametrize("profile", ("MPU6050", "MPU9250", "MPU9255"))
@pytest.mark.parametrize("platform", ["rp2", "esp32"])
def test_what_sits_behind_the_chip_outlives_knobs_faults_and_starts(platform, profile, tmp_path):
    chip = MPU6050Chip(Still(), seed=3, profile=profile)
    bus = Bus(chip, Behind(Compass(), chip))
    with Port(platform, {0: bus}, root=tmp_path) as port:
        from firmware.app import App

        app = App()
        app.config.set("rest_s", 0.1)
        app.start()

        def name():
            with app.bus:
                return app.imu.bus.readfrom_mem(0x0C, 0, 1)

        with pytest.raises(OSError):
            name()
        app.imu.bypass()
        assert name() == b"\x48"
        for knob, value in (("gyro_dps", 1000), ("dlpf_hz", 21), ("rate_hz", 200),
                            ("drive", "data-ready"), ("drive", "timer")):  # fmt: skip
            app.set(knob, value)
            port.run_ms(50)
            assert name() == b"\x48", knob
        bus.faults.append(make("brown_out", at_s=port.now_ns / 1e9 + 0.01, address=0x68))
        port.run_ms(500)
        assert not app.stale and name() == b"\x48"
        app.stop()
        bus.advance(port.now_ns)
        chip.power_off()
        chip.power_on()
        port.run_ms(50)
        app.start()
        assert name() == b"\x48"
        app.imu.bypass(False)
        with pytest.raises(OSError):
            name()
        port.run_ms(100)
        assert not app.stale and port.errors == []

# SPDX-License-Identifier: MIT
"""Deep sleep until the sensor is moved, on every chip that can, and the cause afterwards."""

import pytest

from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.motion import Sequence, Still
from tools.virtual.port.outputs import VirtualReset

# chip: platform, SDA, SCL, INT; DEEPSLEEP_RESET on an ESP32, a watchdog's on an RP2
CHIPS = {
    "RP2040": ("rp2", 4, 5, 6, 3), "RP2350": ("rp2", 4, 5, 6, 3),
    "ESP32": ("esp32", 21, 22, 33, 4), "ESP32S2": ("esp32", 8, 9, 10, 4),
    "ESP32S3": ("esp32", 8, 9, 10, 4),
    "ESP32C6": ("esp32", 6, 7, 3, 4),
}  # fmt: skip
every = pytest.mark.parametrize("machine", CHIPS)
FLAT, TIPPED = Still(), Still(roll_deg=30.0)


def board(machine, chip, root, version=(1, 27, 0), **settings):
    platform, sda, scl, int_pin, _ = CHIPS[machine]
    port = Port(
        platform, {0: Bus(chip)}, machine_name=machine, wiring={0: (sda, scl)}, root=root,
        version=version, **settings,
    )  # fmt: skip
    port.connect_int(chip, int_pin)
    return port


def app_on(port, machine):
    from firmware.app import App

    app = App()
    app.config.set("rest_s", 0.1)
    app.config.set("pin_int", CHIPS[machine][3])
    return app


@every
@pytest.mark.parametrize("running", [False, True])
@pytest.mark.parametrize("moved_at_s", [3.0, 12.0])
def test_it_sleeps_until_it_is_moved_and_knows_why_it_woke(
    machine, running, moved_at_s, tmp_path
):
    chip = MPU6050Chip(Sequence((FLAT, moved_at_s), (TIPPED, 1e9)), seed=3)
    with board(machine, chip, tmp_path) as port:
        from firmware import sleeping

        app = app_on(port, machine)
        assert not sleeping.woke(app)
        if running:
            app.start()
            port.run_ms(500)
        with pytest.raises(VirtualReset) as reset:
            sleeping.until_moved(app)
        woken_s = port.now_ns / 1e9
        assert moved_at_s < woken_s < moved_at_s + 0.3  # five looks a second
        assert reset.value.cause == CHIPS[machine][4]
        assert chip.registers[0x6B] & 0x20  # CYCLE: all but the accelerometer is off
        assert app.running is False
    with board(machine, chip, tmp_path, reset_cause=reset.value.cause) as port:
        port.clock.sleep(round(woken_s * 1e9))
        from firmware import sleeping

        app = app_on(port, machine)
        assert sleeping.woke(app)
        assert not sleeping.woke(app)  # asked once, INT is free again
        app.start()
        port.run_ms(500)
        assert not app.stale and app.roll_deg == pytest.approx(30.0, abs=0.5)


@every
def test_what_does_not_move_sleeps_on(machine, tmp_path):
    chip = MPU6050Chip(FLAT, seed=3)
    with board(machine, chip, tmp_path) as port:
        import machine as module

        from firmware import sleeping

        module.deepsleep, sleeps = lambda: asleep(60_000), module.deepsleep

        def asleep(ms):
            sleeps(ms)

        began = port.now_ns
        with pytest.raises(VirtualReset):
            sleeping.until_moved(app_on(port, machine))
        assert port.now_ns - began > 60e9 and not port.woken()
        port.clock.interrupts = True
        assert not sleeping.woke(app_on(port, machine))


@pytest.mark.parametrize("threshold_mg, wakes", [(64, True), (480, False)])
def test_the_threshold_is_the_users(threshold_mg, wakes, tmp_path):
    """A tip by 15 degrees moves gravity by 259 mg on one axis."""
    chip = MPU6050Chip(Sequence((FLAT, 2.0), (Still(roll_deg=15.0), 1e9)), seed=3)
    with board("ESP32S3", chip, tmp_path) as port:
        from firmware import sleeping

        app = app_on(port, "ESP32S3")
        with pytest.raises(VirtualReset if wakes else RuntimeError):
            sleeping.until_moved(app, threshold_mg=threshold_mg)
        assert (port.now_ns < 3e9) is wakes


@pytest.mark.parametrize("chip_name, int_pin, text", [
    ("ESP32", 19, "GP19 cannot wake ESP32.*set the knob pin_int"),
    ("ESP32C3", 10, "GP10 cannot wake ESP32-C3.*no such function"),
    ("ESP32C6", 10, "GP10 cannot wake ESP32-C6.*pin_int"),
])  # fmt: skip
def test_a_pin_that_cannot_wake_is_refused_and_nothing_sleeps(chip_name, int_pin, text, tmp_path):
    chip = MPU6050Chip(FLAT, seed=3)
    with Port("esp32", {0: Bus(chip)}, machine_name=chip_name, version=(1, 27, 0),
              root=tmp_path) as port:  # fmt: skip
        from firmware import sleeping
        from firmware.app import App

        app = App()
        app.config.set("rest_s", 0.1)
        app.config.set("pin_int", int_pin)
        app.start()
        port.run_ms(100)
        with pytest.raises(ValueError, match=text):
            sleeping.until_moved(app)
        app.start()
        port.run_ms(100)
        assert not app.stale


@pytest.mark.parametrize("part", ["MPU6500", "ICM20689"])
def test_a_relative_has_another_engine_and_says_so(part, tmp_path):
    with board("RP2040", MPU6050Chip(FLAT, seed=3, profile=part), tmp_path) as port:
        from firmware import sleeping

        with pytest.raises(ValueError, match="not on this part"):
            sleeping.until_moved(app_on(port, "RP2040"))

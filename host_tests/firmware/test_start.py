# SPDX-License-Identifier: MIT
"""A start as tolerant as the flight: late, noisy, garbled, asleep; and refusals that say why."""

import random
import sys

import pytest

from firmware.filters import SETTINGS
from tools import starts
from tools.starts.__main__ import figures_at_rest
from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.faults import make
from tools.virtual.motion import Still

both = pytest.mark.parametrize("platform", ["rp2", "esp32"])
SDA_SCL = {"rp2": (4, 5), "esp32": (21, 22)}
PWR_MGMT_1, GYRO_CONFIG = 0x6B, 0x1B


@pytest.fixture
def board(tmp_path):
    """board(platform, devices..., faults=()) -> (port, bus, app), not started."""
    ports = []

    def build(platform, *devices, faults=()):
        bus = Bus(*devices, faults=faults)
        port = Port(platform, {0: bus}, wiring={0: SDA_SCL[platform]}, root=tmp_path)
        port.__enter__()
        ports.append(port)
        from firmware.app import App

        app = App()
        app.config.set("rest_s", 0.1)
        return port, bus, app

    yield build
    for port in ports:
        assert port.errors == []
        port.__exit__(None, None, None)


def cold(silent_ms, **settings):
    """A chip that gets its supply with the board and answers so much later."""
    chip = MPU6050Chip(seed=3, **settings)
    chip.power_off()
    chip.power_on(silent_ns=round(silent_ms * 1e6))
    return chip


def runs_at_rest(port, app, bias=(0.0, 0.0, 0.0)):
    """The app turns out right in half a second."""
    port.run_ms(500)
    assert not app.stale
    assert abs(app.roll_deg) < 0.5 and abs(app.pitch_deg) < 0.5
    before = app.yaw_deg
    port.run_ms(1000)
    assert abs(app.yaw_deg - before) < 0.2
    assert app.calibration.gyro_bias_dps == pytest.approx(bias, abs=0.1)


# ---- later, noisier, garbled


def test_twenty_starts_of_the_thousand():
    """`python -m tools.starts` makes a thousand."""
    figures = figures_at_rest([starts.start(seed) for seed in range(20)])
    assert figures["starts"] == 20
    assert figures["not started"] == 0 and figures["later than 1 s"] == 0
    assert figures["bias off, deg/s"] < 0.1 and figures["with a warning"] == 0


@pytest.mark.parametrize("seed", range(4))
def test_one_transfer_in_fifty_fails(seed):
    result = starts.start(seed, failing=1 / 50)
    assert result["seconds"] < 1.2 and result["bias_off_dps"] < 0.1


@both
@pytest.mark.parametrize("silent_ms", [0, 5, 20, 100, 300, 800])
def test_power_of_board_and_sensor_together(board, platform, silent_ms):
    port, _, app = board(platform, cold(silent_ms, gyro_bias_dps=(4.0, -3.0, 2.0)))
    app.start()
    assert port.now_ns < silent_ms * 1e6 + 0.6e9
    runs_at_rest(port, app, (4.0, -3.0, 2.0))


@both
@pytest.mark.parametrize("name, parameters", [
    ("filled", {"value": 0xFE, "for_s": 0.15}),
    ("filled", {"value": 0x00, "for_s": 0.3}),
    ("bit_flip", {"p": 0.05}),
    ("bit_flip", {"p": 0.3, "for_s": 0.2}),
    ("sda_held", {"clocks": 9}),  # the board was reset in the middle of a burst
    ("sda_held", {"clocks": 1}),
    ("timeout", {"for_s": 0.1}),
    ("arbitration", {"p": 0.02}),
])  # fmt: skip
def test_a_bus_that_is_bad_at_first(board, platform, name, parameters):
    chip = MPU6050Chip(seed=3, gyro_bias_dps=(4.0, -3.0, 2.0))
    port, bus, app = board(platform, chip, faults=[make(name, at_s=0.0, seed=1, **parameters)])
    app.start()
    bus.faults.clear()
    runs_at_rest(port, app, (4.0, -3.0, 2.0))


@pytest.mark.parametrize("known", [0x68, 0x70, 0x98])
@pytest.mark.parametrize("seed", range(3))
def test_a_garbled_name_is_never_believed(board, known, seed):
    """One flipped bit makes an MPU-6500 of an MPU-9250, and the other way round."""
    flips = make("bit_flip", at_s=0.0, p=0.2, length=1, seed=seed)
    _, bus, app = board("rp2", MPU6050Chip(seed=3, profile=known), faults=[flips])
    bus.faults.append(make("filled", at_s=0.0, for_s=0.05, value=known ^ 0x02))
    app.start()
    assert app.imu.who_am_i == known


# ---- refused, and why


def refused(app):
    with pytest.raises(OSError) as caught:
        app.start()
    return str(caught.value)


@both
def test_a_sensor_that_never_comes_is_asked_for_a_second(board, platform):
    port, bus, app = board(platform)
    text = refused(app)
    assert 1e9 <= port.now_ns < 2e9
    asked = sum(t.address == 0x68 and t.outcome == "nack" for t in bus.log)
    told = int(text.partition("asked ")[2].partition(" times")[0])
    assert 300 < told <= asked
    assert "%d times" % told in text.partition("WHO_AM_I")[2]
    assert "in 1." in text and "Seen: " in text and "Check: " in text
    bus.devices.append(MPU6050Chip(seed=3))
    app.start()
    runs_at_rest(port, app)


def stranger(who_am_i, address=0x68):
    chip = MPU6050Chip(seed=1, address=address)
    chip.profile = chip.profile._replace(who_am_i=who_am_i)
    chip.power_off()
    chip.power_on()
    return chip


@both
def test_another_device_and_the_sensor_at_the_other_address(board, platform):
    port, _, app = board(platform, stranger(0x25), MPU6050Chip(seed=3, address=0x69))
    text = refused(app)
    assert "0x25" in text and "use address=0x69" in text and 'app.set("address", 0x69)' in text
    assert "loose" not in text
    app.set("address", 0x69)
    app.start()
    runs_at_rest(port, app)


class Clock(MPU6050Chip):
    """A DS3231: seven registers of time and date in decimal digits."""

    def __init__(self, now):
        super().__init__(seed=1)
        self.registers[:] = bytes(128)
        self.registers[0:7] = bytes(now)
        self.registers[0x75] = 0x10

    def _sync(self, _now_ns):
        """No samples."""


@pytest.mark.parametrize("now", [
    (0x59, 0x47, 0x23, 7, 0x31, 0x12, 0x99), (0x80, 0x00, 0x52, 1, 0x01, 0x81, 0x00),
])  # fmt: skip
def test_a_clock_chip_is_called_one(board, now):
    _, _, app = board("rp2", Clock(now))
    text = refused(app)
    assert "looks like a clock chip (DS1307, DS3231)" in text
    assert "AD0 to 3.3 V" in text and "loose" not in text


@pytest.mark.parametrize("who_am_i", [0x42, 0x72, 0xD1])
def test_a_clone_is_refused_with_the_way_to_allow_it(board, who_am_i):
    port, _, app = board("rp2", stranger(who_am_i))
    text = refused(app)
    assert "0x%02X" % who_am_i in text and "clone" in text
    assert 'app.set("allow_unknown", 1)' in text
    app.set("allow_unknown", 1)
    app.start()
    assert app.imu.profile.name == "unknown 0x%02X" % who_am_i
    runs_at_rest(port, app)


@pytest.mark.parametrize("value", [0x00, 0xFF])
def test_a_dead_data_line_is_no_clone_even_where_clones_are_allowed(board, value):
    fault = make("filled", at_s=0.0, value=value)
    _, _, app = board("rp2", MPU6050Chip(), faults=[fault])
    app.set("allow_unknown", 1)
    assert "data line seems dead" in refused(app)


def test_answers_that_change_are_noise(board):
    flips = make("bit_flip", at_s=0.0, p=1.0, length=1, seed=2)
    _, _, app = board("rp2", MPU6050Chip(), faults=[flips])
    text = refused(app)
    assert "answers change" in text and "pull-ups" in text


def test_a_contact_that_comes_and_goes_is_called_loose(board):
    _, _, app = board("rp2", MPU6050Chip(), faults=[make("nack", at_s=0.0, p=0.85)])
    text = refused(app)
    assert "now and then" in text or "loose contact" in text
    assert "EIO" in text and "0x68 " in text.partition("WHO_AM_I")[2]


# ---- a chip that lost its settings while the loop stood still


def sleep(port, chip, app):
    app.imu.sleep()


def cycle(port, chip, app):
    app.imu.cycle(5)


def brown_out(port, chip, app):
    chip.power_off()
    chip.power_on()


def brown_out_just_now(port, chip, app):
    brown_out(port, chip, app)
    chip._silent_until = port.now_ns + 80_000_000


def other_part(port, chip, app):
    chip.power_off()
    chip.power_on("ICM20689")


def master(seed):
    """Another program on the same chip: any value in any register of settings."""

    def leave(port, chip, app):
        chance = random.Random(seed)
        bus = app.board.i2c()
        for register in chance.sample((*range(0x19, 0x1E), *range(0x23, 0x28), 0x37, 0x38, 0x6A,
                                       0x6B, 0x6C), 8):  # fmt: skip
            bus.writeto_mem(0x68, register, bytes([chance.randrange(256) & 0x7F]))

    return leave


def ranges(port, chip, app):
    app.imu.set_range(2000, 16)


LOST = [sleep, cycle, brown_out, brown_out_just_now, other_part, ranges,
        *[master(seed) for seed in range(6)]]  # fmt: skip


@both
@pytest.mark.parametrize("lose", LOST, ids=lambda lose: lose.__name__)
def test_what_the_chip_lost_meanwhile_is_set_up_again(board, platform, lose):
    chip = MPU6050Chip(Still(roll_deg=20.0), seed=3, gyro_bias_dps=(1.0, 2.0, -3.0))
    port, bus, app = board(platform, chip)
    app.start()
    port.run_ms(500)
    app.stop()
    bus.advance(port.now_ns)
    lose(port, chip, app)
    port.run_ms(100 if lose is not brown_out_just_now else 1)
    app.start()
    port.run_ms(500)
    assert not app.stale and app.roll_deg == pytest.approx(20.0, abs=0.5)
    assert chip.registers[PWR_MGMT_1] == 0x01
    assert chip.registers[GYRO_CONFIG] & 0x18 == 0x08
    assert app.imu.gyro_range_dps == 500 and app.imu.accel_range_g == 8
    assert app.calibration.gyro_bias_dps == pytest.approx((1.0, 2.0, -3.0), abs=0.1)
    before = app.yaw_deg
    port.run_ms(1000)
    assert abs(app.yaw_deg - before) < 0.2
    assert app.stats().get("fill", 0) == app.stats().get("frozen", 0) == 0


def test_a_chip_that_lost_nothing_is_not_reset(board):
    _, bus, app = board("rp2", MPU6050Chip(seed=3))
    app.start()
    app.stop()
    bus.log.clear()
    app.start()
    assert not [t for t in bus.log if t.written == b"\x6b\x80"]


@both
def test_a_sensor_unplugged_meanwhile_is_refused_with_words(board, platform):
    chip = MPU6050Chip(seed=3)
    port, bus, app = board(platform, chip)
    app.start()
    app.stop()
    bus.devices.clear()
    text = refused(app)
    assert "Tried " in text and "no device answers" in text
    assert not app.running
    bus.devices.append(chip)
    app.start()
    runs_at_rest(port, app)


# ---- from the first sample on


@both
@pytest.mark.parametrize("kind", SETTINGS)
def test_nothing_is_loaded_between_the_first_sample_and_its_use(
    board, platform, kind, monkeypatch
):
    """A library that is compiled on the board takes a tenth of a second: it would be stale."""
    port, _, app = board(platform, MPU6050Chip(seed=3))
    from mpu6050 import MPU6050

    app.config.set("filter", kind)
    plausible, there = MPU6050.plausible, []

    def looked_at(imu):
        there.append(set(sys.modules))
        return plausible(imu)

    monkeypatch.setattr(MPU6050, "plausible", looked_at)
    app.start()
    for name in [name for name in sys.modules if name.startswith("attitude")]:
        monkeypatch.delitem(sys.modules, name)
    app.start()
    port.run_ms(50)
    assert set(sys.modules) - there[-1] == set()

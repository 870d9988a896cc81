# SPDX-License-Identifier: MIT
"""The whole application in virtual time on both personalities: run, tune, break, recover."""

import math
from itertools import pairwise

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.motion import Sequence, Sinusoid, Still
from tools.virtual.port import Port, VirtualReset

both = pytest.mark.parametrize("platform", ["rp2", "esp32"])
SDA_SCL = {"rp2": (4, 5), "esp32": (21, 22)}  # where the README tells to solder it
INT_PIN = {"rp2": 6, "esp32": 19}


class Rig:
    """An App with its virtual board around it; knobs go in by name."""

    def __init__(self, port, chip, bus, **knobs):
        from firmware.app import App

        self.port, self.chip, self.bus = port, chip, bus
        self.app = App()
        for name, value in knobs.items():
            self.app.config.set(name, value)

    def run_until(self, t_s):
        return self.run_s(t_s - self.port.now_ns / 1e9)

    def run_s(self, seconds):
        self.port.run_ms(seconds * 1000)
        return self.app.stats()

    def fault(self, name, **parameters):
        """Begin this fault in 2 ms from now."""
        self.bus.faults.append(make(name, at_s=self.port.now_ns / 1e9 + 0.002, **parameters))


@pytest.fixture
def rig(request, tmp_path, monkeypatch):
    """rig(platform, motion=None, chip settings..., knobs={}) -> started Rig; closed at the end."""
    monkeypatch.chdir(tmp_path)
    ports = []

    def build(platform, motion=None, knobs=None, start=True, **chip_settings):
        chip = MPU6050Chip(motion=motion, seed=3, **chip_settings)
        bus = Bus(chip)
        port = Port(platform, {0: bus}, wiring={0: SDA_SCL[platform]})
        port.__enter__()
        ports.append(port)
        port.connect_int(chip, INT_PIN[platform])
        made = Rig(port, chip, bus, **{"rest_s": 0.1, **(knobs or {})})
        if start:
            made.app.start()
        return made

    yield build
    for port in ports:
        assert port.errors == []  # nothing ever left a callback
        port.__exit__(None, None, None)


def tilt_error_deg(rig):
    """Angle between the estimated and the true vertical."""
    w, x, y, z = rig.chip.truth(rig.port.now_ns / 1e9)
    true = (2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z)
    roll, pitch = math.radians(rig.app.roll_deg), math.radians(rig.app.pitch_deg)
    ours = (-math.sin(pitch), math.sin(roll) * math.cos(pitch), math.cos(roll) * math.cos(pitch))
    dot = sum(a * b for a, b in zip(true, ours))
    return math.degrees(math.acos(max(-1.0, min(1.0, dot))))


def swing(axis="roll"):
    """At rest for a second, then +-20 degrees every two seconds, up to 63 deg/s."""
    rest = Still(**{axis + "_deg": -20.0})
    return Sequence((rest, 1.0), (Sinusoid(20.0, 0.5, axis, phase_deg=-90), 1e9))


# ---- it runs


@both
@pytest.mark.parametrize("name", ["attitude", "kalman2"])
def test_ten_seconds_follow_the_truth(rig, platform, name):
    r = rig(platform, swing(), {"filter": name}, gyro_bias_dps=(5.0, -4.0, 3.0))
    worst = 0.0
    for _ in range(100):
        r.run_s(0.1)
        worst = max(worst, tilt_error_deg(r))
    stats = r.app.stats()
    assert worst < 1.5
    assert 2490 <= stats["ticks"] <= 2501
    assert stats["lost"] == stats["overruns"] == stats["errors"] == 0
    assert stats["period_mean_us"] == pytest.approx(4000, abs=1)
    r.app.stop()
    ticks = r.run_s(0.1)["ticks"]
    assert ticks == stats["ticks"]


@pytest.mark.parametrize("name", ["float.attitude", "float.kalman", "float.complementary"])
def test_the_float_filters_are_one_knob_away(rig, name):
    r = rig("rp2", swing("pitch"), {"filter": name})
    r.run_s(3)
    assert r.app.stats()["errors"] == 0
    assert tilt_error_deg(r) < 2.5


@both
@pytest.mark.parametrize("rate_hz", [80, 1000])
def test_other_rates(rig, platform, rate_hz):
    r = rig(platform, swing(), {"rate_hz": rate_hz})
    stats = r.run_s(2)
    assert stats["ticks"] in (2 * rate_hz - 1, 2 * rate_hz)
    assert stats["lost"] == stats["errors"] == 0
    assert tilt_error_deg(r) < 1.0


@both
def test_one_burst_a_tick_and_registers_looked_at_in_between(rig, platform):
    r = rig(platform)
    r.bus.log.clear()
    r.run_s(2)
    bursts = [t for t in r.bus.log if len(t.read) == 14]
    looks = [t for t in r.bus.log if len(t.read) == 1]
    assert 499 <= len(bursts) <= 501
    assert 10 <= len(looks) <= 60  # a short transaction now and then
    assert len(bursts) + len(looks) == len(r.bus.log)
    assert len({t.written for t in looks}) >= 10


def test_the_sample_is_half_a_millisecond_old_with_a_burst_in_the_background(rig):
    r = rig("rp2")
    began = []
    r.app.outputs.add(lambda app: began.append(r.port.now_ns))
    r.bus.log.clear()
    r.run_s(0.1)
    bursts = [t.t_ns for t in r.bus.log if len(t.read) == 14]
    ages = [now - max(t for t in bursts if t < now) for now in began[1:]]
    assert max(ages) < 700_000  # with a look at a register in between


@both
def test_data_ready_sets_the_pace_and_the_filter_is_told_the_true_period(rig, platform):
    r = rig(platform, swing(), {"drive": "data-ready"}, clock_error=0.01)
    stats = r.run_s(4)
    assert 1005 <= stats["ticks"] <= 1015  # the chip's clock is 1 % fast
    assert stats["lost"] == stats["edges_missing"] == 0
    assert stats["period_mean_us"] == pytest.approx(4000 / 1.01, abs=2)
    assert r.app.filter.period_us == pytest.approx(4000 / 1.01, abs=2)
    assert tilt_error_deg(r) < 1.0


# ---- start


@both
def test_the_gyro_bias_is_measured_at_rest(rig, platform):
    r = rig(platform, gyro_bias_dps=(10.0, -20.0, 5.0), knobs={"rest_s": 0.5})
    assert r.app.calibration.gyro_bias_dps == pytest.approx((10.0, -20.0, 5.0), abs=0.05)
    assert r.app.warnings == []


def test_a_moved_sensor_is_no_rest_and_the_stored_bias_is_used(rig, capsys):
    r = rig("rp2", Sinusoid(20.0, 0.5), {"rest_s": 0.5}, start=False)
    from calibration import Calibration

    from firmware import calibration as keeping

    keeping.save_calibration(Calibration(gyro_bias_dps=(1.0, 2.0, 3.0)))
    r.app.start()
    assert r.app.calibration.gyro_bias_dps == (1.0, 2.0, 3.0)
    printed = capsys.readouterr().out
    assert "warning: gyro bias not measured" in printed and "it moved" in printed


WIRINGS = {
    "no device": ("no device answers", "VCC"),
    "other address": ("0x69", "AD0"),
    "swapped": ("swapped", "SDA"),
    "SDA low": ("SDA held low", "GND"),
    "SCL low": ("SCL held low", "GND"),
    "not connected": ("no pull-up on SDA and SCL", "VCC"),
}


@both
@pytest.mark.parametrize("case", WIRINGS)
def test_wrong_wiring_ends_in_a_text_that_tells_what_to_check(platform, case, tmp_path):
    sda, scl = SDA_SCL[platform]
    chip = MPU6050Chip(address=0x69 if case == "other address" else 0x68)
    bus = Bus() if case == "no device" else Bus(chip)
    wiring = {"swapped": (scl, sda), "not connected": (17, 18)}.get(case, (sda, scl))
    with Port(platform, {0: bus}, wiring={0: wiring}, root=tmp_path) as port:
        if case == "SDA low":
            bus.faults.append(make("sda_held", at_s=0.0, clocks=10**9))
        if case == "SCL low":
            bus.faults.append(make("timeout", at_s=0.0))
        from firmware.app import App

        with pytest.raises(OSError) as caught:
            App().start()
        text = str(caught.value)
        for part in WIRINGS[case]:
            assert part in text.partition("Seen:")[2], text
        assert "Check:" in text
        assert port.now_ns < 2e9
        assert port.errors == []


def test_main_shows_one_traceback_and_gives_the_repl(tmp_path, capsys):
    with Port("rp2", {0: Bus()}, root=tmp_path) as port:
        variables = port.run_file("main.py")  # returns: no boot loop
        printed = capsys.readouterr().out
        assert printed.count("Traceback") == 1
        assert "Check:" in printed
        assert variables["app"].loop is None


@both
def test_main_prints_angles_until_a_key_and_leaves_app_and_imu(platform, tmp_path, capfdbinary):
    with Port(platform, {0: Bus(MPU6050Chip())}, root=tmp_path) as port:
        port.clock.at(3_000_000_000, lambda: setattr(port, "stdin", "x"))
        variables = port.run_file("main.py")
        printed = capfdbinary.readouterr().out.decode()
        assert port.now_ns < 3.1e9
        lines = [line for line in printed.split("\r\n") if line.startswith("roll_deg:")]
        assert 90 <= len(lines) <= 130  # 50 a second for 2 s and some
        assert all(len(line) == 62 for line in lines)
        assert printed.startswith("# roll, pitch and yaw in degrees")
        app = variables["app"]
        assert variables["imu"] is app.imu
        ticks = app.stats()["ticks"]
        port.run_ms(100)
        assert app.stats()["ticks"] == ticks + 25  # the loop runs on under the REPL
        assert capfdbinary.readouterr().out == b""  # and the line is free


# ---- tuning while it runs


@both
def test_a_changed_parameter_takes_effect_at_once_and_keeps_the_angle(rig, platform):
    r = rig(platform, swing(), {"filter": "kalman2"})
    r.run_until(3.8)
    before = r.app.roll_deg
    assert abs(before) > 5
    r.app.set("kalman_r_measure", 5.0)
    assert r.app.roll_deg == pytest.approx(before, abs=0.5)
    stats = r.run_s(2)
    assert stats["lost"] == stats["errors"] == 0
    assert tilt_error_deg(r) < 2
    with pytest.raises(ValueError, match=r"0\.0001"):
        r.app.set("kalman_r_measure", 0)


def test_a_changed_parameter_changes_what_the_filter_does(rig):
    r = rig("rp2", None, {"filter": "kalman2"})
    r.run_s(2)
    noise = []
    for r_measure in (0.03, 1000.0):
        r.app.set("kalman_r_measure", r_measure)
        r.run_s(1.5)
        seen = []
        r.app.outputs.add(lambda app, seen=seen: seen.append(app.filter.roll_mdeg))
        r.run_s(1)
        r.app.outputs.clear()
        noise.append(sum(abs(b - a) for a, b in pairwise(seen)) / len(seen))
    assert noise[1] < noise[0] / 2


@both
def test_rate_and_range_changes_restart_the_loop(rig, platform):
    r = rig(platform, swing())
    r.run_s(0.5)
    r.app.set("rate_hz", 500)
    stats = r.run_s(1)
    assert 499 <= stats["ticks"] <= 501
    r.app.set("gyro_dps", 1000)
    r.run_s(2)
    assert r.app.imu.gyro_range_dps == 1000
    assert r.app.loop.running and tilt_error_deg(r) < 1.0


def test_the_asynchronous_form_sees_each_step(rig):
    r = rig("rp2")
    asyncio = r.port.modules["asyncio"]

    async def main():
        n = 0
        async for app in r.app.samples():
            assert app is r.app
            n += 1
            if n == 25:
                return r.app.stats()["ticks"]

    first = r.app.stats()["ticks"]
    assert asyncio.run(main()) - first in (25, 26)


# ---- faults

FAULTS = {  # fault: (parameters, seconds it lasts, cause in stats, recovery allowed in seconds)
    "nack": ({"for_s": 0.1}, 0.1, "nack", 5 * 0.004),
    "timeout": ({"for_s": 0.1}, 0.1, "timeout", 0.05),
    "sda_held": ({"clocks": 7}, 0.0, "timeout", 0.05),
}


@both
@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_is_detected_bridged_and_recovered_from(rig, platform, name):
    parameters, lasts_s, cause, allowed_s = FAULTS[name]
    r = rig(platform, swing())
    r.run_s(2)
    r.fault(name, **parameters)
    r.run_s(0.002 + lasts_s)
    waited = 0.0
    while not r.app.fresh or r.app.stats()["age_ms"] > 4:
        r.run_s(0.004)
        waited += 0.004
        assert waited <= allowed_s + 0.004, r.app.stats()
    stats = r.run_s(1.0)
    assert stats.get(cause, 0) or (cause == "timeout" and stats.get("nack", 0)), stats
    assert stats["errors"] == 0 and not stats["stale"]
    assert tilt_error_deg(r) < 1.0


def test_a_short_outage_in_motion_is_predicted_and_a_long_one_is_stale(rig):
    r = rig("rp2", swing())
    r.run_until(2.46)
    r.fault("nack", for_s=0.08)
    r.run_s(0.08)  # around 2.5 s, the middle of the swing: 63 deg/s
    assert not r.app.fresh and not r.app.stale
    assert tilt_error_deg(r) < 1.0  # it turned 5 degrees meanwhile
    r.run_s(1)
    r.fault("nack", for_s=1.0)
    r.run_s(0.5)
    assert r.app.stale
    held = r.app.roll_deg
    r.run_s(0.2)
    assert r.app.roll_deg == held
    assert 0.5 <= r.app.stats()["age_ms"] / 1000 <= 0.75
    error = tilt_error_deg(r)
    r.run_s(2)
    assert not r.app.stale and tilt_error_deg(r) < error / 2


def test_flipped_bits_never_show(rig):
    r = rig("esp32", swing())
    r.run_s(2)
    r.fault("bit_flip", p=0.01)
    worst = 0.0
    for _ in range(500):
        r.run_s(0.02)
        worst = max(worst, tilt_error_deg(r))
    assert worst < 2.0


@both
def test_a_dead_int_line_slows_the_loop_but_does_not_stop_it(rig, platform):
    r = rig(platform, swing(), {"drive": "data-ready"})
    r.run_s(1)
    r.fault("int_dead", for_s=1.0)
    stats = r.run_s(1)
    assert stats["edges_missing"] > 50
    assert tilt_error_deg(r) < 1.5
    before = stats["ticks"]
    assert r.run_s(1)["ticks"] - before > 240


def test_a_callback_that_fails_is_counted_shown_once_and_outlived(rig, capsys):
    r = rig("rp2")
    calls = []

    def bad(app):
        calls.append(1)
        raise RuntimeError("in the user's callback")

    r.app.outputs.add(bad)
    stats = r.run_s(0.5)
    assert stats["output_errors"] == len(calls) > 100
    assert stats["errors"] == 0
    assert capsys.readouterr().out.count("RuntimeError: in the user's") == 1


def test_outputs_go_safe_once_when_stale_and_when_stopped(rig):
    r = rig("rp2")
    seen = []
    r.app.outputs.add(lambda app: seen.append("on"), lambda: seen.append("safe"))
    r.run_s(0.1)
    r.fault("nack", for_s=0.5)
    r.run_s(0.4)
    assert seen.count("safe") == 1 and seen[-1] == "safe"
    r.run_s(0.5)
    assert seen[-1] == "on"
    r.app.stop()
    assert seen[-1] == "safe" and seen.count("safe") == 2


@both
def test_the_watchdog_is_fed_by_good_samples_only(rig, platform):
    r = rig(platform, knobs={"watchdog_ms": 2000})
    r.run_s(5)
    r.fault("nack", for_s=10.0)
    with pytest.raises(VirtualReset, match="watchdog"):
        r.run_s(3)


def test_a_watchdog_of_other_lengths_is_refused(rig):
    r = rig("rp2", start=False)
    with pytest.raises(ValueError, match="0, 2000, 4000, 8000"):
        r.app.set("watchdog_ms", 300)

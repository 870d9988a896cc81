# SPDX-License-Identifier: MIT
"""What is known of the gyro's bias: at rest, turning, swinging, with and without a stored one."""

import math
import sys

import pytest

from tools import starts
from tools.starts.__main__ import told
from tools.starts.moving import SCENES, Turn
from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.motion import Sinusoid, Still

BIAS = (2.0, -1.5, 3.0)


class Pieces:
    """Turns about the vertical one after the other: (deg/s, seconds), then rest."""

    duration_s = None

    def __init__(self, *pieces):
        self.pieces = pieces

    def at(self, t_s):
        for dps, for_s in self.pieces:
            if t_s < for_s:
                return (0.0, 0.0, 1.0, 0.0, 0.0, dps, 25.0)
            t_s -= for_s
        return (0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 25.0)

    def truth(self, t_s):
        return (1.0, 0.0, 0.0, 0.0)


@pytest.fixture
def rig(tmp_path):
    """rig(motion, stored=None, knobs) -> (port, app), started; the files stay for the next."""
    ports = []

    def build(motion, stored=None, bias=BIAS, platform="rp2", start=True, seed=3, **knobs):
        while ports:
            ports.pop().__exit__(None, None, None)
        chip = MPU6050Chip(motion, seed=seed, gyro_bias_dps=bias)
        port = Port(platform, {0: Bus(chip)}, root=tmp_path)
        port.__enter__()
        ports.append(port)
        if stored:
            from calibration import Calibration

            from firmware.calibration import save_calibration

            save_calibration(Calibration(gyro_bias_dps=stored, who_am_i=0x68))
        from firmware.app import App

        app = App()
        for name, value in knobs.items():
            app.config.set(name, value)
        if start:
            app.start()
        return port, app

    yield build
    while ports:
        port = ports.pop()
        assert port.errors == []
        port.__exit__(None, None, None)


def until(port, t_s):
    port.run_ms(t_s * 1000 - port.now_ns / 1e6)


def drift_dps(port, app, seconds=10.0):
    before = app.yaw_deg
    port.run_ms(seconds * 1000)
    return abs((app.yaw_deg - before + 180) % 360 - 180) / seconds


def stored_bias():
    from firmware.calibration import load_calibration

    return load_calibration()[0].gyro_bias_dps


def off(bias, true=BIAS):
    return max(abs(a - b) for a, b in zip(bias, true))


# ---- at rest


@pytest.mark.parametrize("setting", starts.settings()[::13])
def test_every_low_pass_and_rate_finds_the_bias_at_rest(setting):
    """`python -m tools.starts` goes through all of them."""
    result = starts.at(setting)
    assert result["bias_off_dps"] < 0.1 and result["warnings"] == ""


@pytest.mark.parametrize("stored", [None, BIAS, (2.2, -1.4, 3.2)])
def test_at_rest_the_bias_is_as_measured_and_certain(rig, stored):
    port, app = rig(Still(), stored)
    assert off(app.calibration.gyro_bias_dps) < 0.05 and app.warnings == []
    port.run_ms(100)
    assert not app.uncertain
    assert drift_dps(port, app) < 0.02


def test_a_rest_that_comes_after_the_start_has_begun_is_taken(rig):
    """Put down while it starts."""
    _, app = rig(Turn(40.0, "x", 0.0, 0.6))
    assert off(app.calibration.gyro_bias_dps) < 0.1 and app.warnings == []


def test_what_asks_a_filter_in_motion_loads_nothing(rig):
    """A module loaded while the loop runs takes heap in one piece, and a hard tick its stack."""
    port, app = rig(Sinusoid(20.0, 0.5, "roll"))
    before = set(sys.modules)
    for name in [name for name in before if name.startswith("attitude.fixed.attitude.")]:
        del sys.modules[name]
    before = set(sys.modules)
    until(port, 15.0)
    assert not app.filter.uncertain and set(sys.modules) == before


# ---- steady turns and tilts at the start


@pytest.mark.parametrize("name, case", [
    ("turn", ("rp2", -12.0, None)), ("turn", ("esp32", 5.0, BIAS)),
    ("tilt", ("rp2", 5.0, "y", None, 4.0)), ("tilt", ("esp32", 1.0, "x", None, 8.0)),
    ("swing", ("esp32", "roll", 15.0)), ("turned_swing", ("rp2", "y", 12.0, (2, -15, -18))),
])  # fmt: skip
def test_a_case_of_the_tool_and_its_bars(name, case, capsys):
    """`python -m tools.starts` has them all."""
    figures = SCENES[name].run(case)
    assert told(name, [(case, figures)])[1]
    for figure, bar in SCENES[name].bars.items():
        assert not told(name, [(case, figures), ("bad", {**figures, figure: bar + 0.1})])[1]
        assert "%s, worst: bad" % name in capsys.readouterr().out


@pytest.mark.parametrize("axis", "xy")
@pytest.mark.parametrize("dps", [1.0, -3.0, 5.0, 15.0])
@pytest.mark.parametrize("stored", [None, BIAS])
def test_a_steady_tilt_at_the_start_is_no_bias(rig, axis, dps, stored):
    port, app = rig(Turn(dps, axis, 0.0, 4.0), stored)
    assert abs(app.calibration.gyro_bias_dps["xy".index(axis)] - BIAS["xy".index(axis)]) < 0.2 or (
        not stored and app.calibration.gyro_bias_dps == (0.0, 0.0, 0.0)
    )
    until(port, 10.0)
    angle = app.roll_deg if axis == "x" else app.pitch_deg
    assert angle == pytest.approx(4 * dps, abs=2.0)
    assert not app.stale and not app.uncertain
    until(port, 14.0)
    assert drift_dps(port, app) < 0.05


@pytest.mark.parametrize("dps", [-30.0, -12.0, -2.0, 2.0, 5.0, 12.0, 30.0])
def test_a_steady_turn_at_the_start_is_no_bias_where_one_is_stored(rig, dps):
    port, app = rig(Turn(dps), BIAS)
    assert "turns" in app.warnings[0]
    assert app.calibration.gyro_bias_dps == pytest.approx(BIAS, abs=0.01)
    until(port, 4.0)
    assert abs(app.yaw_deg - dps * (4.0 - 0.9)) < abs(dps) * 0.3  # it counts from the start on
    until(port, 8.0)
    assert drift_dps(port, app) < 0.05
    app.stop()
    assert off(stored_bias()) < 0.05


@pytest.mark.parametrize("dps", [2.0, 5.0, 12.0, 20.0, 30.0])
@pytest.mark.parametrize("bias", [BIAS, (0.0, 0.0, 0.0)])
def test_a_steady_turn_at_the_start_is_no_bias_any_more_after_the_first_rest(rig, dps, bias):
    port, app = rig(Turn(dps), bias=bias)
    until(port, 12.0)
    assert drift_dps(port, app) < 0.05
    app.stop()
    assert stored_bias() == (0.0, 0.0, 0.0) or off(stored_bias(), bias) < 0.05


@pytest.mark.parametrize("dps", [0.3, -0.3, 1.0, -1.5, 2.0, -1.9, 10.0, 25.0])
def test_a_steady_turn_after_a_rest_is_never_taken_for_the_bias(rig, dps):
    port, app = rig(Turn(dps, "z", 3.0, 33.0))
    until(port, 33.0)
    assert off(app.learning.cal.gyro_bias_dps) < 0.1
    until(port, 43.0)
    assert off(app.learning.cal.gyro_bias_dps) < 0.1


def test_what_passed_for_a_turn_comes_back_when_it_is_seen_again(rig):
    """Rest, then a turn against the bias that makes the rate smaller, then rest."""
    port, app = rig(Pieces((0.0, 3.0), (-9.0, 20.0)), bias=(0.0, 0.0, 10.0))
    until(port, 32.0)
    assert off(app.learning.cal.gyro_bias_dps, (0.0, 0.0, 10.0)) < 0.1
    assert drift_dps(port, app) < 0.05


# ---- another sensor of the same kind, an old bias


@pytest.mark.parametrize("stored", [(-4.0, 3.0, 1.0), (2.0, 1.5, 3.0), (12.0, -1.5, 3.0)])
def test_a_level_rate_that_is_not_the_stored_one_is_another_bias(rig, stored):
    """Gravity stands still, so it does not turn about a level axis."""
    port, app = rig(Still(), stored)
    assert off(app.calibration.gyro_bias_dps) < 0.05
    assert "not the stored one" in app.warnings[0]
    until(port, 15.0)
    app.stop()
    assert stored_bias() == stored  # one rest is no proof
    port, app = rig(Pieces((0.0, 20.0), (40.0, 2.0)))
    until(port, 40.0)
    app.stop()
    assert off(stored_bias()) < 0.05


def test_the_stored_bias_is_that_of_its_temperature(rig):
    class Warm(Still):
        def at(self, t_s):
            return (*super().at(t_s)[:6], 45.0)

    _, app = rig(Warm(), start=False)
    from calibration import Calibration

    from firmware.calibration import save_calibration

    slope = (0.05, 0.0, -0.05)
    there = [b - 20 * s for b, s in zip(BIAS, slope)]  # at 25 degC
    save_calibration(Calibration(there, who_am_i=0x68, temp_c=25.0, gyro_slope_dps_per_c=slope))
    app.start()
    assert app.warnings == []
    assert app.learning.known == 2


# ---- switched on in motion


@pytest.mark.parametrize("platform", ["rp2", "esp32"])
@pytest.mark.parametrize("bias_dps", [2.0, 5.0, 15.0])
def test_switched_on_in_a_swing_nothing_is_claimed_that_is_wrong(rig, platform, bias_dps):
    motion = Sinusoid(10.0, 0.5, "roll")
    bias = (bias_dps, -0.8 * bias_dps, 0.6 * bias_dps)
    port, app = rig(motion, bias=bias, platform=platform)
    assert "none is known" in app.warnings[0]
    while port.now_ns < 20e9:
        port.run_ms(50)
        true = 10.0 * math.sin(math.pi * port.now_ns / 1e9)
        error = max(abs(app.roll_deg - true), abs(app.pitch_deg))
        assert app.uncertain or error < 2.0


def test_switched_on_in_a_swing_the_stored_bias_is_used_and_it_is_certain(rig):
    port, app = rig(Sinusoid(10.0, 0.5, "roll"), BIAS)
    assert app.calibration.gyro_bias_dps == pytest.approx(BIAS, abs=0.01)
    assert "stored one is used" in app.warnings[0]
    until(port, 5.0)
    for _ in range(40):
        port.run_ms(50)
        true = 10.0 * math.sin(math.pi * port.now_ns / 1e9)
        assert not app.uncertain and abs(app.roll_deg - true) < 2.0


def test_it_is_certain_after_the_first_rest(rig):
    class Carried(Sinusoid):
        def at(self, t_s):
            return super().at(t_s) if t_s < 6.0 else Still().at(t_s)

        def truth(self, t_s):
            return super().truth(t_s) if t_s < 6.0 else (1.0, 0.0, 0.0, 0.0)

    port, app = rig(Carried(10.0, 0.5, "roll"), bias=(6.0, -5.0, 4.0))
    until(port, 5.0)
    assert app.uncertain
    until(port, 13.0)
    assert not app.uncertain
    assert abs(app.roll_deg) < 0.5 and abs(app.pitch_deg) < 0.5
    assert drift_dps(port, app) < 0.05
    assert off(app.learning.cal.gyro_bias_dps, (6.0, -5.0, 4.0)) < 0.05


class Pushed(Still):
    """At rest for three seconds, then pushed along y by up to so many g."""

    def __init__(self, g, hz, until_s):
        super().__init__()
        self.g, self.hz, self.until_s = g, hz, until_s

    def at(self, t_s):
        rates = list(super().at(t_s))
        if 3.0 < t_s < self.until_s:
            rates[1] += self.g * math.sin(2 * math.pi * self.hz * (t_s - 3.0))
        return tuple(rates)


@pytest.mark.parametrize("platform, name", [
    ("rp2", "attitude"), ("esp32", "attitude"), ("rp2", "float.attitude"),
])  # fmt: skip
@pytest.mark.parametrize("g, hz, until_s", [(0.3, 0.03, 36.3), (1.0, 0.1, 23.0)])
def test_what_the_filter_doubts_in_flight_is_not_claimed(rig, platform, name, g, hz, until_s):
    port, app = rig(Pushed(g, hz, until_s), platform=platform, filter=name)
    until(port, 2.9)
    assert not app.filter.uncertain and not app.uncertain
    doubted = in_row = 0
    while port.now_ns < 60e9:
        port.run_ms(100)
        in_row = in_row + 1 if app.filter.uncertain == 2 else 0
        doubted += in_row > 0
        assert app.uncertain or in_row < 4
    assert doubted and not app.filter.uncertain and not app.uncertain  # and it is claimed again


# ---- what stop() stores


STAYS = {
    "rest": Still(),
    "turn": Turn(4.0, "z", 2.0, 1e9),
    "slow turn": Turn(0.3, "z", 2.0, 1e9),
    "tilt": Turn(0.2, "x", 2.0, 1e9),
    "swing": Sinusoid(10.0, 0.5, "roll"),
    "sway": Sinusoid(0.5, 0.2, "yaw"),
    "to and fro": Pieces((0, 5), (1.0, 8), (-1.0, 8), (0, 4), (3.0, 5), (-3.0, 5)),
}


@pytest.mark.parametrize("name", STAYS)
@pytest.mark.parametrize("seconds", [1.0, 40.0])
def test_stop_never_makes_a_stored_bias_worse(rig, name, seconds):
    stored = (BIAS[0] + 0.03, BIAS[1], BIAS[2] - 0.02)
    port, app = rig(STAYS[name], stored)
    port.run_ms(1000 * seconds)
    app.stop()
    assert off(stored_bias()) <= 0.031


def test_stop_writes_only_what_is_better(rig, tmp_path):
    file = tmp_path / "calibration.txt"
    port, app = rig(Still(), BIAS)
    before = file.read_bytes()
    until(port, 30.0)
    app.stop()
    assert file.read_bytes() == before  # the same within a twentieth of a degree a second
    port, app = rig(Still(), (2.2, -1.5, 3.0))
    until(port, 30.0)
    app.stop()
    assert off(stored_bias()) < 0.02


def test_nothing_is_stored_of_one_rest_that_may_have_been_a_turn(rig):
    port, app = rig(Turn(6.0, "z", 0.0, 1e9))
    until(port, 40.0)
    app.stop()
    assert stored_bias() == (0.0, 0.0, 0.0)
    port, app = rig(Pieces((0.0, 20.0), (40.0, 2.0)))
    until(port, 40.0)
    app.stop()
    assert off(stored_bias()) < 0.02

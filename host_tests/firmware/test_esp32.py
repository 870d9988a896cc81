# SPDX-License-Identifier: MIT
"""The app on the ESP32 as it is: each chip, each of MicroPython's versions that differ."""

import math

import pytest

from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.faults import make
from tools.virtual.motion import Sequence, Sinusoid, Still

CHIPS = ("ESP32", "ESP32S3", "ESP32C3")
VERSIONS = ((1, 24, 0), (1, 25, 0), (1, 26, 0), (1, 27, 0), (1, 29, 0))
SDA_SCL = {"ESP32": (21, 22), "ESP32S3": (8, 9), "ESP32C3": (6, 7)}
FAILSAFE_MS = 100

chips = pytest.mark.parametrize("chip", CHIPS)
versions = pytest.mark.parametrize("version", VERSIONS, ids=lambda v: "%d.%d" % v[:2])


def swing():
    rest = Still(roll_deg=-20.0)
    return Sequence((rest, 1.0), (Sinusoid(20.0, 0.5, "roll", phase_deg=-90), 1e9))


@pytest.fixture
def rig(tmp_path):
    """rig(chip, version, motion=None, knobs) -> (port, bus, app), started."""
    ports = []

    def build(chip, version, motion=None, start=True, **knobs):
        bus = Bus(MPU6050Chip(motion or Still(), seed=3, gyro_bias_dps=(2.0, -1.5, 1.0)))
        port = Port(
            "esp32", {0: bus}, machine_name=chip, version=version, wiring={0: SDA_SCL[chip]},
            root=tmp_path,
        )  # fmt: skip
        port.__enter__()
        ports.append(port)
        from firmware.app import App

        app = App()
        for name, value in {"rest_s": 0.2, **knobs}.items():
            app.config.set(name, value)
        if start:
            app.start()
        return port, bus, app

    yield build
    for port in ports:
        assert port.errors == []
        port.__exit__(None, None, None)


@chips
@versions
def test_it_follows_and_the_bus_is_in_time(rig, chip, version):
    port, _, app = rig(chip, version, swing())
    worst = 0.0
    while port.now_ns < 5e9:
        port.run_ms(50)
        true = math.degrees(2 * math.asin(app_truth(port)[1]))
        worst = max(worst, abs(app.roll_deg - true))
    stats = app.stats()
    assert worst < 1.5 and stats["lost"] == stats["overruns"] == stats["errors"] == 0
    assert app.board.soft is (chip != "ESP32" and version < (1, 27))


def app_truth(port):
    return port.buses[0].devices[0].truth(port.now_ns / 1e9)


@chips
@versions
def test_what_a_deaf_bus_means_is_said(rig, chip, version, capsys):
    rig(chip, version)
    printed = capsys.readouterr().out
    deaf = chip != "ESP32" and version < (1, 27)
    assert ("waits up to a second for a stuck bus" in printed) is deaf
    assert ("1.27 does not" in printed) is deaf


@chips
@versions
@pytest.mark.parametrize("fault", ["timeout", "sda_held"])
def test_outputs_are_safe_in_time_while_the_bus_is_stuck(rig, chip, version, fault):
    port, bus, app = rig(chip, version)
    calls = []
    app.outputs.add(lambda _app: calls.append((port.now_ns, "on")),
                    lambda: calls.append((port.now_ns, "safe")))  # fmt: skip
    port.run_ms(500)
    began = port.now_ns
    parameters = {"clocks": 10**9} if fault == "sda_held" else {}
    bus.faults.append(make(fault, at_s=began / 1e9, **parameters))
    port.run_ms(400)
    safe = [t for t, what in calls if what == "safe"]
    last_on = max(t for t, what in calls if what == "on")
    assert len(safe) == 1
    # a transfer that is under way when the time is up: 20 ms, and a look at a register
    assert FAILSAFE_MS - 5 < (safe[0] - began) / 1e6 < FAILSAFE_MS + 45
    assert last_on < safe[0]
    assert app.stale
    bus.faults.clear()
    bus.advance(port.now_ns)
    port.run_ms(500)
    assert not app.stale and calls[-1][1] == "on"


@chips
@versions
@pytest.mark.parametrize("name, parameters, back_ms", [
    ("nack", {"for_s": 0.1}, 40), ("timeout", {"for_s": 0.1}, 60),
    ("sda_held", {"clocks": 9}, 110), ("brown_out", {"for_s": 0.005}, 300),
])  # fmt: skip
def test_a_fault_is_over_soon_after_it_ends(rig, chip, version, name, parameters, back_ms):
    port, bus, app = rig(chip, version, swing())
    port.run_ms(2000)
    bus.faults.append(make(name, at_s=port.now_ns / 1e9 + 0.002, **parameters))
    port.run_ms(2 + 1000 * parameters.get("for_s", 0.0))
    began = port.now_ns
    fresh = 0
    while fresh < 10:
        port.run_ms(4)
        fresh = fresh + 1 if app.fresh else 0
        assert (port.now_ns - began) / 1e6 < back_ms + 44
    assert not app.stale
    port.run_ms(1000)
    true = math.degrees(2 * math.asin(app_truth(port)[1]))
    assert app.roll_deg == pytest.approx(true, abs=1.5)


@chips
@versions
def test_lines_that_nobody_reads_end_by_themselves(rig, chip, version, capfdbinary):
    port, _, app = rig(chip, version)
    port.run_ms(200)
    port.clock.at(port.now_ns + 500_000_000, lambda: setattr(port.console, "reading", False))
    before = app.stats()
    blocked_ns = port.console.blocked_ns
    app.watch(3.0)
    after = app.stats()
    waited_ms = (port.console.blocked_ns - blocked_ns) / 1e6
    usb = chip != "ESP32"
    assert after["telemetry_stalls"] == usb
    assert waited_ms <= {"ESP32": 1, "ESP32S3": 500, "ESP32C3": 200}[chip]
    assert after["lost"] - before["lost"] <= waited_ms / 4 + 1
    if not usb:  # a UART sends on
        assert after["telemetry_lines"] - before["telemetry_lines"] == pytest.approx(150, abs=5)
    port.console.reading = True
    app.watch(0.5)
    assert app.stats()["telemetry_lines"] >= after["telemetry_lines"] + 20  # asked for anew


@chips
@versions
def test_the_report_of_a_slow_console_costs_what_it_costs(rig, chip, version, capsys):
    """A UART prints 11 bytes a millisecond; the tick waits, and bridges."""
    port, _, app = rig(chip, version)
    port.run_ms(500)
    port.exec("print(app.stats())", {"app": app, "print": port.importer.builtins["print"]})
    port.run_ms(300)
    stats = app.stats()
    assert not app.stale and stats["errors"] == 0
    assert (stats["lost"] > 4) is (chip == "ESP32")


@chips
def test_motors_start_with_their_safe_pulse(rig, chip):
    port, _, app = rig(chip, (1, 27, 0))
    pin = app.board.outputs[0]
    app.board.pwm(pin, 400, 1_000_000)
    pulses = [duty * 1e6 / 65535 / freq for _, freq, duty in port.pin(pin).pwm.history]
    assert pulses[-1] == pytest.approx(1000, abs=1)
    assert max(pulses) < 1001  # never the half period that the port begins with by itself

# SPDX-License-Identifier: MIT
"""Each program of docs/examples does what its first line says, on a virtual board."""

import math
import re
from types import SimpleNamespace

import numpy as np
import pytest

from host_tests.tools.example_rig import EXAMPLES, NETWORK, WIRES, Bench, Client, Oled, Visit
from tools.virtual import MPU6050Chip
from tools.virtual.motion import Sequence, Sinusoid, Still
from tools.virtual.port.outputs import VirtualReset
from tools.virtual.rp2040.flash import ROOT, cross_compile

FILES = sorted(EXAMPLES.glob("*.py"))


def numbers(line):
    return [float(word) for word in re.findall(r"-?\d+\.?\d*", line)]


def test_every_example_has_a_test_and_is_on_the_page():
    page = (ROOT / "docs" / "site" / "examples.md").read_text()
    assert len(FILES) >= 12
    for path in FILES:
        assert f"test_{path.stem}" in globals(), path.name
        assert f"`{path.name}`" in page, path.name


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_it_is_short_says_how_to_wire_and_compiles_for_a_board(path):
    text = path.read_text()
    assert text.startswith('# SPDX-License-Identifier: MIT\n"""')
    assert len(text.splitlines()) <= 48
    docstring = text.split('"""')[1]
    assert re.search(r"\bWire\b.*(MPU6050|sensor|both|as|print_angles.py)", docstring)
    for arch in ("armv6m", "xtensawin"):
        cross_compile(text.encode(), path.name, arch)


@pytest.mark.parametrize("platform", WIRES)
def test_print_angles(platform, tmp_path, capsys):
    with Bench(tmp_path, Still(12.0, -7.0), platform) as bench:
        bench.run("print_angles.py", 4)
        lines = [line for line in capsys.readouterr().out.splitlines() if "roll" in line]
        assert 20 <= len(lines) <= 40  # ten a second, once it has started
        roll, pitch, yaw = numbers(lines[-1])
        assert roll == pytest.approx(12.0, abs=0.5) and pitch == pytest.approx(-7.0, abs=0.5)
        assert yaw == pytest.approx(0.0, abs=0.5)
        bench.bus.devices.remove(bench.chip)
        bench.port.run_ms(500)
        assert bench.names["app"].stale
        bench.bus.devices.append(bench.chip)


def test_data_ready(tmp_path, capsys):
    """A sensor whose clock is 2 % fast makes a sample every 4000 / 1.02 us."""
    with Bench(tmp_path, Still(12.0)) as bench:
        bench.bus.devices[:] = [MPU6050Chip(Still(12.0), seed=3, clock_error=0.02)]
        bench.port.connect_int(bench.bus.devices[0], bench.int_pin)
        bench.run("data_ready.py", 6)
        roll, period_us = numbers(capsys.readouterr().out.splitlines()[-1])
        assert roll == pytest.approx(12.0, abs=0.5)
        assert period_us == pytest.approx(4000 / 1.02, abs=8)
        assert bench.names["app"].config.drive == "data-ready"


def test_two_sensors(tmp_path, capsys):
    other = MPU6050Chip(Still(40.0), seed=5, address=0x69)
    with Bench(tmp_path, Still(10.0), others=[other]) as bench:
        bench.run("two_sensors.py", 6)
        lines = capsys.readouterr().out.splitlines()
        assert len(lines) > 10
        assert numbers(lines[-1]) == [pytest.approx(30.0, abs=0.8)]


def test_oled(tmp_path):
    oled = Oled()
    with Bench(tmp_path, Still(20.0, 10.0), others=[oled]) as bench:
        bench.run("oled.py", 5)
        app = bench.names["app"]
        assert not app.stale and app.roll_deg == pytest.approx(20.0, abs=0.5)
    assert oled.told[0x8D] == b"\x14" and oled.told[0xA8] == b"\x3f" and 0xAF in oled.told
    assert oled.told[0x21] == b"\x00\x7f" and oled.told[0x22] == b"\x00\x07"
    assert oled.frames > 10
    bits = np.unpackbits(np.frombuffer(oled.memory, "u1"), bitorder="little").reshape(8, 128, 8)
    x, y = np.nonzero(bits.transpose(1, 0, 2).reshape(128, 64))
    assert len(x) > 100 and len(set(x)) == len(x)
    # right side and nose down, the display looked at from behind: up on the right, and higher
    slope, middle = np.polyfit(x - 64, y, 1)
    assert slope == pytest.approx(-math.tan(math.radians(20.0)), abs=0.02)
    assert middle == pytest.approx(32 - 10 / 2, abs=0.5)


def test_motion_wake(tmp_path, capsys):
    motion = Sequence((Still(), 15.0), (Still(30.0), 1e9))
    with Bench(tmp_path, motion) as bench:
        bench.port.connect_int(bench.chip, bench.int_pin)
        with pytest.raises(VirtualReset) as reset:
            bench.run("motion_wake.py")
        woken_ns = bench.port.now_ns
        assert 15.0 < woken_ns / 1e9 < 15.3  # five looks a second
        first = capsys.readouterr().out.splitlines()
        assert first[0] == "switched on" and 5 <= len(first) < 12
    with Bench(tmp_path, None, reset_cause=reset.value.cause) as again:
        again.bus.devices[:] = [bench.chip]
        again.port.connect_int(bench.chip, again.int_pin)
        again.port.clock.sleep(woken_ns)
        again.run("motion_wake.py", 4)
        lines = capsys.readouterr().out.splitlines()
        assert lines[0] == "moved"
        assert numbers(lines[-1])[0] == pytest.approx(30.0, abs=0.5)


def test_log_to_flash(tmp_path, capsys):
    sway = Sinusoid(20.0, 0.5)
    with Bench(tmp_path, Sequence((Still(), 3.0), (sway, 1e9))) as bench:
        bench.run("log_to_flash.py")
        assert capsys.readouterr().out.splitlines()[-1] == "100 lines in /log.csv"
        port = bench.port
        ago_ms = port.time.ticks_diff(port.time.ticks_ms(), bench.names["began"])
        began_s = port.now_ns / 1e9 - ago_ms / 1000
    head, *lines = (tmp_path / "log.csv").read_text().splitlines()
    assert head == "ms,roll_deg,pitch_deg,yaw_deg,stale"
    rows = np.array([[float(word) for word in line.split(",")] for line in lines])
    assert rows.shape == (100, 5)
    assert np.abs(rows[:, 0] - 100 * np.arange(100)).max() <= 5
    times = began_s + rows[:, 0] / 1000
    truth = [sway.angle_deg(t - 3.0) if t > 3.0 else 0.0 for t in times]
    assert np.ptp(truth) > 39 and np.abs(rows[:, 1] - truth).max() < 1.0
    assert not rows[:, 4].any()


def test_servo(tmp_path, capsys):
    sway = Sinusoid(30.0, 0.5)
    with Bench(tmp_path, Sequence((Still(), 3.0), (sway, 1e9))) as bench:
        bench.run("servo.py")
        [pin] = numbers(capsys.readouterr().out.splitlines()[-1])
        pwm = bench.port.pin(int(pin)).pwm
        assert pwm.freq() == 50
        pulses = []
        for _ in range(40):
            bench.port.run_ms(100)
            t = bench.port.now_ns / 1e9
            angle = sway.angle_deg(t - 3.0) if t > 3.0 else 0.0
            pulses.append(pwm.duty_ns() / 1000)
            assert pulses[-1] == pytest.approx(1500 + angle * 1000 / 90, abs=15)  # 1.3 degrees
        assert np.ptp(pulses) > 600
        bench.bus.devices.remove(bench.chip)
        bench.port.run_ms(300)
        assert pwm.duty_ns() == 0
        bench.bus.devices.append(bench.chip)


def drive(bench, printed):
    """A function that tells the bridge's drive in permille, at the pins that were printed."""
    pins = map(int, numbers(printed.splitlines()[-1]))
    forward, backward = (bench.port.pin(pin).pwm for pin in pins)
    return lambda: (forward.duty_u16() - backward.duty_u16()) * 1000 / 65535


def test_own_pid(tmp_path, capsys):
    """Nothing moves the roll of 10 degrees: 200 permille, and 100 more each second."""
    with Bench(tmp_path, Still(10.0)) as bench:
        bench.run("own_pid.py")
        now = drive(bench, capsys.readouterr().out)
        bench.port.run_ms(100)
        first = now()
        assert first == pytest.approx(-210, abs=10)
        bench.port.run_ms(1000)
        assert now() - first == pytest.approx(-100, abs=5)
        bench.bus.devices.remove(bench.chip)
        bench.port.run_ms(300)
        assert now() == 0
        bench.bus.devices.append(bench.chip)


def test_own_pid_in_motion(tmp_path, capsys):
    """All three terms, of 20, 10 and 0.5, on 10 sin(w t): the rate's share is 31 permille."""
    w = 2 * math.pi
    with Bench(tmp_path, Sequence((Still(), 3.0), (Sinusoid(10.0, 1.0), 1e9))) as bench:
        bench.run("own_pid.py")
        now = drive(bench, capsys.readouterr().out)
        bench.port.run_ms(3000 - bench.port.now_ns / 1e6)
        for k in range(1, 41):
            bench.port.run_ms(50)
            t = k * 0.05
            integral, rate = 10 * (1 - math.cos(w * t)) / w, 10 * w * math.cos(w * t)
            expected = -(20 * 10 * math.sin(w * t) + 10 * integral + 0.5 * rate)
            assert now() == pytest.approx(expected, abs=15)


@pytest.mark.parametrize("platform", WIRES)
def test_wifi_page(platform, tmp_path, capsys):
    with Bench(tmp_path, Still(12.0, -7.0), platform) as bench:
        visits, asyncio = [], bench.port.modules["asyncio"]

        async def start_server(answer, host, port):
            assert (host, port) == ("0.0.0.0", 80)

            async def browser():
                for _ in range(3):
                    await asyncio.sleep(1)
                    visits.append(Visit())
                    await answer(visits[-1], visits[-1])

            visits.append(asyncio.create_task(browser()))

        asyncio.start_server = start_server
        bench.port.importer.replaced["network"] = NETWORK
        bench.run("wifi_page.py", 7)
        assert capsys.readouterr().out.splitlines()[-1] == "http://192.168.1.7/"
        assert len(visits) == 4
        for visit in visits[1:]:
            head, body = visit.sent.decode().split("\r\n\r\n")
            assert head.startswith("HTTP/1.0 200 OK\r\n") and visit.closed
            roll, pitch, yaw = numbers(re.search("<h1>(.*)</h1>", body)[1])
            assert roll == pytest.approx(12.0, abs=0.5) and pitch == pytest.approx(-7.0, abs=0.5)
            assert yaw == pytest.approx(0.0, abs=0.5)
        assert "fresh" in body


def test_mqtt(tmp_path, capsys):
    Client.got, Client.connects = [], 0
    with Bench(tmp_path, Still(12.0, -7.0)) as bench:
        bench.port.importer.replaced["network"] = NETWORK
        bench.port.importer.replaced["umqtt"] = SimpleNamespace(MQTTClient=Client)
        bench.run("mqtt.py", 14)
        assert capsys.readouterr().out.count("broker:") == 2
    messages = [message for message in Client.got if message]
    assert Client.connects == 3 and len(messages) >= 6
    assert {topic for topic, _ in messages} == {b"plumb/attitude"}
    last = messages[-1][1]
    assert last["roll"] == pytest.approx(12.0, abs=0.5) and last["stale"] is False
    assert last["pitch"] == pytest.approx(-7.0, abs=0.5) and abs(last["yaw"]) < 0.5


def angles(printed):
    """(roll, pitch) of each line of paper 004's programs."""
    found = re.findall(r"Roll Angle \[deg\]: (\S+) Pitch Angle \[deg\]: (\S+)", printed)
    return np.array(found, dtype=float)


def paper_004(tmp_path, capsys, name, seconds):
    with Bench(tmp_path, Still(12.0, -7.0), call_ns=20_000) as bench:
        bench.run(name, seconds)
    return angles(capsys.readouterr().out)


def test_paper_004_unfiltered(tmp_path, capsys):
    rows = paper_004(tmp_path, capsys, "paper_004_unfiltered.py", 4)
    assert 60 <= len(rows) <= 80  # 20 a second
    assert rows.mean(axis=0) == pytest.approx([12.0, -7.0], abs=0.2)


def test_paper_004_filtered(tmp_path, capsys):
    """Steadier than the other one, and its bias of 2 deg/s is gone."""
    rows = paper_004(tmp_path, capsys, "paper_004_filtered.py", 12)
    raw = paper_004(tmp_path, capsys, "paper_004_unfiltered.py", 4)
    settled = rows[-50:]
    assert settled.mean(axis=0) == pytest.approx([12.0, -7.0], abs=0.2)
    assert (settled.std(axis=0) < raw.std(axis=0) / 2).all()

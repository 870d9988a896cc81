# SPDX-License-Identifier: MIT
"""Two Apps on the same two wires, at any distance of their ticks: neither starves the other, and
both are there again after whatever happens to the wires or to one of the chips."""

import random

import pytest

from host_tests.firmware.test_gaps import BOARDS, KINDS, Rig
from tools.virtual.chip import MPU6050Chip
from tools.virtual.chip.minimu9 import L3GD20Chip, LSM303Chip
from tools.virtual.faults import make
from tools.virtual.motion import Still

PHASES = 40
EACH_MS = 60
ONE_CHIPS = ("brown_out", "unplugged", "stuck_data")


def two(rig, **knobs):
    """Two Apps that run; the knobs are the second one's."""
    from firmware.app import App

    rig.bus.devices.append(MPU6050Chip(Still(40.0), seed=5, address=0x69))
    upper, lower = rig.app, App(name="lower")
    for name, value in dict(knobs, address=0x69).items():
        lower.config.set(name, value)
    upper.start()
    lower.start()
    rig.port.run_ms(100)
    return upper, lower


@pytest.mark.parametrize("burst", ["auto", "blocking"])
@pytest.mark.parametrize("rates_hz", [(250, 250), (500, 500), (250, 500), (200, 250)])
@pytest.mark.parametrize("board", BOARDS)
def test_both_are_fresh_at_any_distance_of_their_ticks(board, rates_hz, burst, tmp_path):
    knobs = {"rest_s": 0.05, "burst": burst}
    with Rig(board, Still(10.0), tmp_path, rate_hz=rates_hz[0], **knobs) as rig:
        upper, lower = two(rig, rate_hz=rates_hz[1], **knobs)
        for phase in range(PHASES):
            lower.loop.stop()
            rig.port.clock.sleep(round(phase * upper.period_us * 1000 / PHASES) + 13_000)
            lower.loop.start()
            rig.port.run_ms(EACH_MS)
            before = [app.stats() for app in (upper, lower)]
            rig.port.run_ms(EACH_MS)
            for app, was in zip((upper, lower), before):
                now = app.stats()
                assert not app.stale and not app.uncertain
                without = now["predicted"] - was["predicted"]
                looks = now["busy"] - was["busy"]  # at registers, by the other's foreground
                late = 0 if board == "hard" else 1  # soft callbacks wait for each other
                assert looks <= without <= looks + late, (phase, app is upper)
                assert looks <= 3
        assert upper.roll_deg == pytest.approx(10.0, abs=0.5)
        assert lower.roll_deg == pytest.approx(40.0, abs=0.5)
        lower.stop()


@pytest.mark.parametrize("for_s", [0.02, 0.4])
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("board", BOARDS)
def test_both_are_there_again_after_any_fault(board, kind, for_s, tmp_path):
    """A fault of one chip, each in turn, leaves the other one's estimate alone."""
    phase = random.Random(f"{board} {kind} {for_s}")
    with Rig(board, Still(10.0), tmp_path, rest_s=0.05) as rig:
        upper, lower = two(rig, rest_s=0.05)
        for address in (0x68, 0x69, 0x68, 0x69):
            rig.port.run_ms(3000 + phase.uniform(0, 8))
            assert not (upper.stale or lower.stale or upper.uncertain or lower.uncertain)
            fault = make(
                kind, at_s=rig.port.now_ns / 1e9, for_s=for_s, address=address, **KINDS[kind]
            )
            rig.bus.faults.append(fault)
            other, its_deg = (lower, 40.0) if address == 0x68 else (upper, 10.0)
            for _ in range(round(for_s * 100) + 40):
                rig.port.run_ms(10)
                if kind in ONE_CHIPS:
                    assert not other.stale and abs(other.roll_deg - its_deg) < 0.5
                for app, true_deg in ((upper, 10.0), (lower, 40.0)):
                    claimed = not (app.stale or app.uncertain)
                    assert not claimed or abs(app.roll_deg - true_deg) < 1.0
                    assert kind != "sda_held" or not app.stale  # nine clocks free it
            assert fault.done and not (upper.stale or lower.stale)
        lower.stop()


@pytest.mark.parametrize("phase_ms", [0.3, 0.9, 1.5, 2.1, 2.7, 3.3, 3.9])
@pytest.mark.parametrize("kind", ["stuck_data", "unplugged"])
def test_the_mending_of_one_starves_no_hard_tick_of_the_other(kind, phase_ms, tmp_path):
    """It takes the bus again and again, from a callback of the scheduler."""
    with Rig("hard", Still(10.0), tmp_path, rest_s=0.05) as rig:
        upper, lower = two(rig, rest_s=0.05)
        lower.loop.stop()
        rig.port.clock.sleep(round(phase_ms * 1e6) + 13_000)
        lower.loop.start()
        for address, other in ((0x68, lower), (0x69, upper)):
            rig.port.run_ms(1000)
            fault = make(
                kind, at_s=rig.port.now_ns / 1e9, for_s=0.4, address=address, **KINDS[kind]
            )
            rig.bus.faults.append(fault)
            for _ in range(800):
                rig.port.run_ms(1)
                assert other.age_us < 16_000
        lower.stop()


@pytest.mark.parametrize("first", ["MPU6050", "MinIMU9"])
@pytest.mark.parametrize("board", BOARDS)
def test_a_sensor_of_another_kind_waits_for_the_bursts_of_the_first(board, first, tmp_path):
    """Whose App came last, and whichever it is: their transfers never overlap (Rig looks)."""
    with Rig(board, Still(10.0), tmp_path, rest_s=0.05) as rig:
        from minimu9 import MinIMU9

        from firmware.app import App

        rig.bus.devices += [L3GD20Chip(Still(40.0), seed=5), LSM303Chip(Still(40.0), seed=6)]
        other = App(name="other", sensor=MinIMU9)
        other.config.set("rest_s", 0.05)
        apps = [rig.app, other] if first == "MPU6050" else [other, rig.app]
        for app in apps:
            app.start()
        for phase in range(PHASES):
            other.loop.stop()
            rig.port.clock.sleep(round(phase * other.period_us * 1000 / PHASES) + 13_000)
            other.loop.start()
            rig.port.run_ms(EACH_MS)
            assert not (rig.app.stale or other.stale), phase
        assert rig.app.roll_deg == pytest.approx(10.0, abs=0.5)
        assert other.roll_deg == pytest.approx(40.0, abs=1.0)
        other.stop()


@pytest.mark.parametrize("board", BOARDS)
def test_one_pair_of_wires_has_one_speed(board, tmp_path):
    with Rig(board, Still(10.0), tmp_path, rest_s=0.05) as rig:
        upper, lower = two(rig, rest_s=0.05)
        with pytest.raises(OSError, match="400000 Hz for a running App"):
            lower.set("bus_hz", 100000)
        rig.port.run_ms(2500)
        assert lower.config.bus_hz == 400000
        for app, true_deg in ((upper, 10.0), (lower, 40.0)):
            assert not (app.stale or app.uncertain)
            assert app.roll_deg == pytest.approx(true_deg, abs=0.5)
        lower.stop()
        lower.config.set("bus_hz", 100000)
        with pytest.raises(OSError, match="400000 Hz for a running App"):
            lower.start()
        rig.port.run_ms(100)
        assert not upper.stale
        upper.stop()
        lower.start()
        rig.port.run_ms(2500)
        assert lower.roll_deg == pytest.approx(40.0, abs=0.5)
        lower.stop()


EDGES = {"drive": "data-ready", "rest_s": 0.05}
TIMED = {"rest_s": 0.05}


@pytest.mark.parametrize("first, second, kinds", [
    (EDGES, None, ["hard"]),
    (EDGES, TIMED, ["hard", "soft"]),  # which holds the bus while it is at it
    (TIMED, EDGES, ["soft", "soft"]),  # that one did not know that another would come in between
    (TIMED, TIMED, ["soft", "soft"]),
])  # fmt: skip
def test_edges_tick_hard_without_hard_timers_where_no_soft_tick_is_in_their_way(
    first, second, kinds, tmp_path
):
    with Rig("soft", Still(10.0), tmp_path, **first) as rig:
        apps = [rig.app]
        chips = [rig.chip]
        if second:
            apps = two(rig, pin_int=21, **second)
            chips.append(rig.bus.devices[-1])
        else:
            rig.app.start()
        for app, chip in zip(apps, chips):
            rig.port.connect_int(chip, app.board.int_pin)
        rig.port.run_ms(500)
        assert [app.tick_kind for app in apps] == kinds
        assert not any(app.stale or app.stats()["errors"] for app in apps)
        if len(apps) == 2:
            assert apps[1].roll_deg == pytest.approx(40.0, abs=0.5)
            apps[1].stop()
            apps[0].stop()
            apps[0].start()  # alone now, as it wants
            assert apps[0].tick_kind == ("hard" if first is EDGES else "soft")

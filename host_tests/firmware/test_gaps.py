# SPDX-License-Identifier: MIT
"""Ticks that did not come and samples that were not there: what is claimed afterwards is true.

On the RP2 with a soft tick, on the RP2 with a hard one, and on the ESP32.
"""

import itertools
import random
from math import asin, atan2, cos, degrees, radians, sin

import pytest

from firmware.faults.policy import POLICY
from firmware.filters import SETTINGS
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.motion import Sequence, Sinusoid, Still
from tools.virtual.port import Port

# platform, MicroPython's version, SDA and SCL
BOARDS = {
    "soft": ("rp2", (1, 25, 0), (4, 5)),
    "hard": ("rp2", (1, 26, 1), (4, 5)),
    "esp32": ("esp32", (1, 25, 0), (21, 22)),
}
SWING = Sequence((Still(roll_deg=-20.0), 1.0), (Sinusoid(20.0, 0.5, "roll", phase_deg=-90), 1e9))


class Turn:
    """By 90 degrees from 2 s to 4 s; from 5 s on at `rate_dps` for ever."""

    duration_s = None

    def __init__(self, rate_dps=0.0):
        self.rate_dps = rate_dps

    def at(self, t):
        rate = 45.0 if 2 <= t < 4 else self.rate_dps if t >= 5 else 0.0
        return (0, 0, 1, 0, 0, rate, 25.0)

    def truth(self, t):
        half = radians(45 * min(max(t - 2, 0), 2) + self.rate_dps * max(t - 5, 0)) / 2
        return (cos(half), 0, 0, sin(half))


class Rig:
    """An App on a virtual board, started; `port`, `chip`, `bus`, `app`."""

    def __init__(self, board, motion, folder, **knobs):
        platform, version, pins = BOARDS[board]
        self.chip = MPU6050Chip(motion, seed=3, gyro_bias_dps=(2.0, -1.5, 1.0))
        self.bus = Bus(self.chip)
        self.port = Port(platform, {0: self.bus}, wiring={0: pins}, version=version, root=folder)
        self.knobs = knobs

    def __enter__(self):
        self.port.__enter__()
        from firmware.app import App

        self.app = App()
        for name, value in self.knobs.items():
            self.app.config.set(name, value)
        self.port.connect_int(self.chip, self.app.board.int_pin)
        return self

    def __exit__(self, *error):
        uncaught = self.port.errors + [self.app.foreground.error, self.app.tick.error]
        self.port.__exit__(*error)
        assert [error for error in uncaught if error] == []

    def until(self, t_s):
        self.port.run_ms(t_s * 1000 - self.port.now_ns / 1e6)

    @property
    def claimed(self):
        return not (self.app.stale or self.app.uncertain)

    def roll_error(self):
        true = degrees(2 * asin(self.chip.truth(self.port.now_ns / 1e9)[1]))
        return abs(self.app.roll_deg - true)

    def yaw_error(self):
        w, x, y, z = self.chip.truth(self.port.now_ns / 1e9)
        true = degrees(atan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z))
        return (self.app.yaw_deg - true + 180) % 360 - 180


@pytest.mark.parametrize("masked", [False, True], ids=["held", "masked"])
@pytest.mark.parametrize("burst", ["auto", "blocking"])
@pytest.mark.parametrize("rate_hz", [250, 500, 1000])
@pytest.mark.parametrize("board", BOARDS)
def test_a_pause_at_any_phase_never_makes_a_claimed_wrong_angle(
    board, rate_hz, burst, masked, tmp_path
):
    """`held`: C code that does not return; `masked`: a write to flash stops interrupts too."""
    phase = random.Random(f"{board} {rate_hz} {burst} {masked}")
    with Rig(board, SWING, tmp_path, rest_s=0.1, rate_hz=rate_hz, burst=burst) as rig:
        rig.app.start()
        rig.port.run_ms(1500)
        for pause_s in (0.1, 0.2, 0.4, 1.0):
            rig.port.run_ms(100 + phase.uniform(0, 300))
            stop = rig.port.clock.masked if masked else rig.port.clock.hold
            stop(round(pause_s * 1e9))
            for _ in range(60):
                rig.port.run_ms(1)
                assert not rig.claimed or rig.roll_error() < 1.5, pause_s
            if board == "hard" and not masked:
                assert rig.claimed  # nothing of it reached the tick
                assert rig.app.stats()["lost"] == 0
        rig.app.zero_yaw()
        rig.port.run_ms(2000)
        assert rig.claimed and rig.roll_error() < 1.0


NO_YAW = ("kalman2", "float.kalman", "float.complementary")
FAST = Sequence((Still(roll_deg=-40.0), 1.0), (Sinusoid(40.0, 0.7, "roll", phase_deg=-90), 1e9))


@pytest.mark.parametrize("masked", [False, True], ids=["held", "masked"])
@pytest.mark.parametrize("gyro_dps, accel_g", [(250, 2), (500, 8), (2000, 2)])
@pytest.mark.parametrize("rate_hz", [80, 250, 1000])
@pytest.mark.parametrize("board", BOARDS)
def test_what_was_turned_in_a_pause_is_no_fault(
    board, rate_hz, gyro_dps, accel_g, masked, tmp_path
):
    """Up to 352 dps of difference, and 2 x sin(40 deg) g: far more than a leap in a period."""
    knobs = {"rate_hz": rate_hz, "gyro_dps": gyro_dps, "accel_g": accel_g, "rest_s": 0.1}
    with Rig(board, FAST, tmp_path, **knobs) as rig:
        rig.app.start()
        rig.until(1.5)
        told = set()
        for pause_ms in range(40, 1100, 53):
            if masked:
                rig.port.clock.masked(round(pause_ms * 1e6))
            else:
                with rig.app.bus:
                    rig.port.run_ms(pause_ms)
            rig.port.run_ms(5 * 1000 / rate_hz)
            assert not rig.app.stale
            stats = rig.app.stats()
            told |= {row.cause for row in POLICY[1:] if stats.get(row.cause)}
        assert told == set()


WIDE = Sequence((Still(roll_deg=-40.0), 1.0), (Sinusoid(40.0, 0.4, "roll", phase_deg=-90), 1e9))


@pytest.mark.parametrize("kind", ["attitude", "float.attitude"])
@pytest.mark.parametrize("board", BOARDS)
def test_no_mean_that_levels_has_something_of_before_a_gap(board, kind, tmp_path):
    """A levelling, and from 20 to 500 ms later an outage; turning by up to 100 deg/s."""
    with Rig(board, WIDE, tmp_path, filter=kind, rest_s=0.1) as rig:
        rig.app.start()
        rig.until(1.9)
        for wait_ms, for_ms in itertools.product((20, 100, 200, 500), (30, 100, 200)):
            rig.app.filter.relevel()
            rig.port.run_ms(wait_ms)
            before = rig.roll_error()
            at_s = rig.port.now_ns / 1e9
            rig.bus.faults[:] = [make("unplugged", at_s=at_s, for_s=for_ms / 1000, seed=1)]
            rig.port.run_ms(for_ms)
            for _ in range(100):
                rig.port.run_ms(10)
                gone = rig.app.age_us > 12_000
                assert gone or rig.roll_error() < before + 1.2, (wait_ms, for_ms)


@pytest.mark.parametrize("missing", [1, 3, 10, 40])
@pytest.mark.parametrize("kind", SETTINGS)
@pytest.mark.parametrize("board", BOARDS)
def test_every_filter_turns_once_by_what_was_turned_in_gaps(board, kind, missing, tmp_path):
    """So many ticks in a row find the bus taken, over and over, in three seconds of a swing and
    of a turn."""
    for motion, begins_s in ((SWING, 1.0), (Turn(120.0), 5.5)):
        with Rig(board, motion, tmp_path, rest_s=0.1, filter=kind) as rig:
            rig.app.start()
            rig.until(begins_s)
            before = rig.yaw_error()
            for _ in range(round(3000 / (4 * missing + 8))):
                with rig.app.bus:
                    rig.port.run_ms(4 * missing)
                rig.port.run_ms(8.5)
                assert rig.roll_error() < 1.5
                turned = (rig.yaw_error() - before + 180) % 360 - 180
                assert kind in NO_YAW or abs(turned) < 2
            assert rig.app.stats()["busy"] > 3000 / (4 * missing + 8) * missing * 0.9


@pytest.mark.parametrize("rate_hz", [250, 500, 1000])
@pytest.mark.parametrize("drive, burst", [("timer", "auto"), ("timer", "blocking"),
                                          ("data-ready", "auto")])  # fmt: skip
@pytest.mark.parametrize("board", BOARDS)
def test_a_loop_in_step_with_the_ticks_starves_nobody(board, drive, burst, rate_hz, tmp_path):
    """Another device is talked to once in two, three or four periods, always at the same phase."""
    knobs = {"rate_hz": rate_hz, "drive": drive, "burst": burst, "rest_s": 0.1}
    if drive == "data-ready":
        knobs["sensor_hz"] = rate_hz
    with Rig(board, Still(10.0), tmp_path, **knobs) as rig:
        rig.app.start()
        rig.port.run_ms(500)
        period_ns = rig.app.period_us * 1000
        for periods in (1, 2, 3, 4):
            for held in (0.2, 0.5, 0.8, periods - 0.3):
                for phase in range(8):
                    rig.port.run_ms(period_ns / 8e6)
                    for _ in range(round(150e6 / period_ns / periods)):
                        began_ns = rig.port.now_ns
                        with rig.app.bus:
                            rig.port.clock.hold(round(held * period_ns))
                        left_ns = began_ns + periods * period_ns - rig.port.now_ns
                        rig.port.run_ms(max(0, left_ns) / 1e6)
                        assert not rig.app.stale, (periods, held, phase)


@pytest.mark.parametrize("dlpf_hz", [44, 260])
@pytest.mark.parametrize("rate_hz", [80, 100, 200, 250, 300, 333, 400, 500, 600, 700, 800, 1000])
@pytest.mark.parametrize("board", ["hard", "esp32"])
def test_a_turn_by_edges_reads_right_or_the_rate_is_refused(board, rate_hz, dlpf_hz, tmp_path):
    """The sensor makes whole parts of 1 kHz, of 8 kHz with the widest filter (RM p. 11)."""
    own = 8000 if dlpf_hz == 260 else 1000
    nearest = min((own / n for n in range(1, 257)), key=lambda rate: abs(rate - rate_hz))
    knobs = {"rate_hz": rate_hz, "dlpf_hz": dlpf_hz, "drive": "data-ready", "rest_s": 0.2}
    with Rig(board, Turn(), tmp_path, **knobs) as rig:
        if abs(nearest - rate_hz) > 0.006 * rate_hz:
            with pytest.raises(ValueError, match=f"{nearest:.1f}"):
                rig.app.start()
            return
        rig.app.start()
        rig.until(5.0)
        assert rig.app.yaw_deg == pytest.approx(90, abs=0.5)
        assert rig.app.stats()["tick"] == ("hard" if board == "hard" else "soft")


KINDS = {
    "nack": {},
    "timeout": {},
    "arbitration": {},
    "sda_held": {"clocks": 9},
    "brown_out": {},
    "unplugged": {},
    "filled": {"value": 0},
    "stuck_data": {},
}


@pytest.mark.parametrize("turning", [False, True], ids=["at rest", "turning"])
@pytest.mark.parametrize("for_s", [0.1, 0.3, 1.0, 3.0])
@pytest.mark.parametrize("kind", KINDS)
def test_yaw_over_outages_is_kept_or_said_to_be_lost(kind, for_s, turning, tmp_path):
    board = list(BOARDS)[(list(KINDS).index(kind) + round(for_s)) % 3]
    with Rig(board, Turn(60.0 if turning else 0.0), tmp_path) as rig:
        rig.app.start()
        rig.until(6.0 if turning else 9.0)  # else it is known to rest
        before = rig.yaw_error()
        assert abs(before) < 1.0
        fault = make(kind, at_s=rig.port.now_ns / 1e9, for_s=for_s, **KINDS[kind])
        rig.bus.faults.append(fault)
        for _ in range(round(100 * for_s) + 150):
            rig.port.run_ms(10)
            if rig.claimed:
                assert abs(rig.yaw_error() - before) < (1.0 if turning else 0.5)
                assert max(abs(rig.app.roll_deg), abs(rig.app.pitch_deg)) < 1.0
        assert not rig.app.stale
        if turning and for_s > 1 and kind != "sda_held":  # nine clocks free that one at once
            assert rig.app.uncertain and rig.app.yaw_doubt_deg > 30
        elif not turning:
            assert rig.claimed
        rig.app.zero_yaw()
        rig.port.run_ms(2000)
        assert rig.claimed and rig.app.yaw_doubt_deg == 0


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("held_ms", [0, 12, 40])
def test_settling_passes_also_in_ticks_that_bring_no_burst(board, held_ms, tmp_path):
    """The chip settles whether anybody reads it or not; meanwhile the bus is somebody else's."""
    unused, odd = 6, 0  # places of firmware.tick.words
    with Rig(board, Still(), tmp_path, rest_s=0.1) as rig:
        rig.app.start()
        rig.port.run_ms(400)
        rig.app.tick.words[unused], rig.app.tick.words[odd] = 50000, 1
        passed_ms = held_ms
        with rig.app.bus:
            rig.port.run_ms(held_ms)
        while not rig.app.fresh or not passed_ms:
            rig.port.run_ms(1)
            passed_ms += 1
            assert passed_ms < 70
        assert passed_ms >= 50


class Begins:
    """At rest until `since_s`; from then on it swings by up to 100 deg/s."""

    duration_s = None

    def __init__(self):
        self.since_s = 1e9
        self._swing = Sinusoid(40.0, 0.398, "roll", offset_deg=40.0, phase_deg=-90.0)

    def at(self, t):
        return self._swing.at(t - self.since_s) if t > self.since_s else Still().at(t)

    def truth(self, t):
        return self._swing.truth(max(0.0, t - self.since_s))


@pytest.mark.parametrize("board", BOARDS)
@pytest.mark.parametrize("moves_ms", [20, 150, 290, 310])
def test_a_motion_that_begins_while_it_starts_is_never_claimed_wrong(
    board, moves_ms, tmp_path, monkeypatch
):
    """A start takes a third of a second after its rest has been measured; here as it collects."""
    motion = Begins()
    with Rig(board, motion, tmp_path, rest_s=0.1) as rig:

        class Collector:
            @staticmethod
            def collect():
                motion.since_s = (rig.port.now_ns / 1e6 + moves_ms) / 1000
                rig.port.run_ms(300)

            @staticmethod
            def threshold(*_):
                return -1

        monkeypatch.setattr("firmware.app.gc", Collector)
        rig.app.start()
        assert motion.since_s < 1e3
        claimed = 0
        for _ in range(1500):
            rig.port.run_ms(2)
            claimed += rig.claimed
            assert not rig.claimed or rig.roll_error() < 3.0
        assert claimed > 500


def nobody(app):
    """Only looks, each fifth of a second."""


def controller(app):
    app.outputs.add(lambda app: None)


def reader(app):
    app.loop.readers.append(app.loop.samples())


def plotter(app):
    app.telemetry.on = True


def motor_left_on(app):
    app.tick.words[25] = 1  # AGAIN: a safe() has failed
    app.outputs.mend = lambda: None


def fault(app):
    app.tick.words[8] = app.tick.words[2] = 0  # SURE: the registers are still to be looked at
    app.mend._doing = 1
    app.mend.run = lambda: None


DUE = 50  # ticks at 250 Hz: a look each fifth of a second


@pytest.mark.parametrize(
    "board, deep, waits, ticks",
    [
        ("hard", False, nobody, DUE),
        ("hard", True, nobody, DUE + 20),
        ("soft", True, nobody, DUE),  # nothing there leaves a tick out
        ("hard", True, controller, 1),
        ("hard", True, reader, 1),
        ("hard", True, plotter, 1),
        ("hard", True, motor_left_on, 1),
        ("hard", True, fault, 1),
    ],
)
def test_work_waits_a_little_while_the_program_is_deep_in_calls_and_nobody_waits_for_it(
    board, deep, waits, ticks, tmp_path, monkeypatch
):
    """Else a hard tick finds too little stack."""
    with Rig(board, Still(), tmp_path, rest_s=0.1) as rig:
        rig.app.start()
        rig.port.run_ms(100)
        waits(rig.app)
        rig.app.tick.words[12] = 0  # DUE
        monkeypatch.setattr("firmware.foreground.stack_use", lambda: 4000 if deep else 1000)
        began, work = [], rig.app.foreground._work

        def counted(app):
            ran = app.tick.timing.words[5]
            if ticks == 1 or app.foreground._part == 0:  # a look is made in parts
                began.append(ran)
            work(app)

        monkeypatch.setattr(rig.app.foreground, "_work", counted)
        rig.port.run_ms(3000)
        most = max(b - a for a, b in itertools.pairwise(began))
        assert ticks <= most <= ticks + 1


@pytest.mark.parametrize("waits", [nobody, controller, reader, plotter])
@pytest.mark.parametrize("rate_hz", [100, 250, 1000])
def test_a_look_waits_for_up_to_80_ms_at_any_rate_whoever_is_waited_for(
    waits, rate_hz, tmp_path, monkeypatch
):
    """The time runs while it is deep, due or not: with work after each tick less may be left."""
    with Rig("hard", Still(), tmp_path, rest_s=0.1, rate_hz=rate_hz) as rig:
        rig.app.start()
        rig.port.run_ms(100)
        waits(rig.app)
        rig.app.tick.words[12] = 0  # DUE
        monkeypatch.setattr("firmware.foreground.stack_use", lambda: 4000)
        looks, look = [], rig.app.foreground._look

        def counted(app):
            if app.foreground._part == 0:
                looks.append(app.tick.timing.words[5])
            look(app)

        monkeypatch.setattr(rig.app.foreground, "_look", counted)
        rig.port.run_ms(3000)
        periods_ms = [(b - a) * 1000 / rate_hz for a, b in itertools.pairwise(looks)]
        assert 8 < len(looks) < 15
        least = 280 if waits is nobody else 240
        assert least <= min(periods_ms) and max(periods_ms) <= 280 + 1000 / rate_hz


def test_what_only_settles_is_no_work_after_each_tick(tmp_path, monkeypatch):
    with Rig("hard", Still(), tmp_path, rest_s=0.1) as rig:
        rig.app.start()
        rig.port.run_ms(500)
        rig.app.tick.words[6] = 1000000  # UNUSED_US: a second, and nothing is to be mended
        rig.app.tick.words[0] = 1  # ODD
        began, work = [], rig.app.foreground._work
        monkeypatch.setattr(
            rig.app.foreground, "_work", lambda app: (began.append(app.age_us), work(app))
        )
        rig.port.run_ms(900)
        assert max(began) > 600000 and not rig.app.mend.well
        assert len(began) < 30  # of 225 ticks

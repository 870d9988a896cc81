# SPDX-License-Identifier: MIT
"""A random user of two Apps on the same two wires: knobs, starts, stops, Ctrl-C, faults of either
chip, other devices, pauses, in any order; after each step both tell the truth."""

import contextlib
import io
import random
from math import asin, degrees

import pytest

from firmware.config import ROWS
from host_tests.firmware.test_gaps import BOARDS, KINDS, SWING, Rig
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.motion import Still
from tools.walk.break_in import ctrl_c

WALKS = 12  # of each board
STEPS = 25
# those that decide how they share the wires come more often
SHARING = ("burst", "drive", "rate_hz", "filter", "sensor_hz", "dlpf_hz", "gyro_dps", "bus_hz",
           "address", "failsafe_ms")  # fmt: skip
KNOBS = {
    name: allowed
    for name, *allowed in ROWS
    if not name.startswith("pin_") and name not in ("watchdog_ms", "self_test", "bus")
}
UPPER, LOWER = 0x68, 0x69


def any_value(chance, knob):
    """One that is allowed."""
    default, *allowed = KNOBS[knob]
    if isinstance(allowed[0], tuple):
        return chance.choice(allowed[0])
    return (chance.randint if isinstance(default, int) else chance.uniform)(*allowed)


class Walk:
    """Two Apps that run, on a Rig; `steps` is what has been done."""

    def __init__(self, rig, chance):
        from firmware.app import App

        bias = (-1.0, 0.8, 0.5)
        rig.bus.devices.append(
            MPU6050Chip(Still(40.0), seed=5, address=LOWER, gyro_bias_dps=bias)
        )
        self.rig, self.port, self.chance = rig, rig.port, chance
        self.apps = rig.app, App(name="lower")
        self.apps[1].config.set("address", LOWER)
        self.should_run = [True, True]
        self.trouble_s = 0.0
        self.steps = []
        for app in self.apps:
            app.config.set("rest_s", 0.05)
            app.start()

    @property
    def now_s(self):
        return self.port.now_ns / 1e9

    def true_deg(self, app):
        [chip] = [chip for chip in self.rig.bus.devices if chip.address == app.config.address]
        return degrees(2 * asin(chip.truth(self.now_s)[1]))

    def look(self):
        """What is claimed is right, and two seconds after the last trouble there is something."""
        for app, should_run in zip(self.apps, self.should_run):
            assert app.running or not should_run
            if app.running:
                if not (app.stale or app.uncertain):
                    assert abs(app.roll_deg - self.true_deg(app)) < 3.0
                assert not app.stale or self.now_s < self.trouble_s + 2.0

    def run(self, ms):
        until = self.now_s + ms / 1000
        while self.now_s < until:
            self.port.run_ms(10)
            self.look()

    def rest(self):
        """Until two and a half seconds after the last trouble."""
        self.run(max(0.0, 1000 * (self.trouble_s - self.now_s)) + 2500)

    def call(self, function, *arguments, after=None, below=False):
        """The refusal, or the Ctrl-C at the after-th jump, or None."""
        press = contextlib.nullcontext()
        if after is not None:
            press = ctrl_c(self.port.clock, after, below)
        said, error = io.StringIO(), None
        try:
            with contextlib.redirect_stdout(said), press:
                function(*arguments)
        except (ValueError, OSError, KeyboardInterrupt) as caught:
            error = caught
        self.said = said.getvalue()
        self.trouble_s = max(self.trouble_s, self.now_s)
        self.steps[-1] += (repr(error),)
        return error

    def step(self):
        which = self.chance.randrange(2)
        kinds = {
            "set": 14, "start": 5, "stop": 2, "undo": 2, "defaults": 1, "stats": 1, "read": 2,
            "other_device": 2, "fault": 5, "pause": 2, "ctrl_c": 2, "run": 3, "rest": 3,
        }  # fmt: skip
        [kind] = self.chance.choices(list(kinds), kinds.values())
        self.steps.append((kind, which))
        if kind == "rest":
            self.rest()
        else:
            getattr(self, "_" + kind)(which, self.apps[which])
        self.run(self.chance.choice((0, 10, 60)))

    def _set(self, which, app):
        knob = self.chance.choice(SHARING if self.chance.random() < 0.7 else list(KNOBS))
        value = any_value(self.chance, knob)
        after = self.chance.choice((None, None, None, self.chance.randrange(150)))
        self.steps[-1] += (knob, value, after)
        before = app.config.values()
        error = self.call(app.set, knob, value, after=after)
        if isinstance(error, KeyboardInterrupt):  # before it took effect, or after
            assert app.config.values() in (before, before | {knob: value})
            if self.should_run[which] and not app.running:
                assert "stopped: app.start() begins anew" in self.said
                self.should_run[which] = False
        elif error:
            assert app.config.values() == before

    def _undo(self, which, app):
        before = app.config.values()
        if self.call(app.undo):
            assert app.config.values() == before

    def _defaults(self, which, app):
        """The address too: refused where that sensor has a running App."""
        before = app.config.values()
        if self.call(app.defaults):
            assert app.config.values() == before

    def _start(self, which, app):
        self.should_run[which] = False
        self.should_run[which] = self.call(app.start) is None

    def _stop(self, which, app):
        self.should_run[which] = False
        assert self.call(app.stop) is None

    def _stats(self, which, app):
        assert self.call(app.stats) is None

    def _read(self, which, app):
        if app.imu is not None:
            self.call(app.imu.read)

    def _other_device(self, which, app):
        ms = self.chance.choice((1, 5, 30, 150))
        self.steps[-1] += (ms,)

        def talk():
            with app.bus:
                self.port.clock.hold(ms * 1_000_000)

        assert self.call(talk) is None

    def _fault(self, which, app):
        kind, for_s = self.chance.choice(list(KINDS)), self.chance.choice((0.003, 0.02, 0.3, 1.0))
        address = self.chance.choice((UPPER, LOWER))
        self.steps[-1] += (kind, for_s, address)
        fault = make(kind, at_s=self.now_s, for_s=for_s, address=address, **KINDS[kind])
        self.rig.bus.faults.append(fault)
        self.trouble_s = max(self.trouble_s, self.now_s + for_s)

    def _pause(self, which, app):
        ms, masked = self.chance.choice((3, 30, 300)), self.chance.random() < 0.5
        self.steps[-1] += (ms, masked)
        (self.port.clock.masked if masked else self.port.clock.hold)(ms * 1_000_000)
        self.trouble_s = max(self.trouble_s, self.now_s)

    def _ctrl_c(self, which, app):
        after = self.chance.randrange(200)
        self.steps[-1] += (after,)
        self.call(self.port.run_ms, 100, after=after, below=True)

    def _run(self, which, app):
        self.run(self.chance.choice((10, 100, 700)))


@pytest.mark.parametrize("seed", range(WALKS))
@pytest.mark.parametrize("board", BOARDS)
def test_two_apps_in_any_order(board, seed, tmp_path):
    chance = random.Random(f"{board} {seed}")
    with Rig(board, chance.choice((SWING, Still(10.0))), tmp_path) as rig:
        walk = Walk(rig, chance)
        try:
            for _ in range(STEPS):
                walk.step()
            walk.rest()
        except BaseException:
            print(*walk.steps, sep="\n")
            raise
        for app in walk.apps:
            app.stop()

# SPDX-License-Identifier: MIT
"""What can happen in a walk, by name: `Steps(world).do(name, **parameters)`; all of it can be
written down as a list of (name, parameters), and walked again with replay()."""

import contextlib
import importlib
from pathlib import Path

from tools.virtual import faults
from tools.virtual.port import VirtualReset
from tools.walk.motor import ERRORS, Motor
from tools.walk.world import World

CHIP_KNOBS = (
    "gyro_dps",
    "accel_g",
    "dlpf_hz",
    "sensor_hz",
    "rate_hz",
    "drive",
    "burst",
    "address",
)
PLAIN_FAULTS = {
    "nack": {},
    "timeout": {},
    "arbitration": {},
    "sda_held": {"clocks": 9},
    "brown_out": {},
    "unplugged": {},
    "filled": {"value": 0},
    "bit_flip": {"p": 0.02},
    "int_dead": {},
    "saturation": {"accel_g": (0, 0, 0), "gyro_dps": (3000, 0, 0)},
}
EDITS = {  # of config.txt, by hand: its text before -> after
    "a value": lambda text: text.replace("rate_hz = 250", "rate_hz = 400"),
    "a wrong value": lambda text: text.replace("gyro_dps = ", "gyro_dps = 7"),
    "no number": lambda text: text.replace("rest_s = ", "rest_s = fast"),
    "not together": lambda text: text.replace("drive = timer", "drive = data-ready").replace(
        "rate_hz = 250", "rate_hz = 700"
    ),
    "cut": lambda text: text[: len(text) // 2],
    "empty": lambda text: "",
}


class Steps:
    """The steps on one world. Each leaves the world checked."""

    def __init__(self, board, folder):
        self.world = World(board, folder)

    def do(self, step, **parameters):
        """One step; a watchdog that starves restarts the board."""
        try:
            getattr(self, step)(**parameters)
        except VirtualReset:
            self.world.power_cycle(False)
        self.world.checks.look()

    # ---- time and motion

    def wait(self, ms):
        """Nothing happens."""
        self.world.run(ms)

    def move(self, kind, **parameters):
        """Another motion."""
        world = self.world
        getattr(world.motion, kind)(world.now_s, **parameters)

    def pause(self, ms, masked=False):
        """C code that does not return; `masked`: a write to flash, which stops interrupts too."""
        world = self.world
        stop = world.port.clock.masked if masked else world.port.clock.hold
        began_s = world.now_s
        stop(round(ms * 1e6))
        if masked or world.app.tick_kind != "hard":
            world.checks.trouble(held=True)
            world.checks.paused(began_s)
        world.run(30)

    def fault(self, kind, ms):
        """The bus or the chip fails for a while from now on."""
        world = self.world
        made = faults.make(kind, at_s=world.now_s, for_s=ms / 1000, **PLAIN_FAULTS[kind])
        world.bus.faults.append(made)
        world.checks.trouble(world.now_s + ms / 1000)
        if kind == "saturation" and ms < 100:  # a shock between two samples cannot be known
            world.run(ms + 40)

    # ---- power

    def power_cycle(self, sensor_too=True):
        """The supply fails for a moment, of the board alone or of both."""
        self.world.power_cycle(sensor_too)

    def reset(self):
        """Ctrl-D, or the button: the board begins anew, the sensor does not notice."""
        self.world.power_cycle(False)

    # ---- the REPL's verbs

    def _call(self, function, *arguments, **how):
        """One call; True when it returned. `how`: of World.call()."""
        world = self.world
        world.checks.trouble()
        error = world.call(function, *arguments, **how)
        world.checks.trouble()
        return not isinstance(error, BaseException)

    def start(self, how=None, after=0):
        """app.start()"""
        world = self.world
        world.should_run = False
        if self._call(world.app.start, how=how, after=after):
            world.should_run = True
        elif how != "power cut":
            world.should_run = world.app.running
            world.checks.reference = None

    def stop(self, how=None, after=0):
        """app.stop()"""
        world = self.world
        world.should_run = False
        if not self._call(world.app.stop, how=how, after=after):
            world.should_run = world.app.running

    def set(self, knob, value, how=None, after=0, plainly=False):
        """app.set(knob, value), or app.config.knob = value."""
        world = self.world
        app = world.app
        before = app.config.values()
        if knob in CHIP_KNOBS:
            world.checks.changed()
        if plainly:
            may = (ValueError, OSError, AttributeError)
            done = self._call(setattr, app.config, knob, value, how=how, after=after, refusals=may)
        else:
            done = self._call(app.set, knob, value, how=how, after=after)
        if world.app is not app:
            return
        if not done:
            assert app.config.values() == before, "refused, and %s is changed" % knob

    def verb(self, name, how=None, after=0):
        """A verb without an argument."""
        world = self.world
        app = world.app
        if name in ("undo", "defaults"):
            world.checks.changed()
        if name == "zero_yaw" and app.filter is not None:
            world.checks.zero()
            world.checks.zeroing = True  # until the next tick
        self._call(getattr(app, name), how=how, after=after)

    def ask(self, name):
        """Something that changes nothing."""
        world = self.world
        app = world.app
        if name == "repr":
            assert "App" in repr(app)
            return
        self._call(getattr(app, name))
        if name == "show":
            rows = [line[2:].split() for line in world.said.splitlines()]
            values = {name: str(value) for name, value in app.config.values().items()}
            # what is done after ticks may have had something to say in between
            assert dict(row[:2] for row in rows if row and row[0] in values) == values

    def watch(self, key=False):
        """app.watch(0.05), or until a key, which must not be the REPL's."""
        world = self.world
        world.port.stdin = "q" if key else ""
        if self._call(world.app.watch, None if key else 0.05):
            assert world.port.stdin == "", "the key stays in the line"

    def calibrating(self):
        """Its first step; then start() goes on."""
        world = self.world
        world.should_run = False

        def gyro():
            world.app.calibrating().gyro(0.1)

        self._call(gyro)

    def readers(self, count=2):
        """So many tasks read app.samples(); each gets three of them."""
        world = self.world
        app, aio = world.app, world.port.modules["asyncio"]
        if not app.running or world.now_s - world.checks.trouble_s < 1:
            return

        async def read():
            got = 0
            async for _ in app.samples():
                got += 1
                if got == 3:
                    return

        async def all_of_them():
            await aio.wait_for(aio.gather(*[read() for _ in range(count)]), 2)

        self._call(aio.run, all_of_them())

    def interrupt(self, ms, after):
        """Ctrl-C while nothing is asked: it goes to what is done after a tick."""
        self._call(self.world.port.run_ms, ms, how="Ctrl-C below", after=after)

    def other_device(self, ms):
        """Something else on the sensor's bus is talked to for a while."""
        world = self.world

        def talk():
            with world.app.bus:
                world.port.clock.hold(ms * 1000000)

        self._call(talk)
        world.checks.trouble(held=True)

    def read(self):
        """app.imu.read() beside the loop."""
        imu = self.world.app.imu
        if imu is not None:
            self._call(imu.read)

    def second_app(self):
        """Another App on the same sensor is refused, and the first one goes on."""
        world = self.world
        if not world.app.running:
            return
        other = type(world.app)()
        assert not self._call(other.start) and not other.running, "a second App has the sensor"

    def edit(self, what):
        """config.txt by hand, and a restart."""
        path = Path(self.world.folder, "config.txt")
        if path.exists():
            path.write_text(EDITS[what](path.read_text()))
        self.world.power_cycle(False)

    # ---- the user's own outputs

    def output(self, hard):
        """app.outputs.add() of one that does what it should."""
        world = self.world
        motor = Motor(world.port.clock, hard)
        world.motors.append(motor)
        world.made.append(motor)
        self._call(lambda: world.app.outputs.add(motor.update, motor.safe, hard=hard))

    def output_fails(self, error, safe=False):
        """The last one raises from now on, or does its work again; or its next safe() raises."""
        if self.world.motors:
            motor = self.world.motors[-1]
            kind = next((kind for kind in ERRORS if kind.__name__ == error), None)
            if safe:
                motor.fails_once = kind
            else:
                motor.fails = kind

    def take_away(self, all_of_them):
        """outputs.remove() of the last one, or outputs.clear()."""
        world = self.world
        if all_of_them:
            self._call(world.app.outputs.clear)
            world.cleared()
        elif world.motors:
            self._call(world.app.outputs.remove, world.motors[-1].update)
            assert not world.motors.pop().on

    # ---- applications

    def application(self, name):
        """Start one of firmware.apps."""
        world = self.world
        app = world.app
        module = importlib.import_module("firmware.apps." + name)
        ran = app.running
        if self._call(module.start, app) and not ran:
            world.should_run = True
        world.checks.changed()

    def arm(self, name):
        """Arm it, and let it drive."""
        app = self.world.app
        if not app.has(name):
            return
        controller = getattr(app, name)
        if name == "quad":
            controller.command(0)
        if self._call(controller.arm) and name == "quad":
            controller.command(300)

    def disarm(self, name):
        """The motors stop."""
        app = self.world.app
        if app.has(name):
            self._call(getattr(app, name).disarm)

    def command(self, throttle):
        """The pilot's wish."""
        app = self.world.app
        if app.has("quad"):
            self._call(app.quad.command, throttle)


@contextlib.contextmanager
def walking(board, folder, steps=()):
    """Steps on a board of their own, after a written walk: (name, parameters) pairs."""
    walk = Steps(board, folder)
    try:
        for name, parameters in steps:
            walk.do(name, **parameters)
        yield walk
    finally:
        walk.world.port.__exit__(None, None, None)


def replay(board, steps, folder):
    """Walk a written walk; then two and a half quiet seconds."""
    with walking(board, folder, steps) as walk:
        end = walk.world.checks.trouble_s + 2.5
        walk.do("wait", ms=max(0.0, 1000 * (end - walk.world.now_s)))

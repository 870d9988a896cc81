# SPDX-License-Identifier: MIT
"""What people and programs do beside a running loop, in any order: it goes on through all of it.

`python -m tools.loop --upsets 10` plays them on an emulated board for so many emulated seconds;
with `--drive data-ready` the sensor's INT line ticks, with `--versions 1.25.0` on an older board.
After each, every period since the one before must have had its tick, or the loop's own count of
lost ticks says how many are missing; only runaway recursion and a soft reset may cost any.
"""

import ast
import random
from typing import NamedTuple

from tools.loop.run import AGAIN, START, board_for
from tools.virtual.rp2040.board import PicoError

_HELPERS = """
import gc, micropython, os, time
def deep(n):
    return deep(n - 1) + 1 if n else 0
def runaway():
    return runaway()
class Thing:
    pass
@micropython.viper
def spin(n: int):
    while n:
        n -= 1
@micropython.native
def fill():
    try:
        for _ in range(9):
            micropython.schedule(id, 0)
    except RuntimeError:
        spin(200000)
"""
_FOREVER = "while True:\n    values = [0.5 * i for i in range(30)]"
_SOURCES = {
    "collection": "for n in range(3):\n    values = [n / 3] * 100\n    gc.collect()",
    "new globals": "for n in range(60):\n    globals()['name_SEED_%d' % n] = n",
    "growing object": "thing = Thing()\nfor n in range(60):\n    setattr(thing, 'name%d' % n, n)",
    "import": "with open('besideSEED.py', 'w') as f:\n"
    "    f.write('values = [n * 0.5 for n in range(50)]\\ndef f():\\n    return values\\n')\n"
    "import besideSEED\nbesideSEED.f()\nos.remove('besideSEED.py')",
    "file": "with open('log.txt', 'w') as f:\n"
    "    for n in range(40):\n        f.write('%d,%f\\n' % (n, n / 7))",
    "prints": "for n in range(60):\n    print(n, n / 7, 'some text of a program')",
    "deep calls": "for n in range(5):\n    deep(18)",
    "recursion": "for n in range(5):\n    try:\n        runaway()\n"
    "    except RuntimeError:\n        pass",
    "full queue": "fill()",
    "stuck": "spin(1000000)",
    "heap locked": "micropython.heap_lock()\nspin(200000)\nmicropython.heap_unlock()",
    "heap full": "kept = []\ntry:\n    while True:\n        kept.append(bytearray(4000))\n"
    "except MemoryError:\n    pass\ntry:\n    while True:\n        kept.append(bytearray(40))\n"
    "except MemoryError:\n    pass\nspin(200000)\nkept = None\ngc.collect()",
    "reads": "for n in range(20):\n    app.sample()\n    app.stats()\n    repr(app.config)",
    "sensor": "for n in range(20):\n    app.imu.read()",
}
COSTS = ("recursion", "soft reset")  # these may cost ticks, which are counted
UPSETS = (*_SOURCES, "ctrl-c", "soft reset")
_WEIGHTS = [1] * (len(UPSETS) - 1) + [0.2]  # a start from files takes a second and more


class Seen(NamedTuple):
    """After an upset: periods since the last look, the ticks in them, the loop's count of lost
    ones, exceptions of the tick."""

    upset: str
    expected: int
    ticks: int
    counted: int
    errors: int

    @property
    def lost(self):
        return self.expected - self.ticks


class Upsetting:
    """A board with a running loop, and what is done to it. MicroPython `version`, rate in Hz,
    drive: the knob."""

    def __init__(self, version="1.26.1", rate_hz=1000, drive="timer"):
        self.rate_hz = rate_hz
        self.version, self._drive = version, drive
        self.board, self.bus = board_for(version)
        self._begin()

    def __enter__(self):
        return self

    def __exit__(self, *exc_info):
        self.board.__exit__(*exc_info)

    def _begin(self):
        self.board.exec(f"{START}{_HELPERS}app.set('drive', {self._drive!r})", 30)
        self.board.exec(AGAIN % self.rate_hz, 10)
        self._last = self._look()

    def _look(self):
        source = "r = marks()\nprint(r, app.tick.words[20], app.loop.running)"
        marks, errors, running = self.board.exec(source, 10).rsplit(" ", 2)
        if running.strip() != "True":
            raise PicoError("the loop has stopped")
        return (*ast.literal_eval(marks), int(errors))

    def play(self, upset, chance):
        """Do it; what was Seen. PicoError where the board froze, the loop stopped, or what is done
        fails."""
        if upset == "soft reset":
            self.board.soft_reset()
            self._begin()
            return Seen(upset, 0, 0, 0, 0)
        if upset == "ctrl-c":
            try:
                self.board.exec(_FOREVER, 1, ctrl_c_ms=(chance.randint(1, 15),))
            except PicoError as error:
                if "KeyboardInterrupt" not in str(error) or "no answer" in str(error):
                    raise
        else:
            self.board.exec(_SOURCES[upset].replace("SEED", str(chance.randrange(10**6))), 30)
        before, self._last = self._last, self._look()
        now = self._last
        expected = round((now[0] - before[0]) % 2**30 * self.rate_hz / 1e6)
        return Seen(upset, expected, now[1] - before[1], now[2] - before[2], now[3] - before[3])


def faults(seen):
    """What an upset may not have done, in words."""
    out = [f"{seen.errors} exceptions in the tick"] if seen.errors else []
    if seen.lost != seen.counted:
        out.append(f"{seen.lost} ticks lost, {seen.counted} counted")
    if seen.lost and seen.upset not in COSTS:
        out.append(f"{seen.lost} ticks lost")
    return out


def at_random(
    seconds, seed=1, rate_hz=1000, version="1.26.1", drive="timer", say=lambda text: None
):
    """[Seen] of so many emulated seconds of upsets."""
    chance = random.Random(seed)
    found = []
    with Upsetting(version, rate_hz, drive) as rig:
        end = rig.board.nanos + seconds * 1e9
        while rig.board.nanos < end:
            found.append(rig.play(chance.choices(UPSETS, _WEIGHTS)[0], chance))
            for text in faults(found[-1]):
                say(f"{found[-1].upset}: {text}")
    return found


def table(found):
    """The figures as text: a line for each kind of upset."""
    lines = [f"{'upset':16}{'times':>6}{'ticks':>8}{'lost':>6}{'counted':>9}{'errors':>8}"]
    for upset in UPSETS:
        rows = [seen for seen in found if seen.upset == upset]
        names = ("ticks", "lost", "counted", "errors")
        sums = [sum(getattr(row, name) for row in rows) for name in names]
        lines.append("%-16s%6d%8d%6d%9d%8d" % (upset, len(rows), *sums))
    return "\n".join(lines)

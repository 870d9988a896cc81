# SPDX-License-Identifier: MIT
"""The walk as a state machine for hypothesis: which steps there are, with what parameters."""

import tempfile

from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, precondition, rule

from tools.walk.motor import ERRORS
from tools.walk.steps import EDITS, PLAIN_FAULTS, Steps
from tools.walk.world import BOARDS

_VALUES = {  # beside the edges of each knob's range
    "rate_hz": (80, 100, 250, 333, 500, 1000),
    "rest_s": (0.0, 0.1, 0.3),
    "failsafe_ms": (10, 60, 100, 500, 3000),
    "sensor_hz": (4, 50, 200, 500, 1000),
    "watchdog_ms": (0, 2000),
    "address": (0x68, 0x69),
    "self_test": (0, 1),
}
_BAD = (None, "", "fast", -1, 1e9, float("nan"), float("inf"), True, 2.5, (), -1e-9)
_how = st.sampled_from([None, None, None, None, "Ctrl-C", "Ctrl-C", "power cut"])
_after = st.integers(0, 40) | st.integers(0, 600)
_ms = st.sampled_from([5, 20, 60, 150, 300, 700])
_mostly = st.sampled_from([True, True, True, False])
robots = st.sampled_from(["balance", "quad"])


def _knobs():
    """(name, value) of any knob, good or bad."""
    from tools.virtual.port import install_micropython

    install_micropython()
    from firmware.config import KNOBS

    made = []
    for knob in KNOBS:
        if knob.name in _VALUES:
            good = _VALUES[knob.name]
        elif knob.choices:
            good = knob.choices
        else:
            good = (knob.low, knob.high, knob.default, (knob.default + knob.high) / 2)
            if isinstance(knob.default, int):
                good = tuple(int(value) for value in good)
        values = st.sampled_from(good + good + (knob.default,) + _BAD[:1])
        made.append(st.tuples(st.just(knob.name), values | st.sampled_from(good)))
    bad = st.tuples(st.sampled_from([*(k.name for k in KNOBS), "rate", ""]), st.sampled_from(_BAD))
    filters = st.tuples(
        st.just("filter"),
        st.sampled_from([c for k in KNOBS if k.name == "filter" for c in k.choices]),
    )
    return st.one_of(st.one_of(made), st.one_of(made), st.one_of(made), filters, bad)


class Walk(RuleBasedStateMachine):
    """Its `steps` are what was done so far, for replay()."""

    last = None  # the walk that was begun last

    def __init__(self):
        super().__init__()
        Walk.last = self
        self.steps = []
        self.walk = None
        self._folder = tempfile.TemporaryDirectory()

    def do(self, step, **parameters):
        """One step, written down."""
        self.steps.append((step, parameters))
        self.walk.do(step, **parameters)

    @initialize(board=st.sampled_from(list(BOARDS)), rest_s=st.sampled_from([0.1, 0.1, 0.1, 0.0]))
    def boot(self, board, rest_s):
        self.board = board
        self.walk = Steps(board, self._folder.name)
        self.do("set", knob="rest_s", value=rest_s)
        self.do("start")

    def teardown(self):
        if self.walk:
            self.walk.world.port.__exit__(None, None, None)
        self._folder.cleanup()

    # ---- time and motion

    @rule(ms=_ms)
    def wait(self, ms):
        self.do("wait", ms=ms)

    @rule()
    def settle(self):
        checks = self.walk.world.checks
        left = 1000 * (checks.trouble_s + 2.2 - self.walk.world.now_s)
        self.do("wait", ms=round(max(10, min(left, 4000))))

    @rule()
    def rest(self):
        self.do("move", kind="rest")

    @rule(rate_dps=st.sampled_from([-100, -30, 30, 60, 100]))
    def turn(self, rate_dps):
        self.do("move", kind="turn", rate_dps=rate_dps)

    @rule(
        axis=st.sampled_from(["roll", "pitch", "yaw"]), amplitude_deg=st.sampled_from([5, 20, 30])
    )
    def swing(self, axis, amplitude_deg):
        self.do("move", kind="swing", axis=axis, amplitude_deg=amplitude_deg, hz=0.4)

    @rule(axis=st.sampled_from(["roll", "pitch"]), angle_deg=st.sampled_from([-45, -20, 20, 45]))
    def tip(self, axis, angle_deg):
        self.do("move", kind="tip", axis=axis, angle_deg=angle_deg)

    @rule(amplitude_deg=st.sampled_from([10, 25]))
    def free(self, amplitude_deg):
        self.do("move", kind="free", amplitude_deg=amplitude_deg)

    @rule(ms=st.sampled_from([5, 30, 120, 300, 1200]), masked=st.booleans())
    def pause(self, ms, masked):
        self.do("pause", ms=ms, masked=masked)

    @rule(kind=st.sampled_from(sorted(PLAIN_FAULTS)), ms=st.sampled_from([3, 30, 120, 300, 1100]))
    def fault(self, kind, ms):
        self.do("fault", kind=kind, ms=max(ms, 30) if kind == "saturation" else ms)

    @rule(sensor_too=st.booleans(), main_py=_mostly)
    def power_cycle(self, sensor_too, main_py):
        self.do("power_cycle", sensor_too=sensor_too)
        if main_py:
            self.begin(main_py)

    # ---- the REPL

    @rule(how=_how, after=_after)
    def start(self, how, after):
        self.do("start", how=how, after=after)

    def begin(self, held_still):
        """Start, as a rule with the board held still."""
        if held_still:
            self.do("move", kind="rest")
            self.do("wait", ms=800)
        self.do("start")

    @precondition(lambda self: not self.walk.world.app.running)
    @rule(still=_mostly)
    def start_again(self, still):
        self.begin(still)

    @rule(start=_mostly)
    def stop(self, start):
        self.do("stop")
        if start:
            self.begin(start)

    @rule(pair=_knobs(), how=_how, after=_after, plainly=st.booleans())
    def set(self, pair, how, after, plainly):
        self.do("set", knob=pair[0], value=pair[1], how=how, after=after, plainly=plainly)

    @rule(pair=_knobs())
    def turn_a_knob(self, pair):
        self.do("set", knob=pair[0], value=pair[1])

    @rule(name=st.sampled_from(["save", "defaults", "undo", "zero_yaw"]))
    def verb(self, name):
        self.do("verb", name=name)

    @rule(name=st.sampled_from(["level_here", "self_test", "defaults", "undo"]), how=_how,
          after=_after)  # fmt: skip
    def long_verb(self, name, how, after):
        self.do("verb", name=name, how=how, after=after)

    @rule(ms=st.sampled_from([1, 25, 120]))
    def other_device(self, ms):
        self.do("other_device", ms=ms)

    @rule(ms=_ms, after=_after)
    def interrupt(self, ms, after):
        self.do("interrupt", ms=ms, after=after)

    @rule()
    def read(self):
        self.do("read")

    @rule()
    def second_app(self):
        self.do("second_app")

    @rule(what=st.sampled_from(sorted(EDITS)), main_py=_mostly)
    def edit(self, what, main_py):
        self.do("verb", name="save")
        self.do("edit", what=what)
        if main_py:
            self.begin(main_py)

    @rule(hard=st.booleans())
    def output(self, hard):
        self.do("output", hard=hard)

    @rule(error=st.sampled_from([kind.__name__ for kind in ERRORS] + ["none"] * 3), safe=_mostly)
    def output_fails(self, error, safe):
        self.do("output_fails", error=error, safe=not safe)

    @rule(all_of_them=st.booleans())
    def take_away(self, all_of_them):
        self.do("take_away", all_of_them=all_of_them)

    @rule(name=st.sampled_from(["stats", "show", "changed", "sample", "report", "help", "repr"]))
    def ask(self, name):
        self.do("ask", name=name)

    @rule(key=st.booleans())
    def watch(self, key):
        self.do("watch", key=key)

    @rule(start=_mostly)
    def calibrating(self, start):
        self.do("calibrating")
        if start:
            self.begin(start)

    @rule(count=st.integers(1, 3))
    def readers(self, count):
        self.do("readers", count=count)

    # ---- applications

    @rule(name=st.sampled_from(["balance", "quad", "platform"]))
    def application(self, name):
        self.do("application", name=name)

    @rule(name=robots)
    def arm(self, name):
        self.do("arm", name=name)

    @rule(name=robots)
    def drive(self, name):
        self.do("move", kind="rest")
        self.do("application", name=name)
        self.do("wait", ms=500)
        self.do("arm", name=name)
        self.do("wait", ms=1100 if name == "balance" else 50)

    @rule(name=robots)
    def disarm(self, name):
        self.do("disarm", name=name)

    @rule(throttle=st.sampled_from([0, 300, 600]))
    def command(self, throttle):
        self.do("command", throttle=throttle)

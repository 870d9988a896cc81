# SPDX-License-Identifier: MIT
"""A hundred random walks of a user and the world, the same ones each time; and that a broken
promise would be seen. More of them: python -m tools.walk --sequences 2000 --steps 30
"""

import pytest

from tools.walk.search import as_test, walked
from tools.walk.steps import walking

PARTS = 10  # files of tests are shared between the cores, tests of one are not: short ones first
REST = [("move", {"kind": "rest"}), ("wait", {"ms": 800}), ("start", {}), ("wait", {"ms": 500})]
FAULT = ("fault", {"kind": "brown_out", "ms": 300})
FLY = [("application", {"name": "quad"}), ("wait", {"ms": 500}), ("arm", {"name": "quad"})]


@pytest.mark.parametrize("part", range(PARTS))
def test_a_hundred_walks_of_thirty_steps_break_no_promise(part):
    found = walked(part, 100 // PARTS, 30)
    assert found is None, as_test(*found)


def test_a_walk_is_printed_with_all_that_plays_it_again():
    steps = [
        ("interrupt", {"ms": 100, "after": 0}),
        ("interrupt", {"ms": 100, "after": 7}),
        ("set", {"knob": "rate_hz", "value": None, "how": None, "after": 3, "plainly": False}),
        ("set", {"knob": "rate_hz", "value": 5, "how": "Ctrl-C", "after": 3, "plainly": False}),
        ("start", {"how": None, "after": 2}),
        ("move", {"kind": "rest", "rate_dps": None}),
    ]
    played = []
    space = {"replay": lambda board, steps, path: played.extend([board, *steps])}
    exec(as_test("soft", steps, "what broke"), space)
    space["test_NAME"](None)
    assert played == [
        "soft",
        ("interrupt", {"ms": 100, "after": 0}),
        ("interrupt", {"ms": 100, "after": 7}),
        ("set", {"knob": "rate_hz", "value": None, "plainly": False}),
        ("set", {"knob": "rate_hz", "value": 5, "how": "Ctrl-C", "after": 3, "plainly": False}),
        ("start", {}),
        ("move", {"kind": "rest"}),
    ]


# ---- what is broken on purpose is seen


def _module(name):
    return __import__(name, fromlist=["x"])


def _claims_all(patch, app):
    """Doubt is never told."""
    patch(type(app), "uncertain", property(lambda self: False))


def _leaks_yaw(patch, app):
    """Half of each turn is lost."""
    tick, publish = app.tick, app.tick.drive

    def drive(fresh):
        publish(fresh)
        tick.est[4] //= 2

    tick.drive = drive
    tick.words[19] = 1


def _tilts(patch, app):
    """The angle is four degrees off."""
    tick, publish = app.tick, app.tick.drive

    def drive(fresh):
        publish(fresh)
        tick.est[2] += 4000

    tick.drive = drive
    tick.words[19] = 1


def _never_safe(patch, app):
    """Nothing puts an output to its safe value."""
    patch(_module("firmware.tick.drive").Drive, "safe", lambda self: None)
    patch(_module("firmware.tick.drive").Drive, "_safe_one", lambda self, i: None)


def _turns_unarmed(patch, app):
    """A motor turns that nobody armed."""
    patch(_module("control").Escs, "safe", lambda self: [w(1500000) for w in self._writers])


def _raises_below(patch, app):
    """An exception in the foreground."""
    patch(_module("firmware.foreground").Foreground, "_look", lambda self, app: 1 // 0)


def _raises_at_the_repl(patch, app):
    """An exception that is no refusal."""
    patch(type(app), "changed", lambda self: {}["x"])


def _stops_silently(patch, app):
    """A loop that ends without a word."""
    patch(type(app), "zero_yaw", lambda self: self.loop.stop())


def _swallows_the_range(patch, app):
    """A knob that the chip never hears of."""
    patch(_module("firmware.settings"), "set_up", lambda imu, config: None)


def _swallows_a_setting(patch, app):
    """A knob that the filter never hears of."""
    patch(_module("firmware.wiring"), "prepare", lambda app, **what: None)


def _swallows_a_gain(patch, app):
    """A gain that the controller never hears of."""
    patch(type(app.outputs), "tune", lambda self, period_us: None)


def _never_mends(patch, app):
    """A fault is never mended."""
    patch(type(app.mend), "run", lambda self: None)


def _forgets_the_key(patch, app):
    """The key that ends watch() stays in the line."""
    patch(type(app.telemetry.console), "take", lambda self: None)


def _shares_the_sensor(patch, app):
    """A second App takes the sensor."""
    type(app)._running.clear()


SABOTAGE = [  # what is broken, steps before it, steps after it, the words of the promise
    (_tilts, REST, [("wait", {"ms": 100})], "tilt .* off, and claimed"),
    (_leaks_yaw, REST, [("move", {"kind": "turn", "rate_dps": 100}), ("wait", {"ms": 1500})],
     "yaw .* off, allowed"),
    (_claims_all, REST, [("move", {"kind": "swing", "axis": "roll", "amplitude_deg": 30,
                                   "hz": 0.4}), ("wait", {"ms": 2100}),
                         ("set", {"knob": "failsafe_ms", "value": 3000}),
                         ("fault", {"kind": "nack", "ms": 1100}), ("wait", {"ms": 1000})],
     "off, and claimed"),
    (_never_safe, [*REST, *FLY], [FAULT, ("wait", {"ms": 250})], "a motor is not fed for"),
    (_never_safe, [*REST, ("output", {"hard": True})], [FAULT, ("wait", {"ms": 250})],
     "an output is not fed for"),
    (_never_safe, [*REST, ("output", {"hard": False}), ("wait", {"ms": 50})],
     [("output_fails", {"error": "ValueError"}), ("wait", {"ms": 250})],
     "an output is not fed for"),
    (_turns_unarmed, REST, FLY, "a motor turns, and quad is not armed"),
    (_raises_below, REST, [("wait", {"ms": 500})], "ZeroDivisionError"),
    (_raises_at_the_repl, REST, [("ask", {"name": "changed"})], "'x'"),
    (_stops_silently, REST, [("verb", {"name": "zero_yaw"})], "nobody said so"),
    (_swallows_the_range, REST, [("set", {"knob": "gyro_dps", "value": 2000}),
                                 ("wait", {"ms": 2500})], "GYRO_CONFIG"),
    (_swallows_a_setting, REST, [("set", {"knob": "attitude_tau_s", "value": 5.0}),
                                 ("wait", {"ms": 2500})], "attitude_tau_s"),
    (_swallows_a_gain, [*REST, *FLY], [("set", {"knob": "quad_rate_p", "value": 2.0}),
                                       ("wait", {"ms": 2500})], "its gains"),
    (_never_mends, REST, [FAULT, ("wait", {"ms": 3000})], "after the last trouble"),
    (_forgets_the_key, REST, [("watch", {"key": True})], "the key stays in the line"),
    (_shares_the_sensor, REST, [("second_app", {})], "a second App has the sensor"),
]  # fmt: skip


@pytest.mark.parametrize("breaks, before, after, words", SABOTAGE,
                         ids=[row[0].__name__ for row in SABOTAGE])  # fmt: skip
def test_a_promise_that_is_broken_on_purpose_is_seen(breaks, before, after, words, tmp_path):
    with pytest.MonkeyPatch.context() as monkey, walking("hard", tmp_path, before) as walk:
        breaks(monkey.setattr, walk.world.app)
        with pytest.raises((AssertionError, KeyError, RuntimeError), match=words):
            for step, parameters in after:
                walk.do(step, **parameters)

# SPDX-License-Identifier: MIT
"""Outputs are always safe: whatever raises, stops, is changed or taken away.

On the RP2 with a soft tick, on the RP2 with a hard one, and on the ESP32.
"""

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.faults import make
from tools.virtual.motion import Still
from tools.walk.break_in import at_jump

boards = pytest.mark.parametrize("board", BOARDS)
kinds = pytest.mark.parametrize("hard", [False, True], ids=["soft output", "hard output"])
FAILSAFE_MS = 100
# places: firmware.tick.words
_AGE_US, _STALE_US, _AGAIN = 3, 5, 25


class Motor:
    """An output that tells what was done to it last."""

    def __init__(self):
        self.calls = []
        self.raises = None

    def update(self, app):
        if self.raises:
            raise self.raises
        self.calls.append("on")

    def safe(self):
        self.calls.append("safe")

    @property
    def on(self):
        return bool(self.calls) and self.calls[-1] == "on"


@pytest.fixture
def flying(tmp_path):
    """flying(board, hard, knobs...) -> (rig, motor) half a second after the start."""
    rigs = []

    def build(board, hard, motion=None, **knobs):
        rig = Rig(board, motion or Still(), tmp_path, **{"rest_s": 0.1, **knobs})
        rigs.append(rig)
        rig.__enter__()
        rig.app.start()
        motor = Motor()
        rig.app.outputs.add(motor.update, motor.safe, hard=hard)
        rig.port.run_ms(500)
        assert motor.on
        return rig, motor

    yield build
    for rig in rigs:
        rig.__exit__(None, None, None)


# ---- what ends in the safe value


@boards
@kinds
@pytest.mark.parametrize("error", [ValueError, MemoryError, AttributeError, IndexError])
def test_an_update_that_raises_is_safe_after_three_and_named_once(
    flying, board, hard, error, capsys
):
    rig, motor = flying(board, hard)
    motor.raises = error("in the update")
    rig.port.run_ms(40)
    assert motor.calls[-1] == "safe" and motor.calls.count("safe") == 1
    rig.port.run_ms(400)
    assert motor.calls.count("safe") == 1
    printed = capsys.readouterr().out
    assert printed.count("Motor.update") == 1 and error.__name__ in printed
    motor.raises = None
    rig.port.run_ms(40)
    assert motor.on  # it may steer again
    motor.raises = error("again")
    rig.port.run_ms(40)
    assert motor.calls[-1] == "safe" and "Motor.update" not in capsys.readouterr().out


@boards
@kinds
def test_fewer_failures_than_the_knob_says_are_forgiven(flying, board, hard):
    rig, motor = flying(board, hard, output_failures=50, failsafe_ms=300)
    motor.raises = ValueError("for a while")
    rig.port.run_ms(100)
    assert "safe" not in motor.calls
    motor.raises = None
    rig.port.run_ms(20)
    assert motor.on
    rig.app.set("output_failures", 1)
    motor.raises = ValueError("once")
    rig.port.run_ms(8)
    assert motor.calls[-1] == "safe"


@boards
@kinds
def test_no_number_of_failures_is_forgiven_for_longer_than_the_failsafe(flying, board, hard):
    rig, motor = flying(board, hard, output_failures=1000)
    motor.raises = ValueError("for ever")
    rig.port.run_ms(FAILSAFE_MS + 8)
    assert motor.calls[-1] == "safe" and motor.calls.count("safe") == 1
    motor.calls.clear()
    rig.app.set("failsafe_ms", 50)  # a smaller number of them, already exceeded
    rig.port.run_ms(100)
    assert motor.calls.count("safe") == 0
    motor.raises = None
    rig.port.run_ms(20)
    motor.raises = ValueError("again")
    rig.port.run_ms(20)
    rig.app.set("output_failures", 2)
    rig.port.run_ms(20)
    assert motor.calls[-1] == "safe"


@boards
@kinds
@pytest.mark.parametrize("how", ["stale", "stop", "clear", "remove", "self_test", "calibrating"])
def test_what_ends_the_estimate_makes_it_safe(flying, board, hard, how):
    rig, motor = flying(board, hard)
    app = rig.app
    if how == "stale":
        rig.bus.faults.append(make("nack", at_s=rig.port.now_ns / 1e9, for_s=0.5))
        rig.port.run_ms(FAILSAFE_MS + 20)
    elif how == "remove":
        app.outputs.remove(motor.update)
    elif how == "clear":
        app.outputs.clear()
    elif how == "self_test":
        seen = []
        motor.safe = lambda: seen.append("safe")  # the pause is over when it returns
        app.outputs.clear()
        app.outputs.add(motor.update, motor.safe, hard=hard)
        app.self_test()
        assert seen
        return
    else:
        getattr(app, how)()
    assert motor.calls[-1] == "safe" and motor.calls.count("safe") == 1
    if how != "stale":
        rig.port.run_ms(200)
        assert motor.calls[-1] == "safe"


@boards
def test_a_soft_output_whose_foreground_is_stuck_is_made_safe_by_a_hard_tick(flying, board):
    rig, motor = flying(board, False)
    rig.port.clock.hold(round(0.4e9))  # C code that does not return: no soft callback runs
    if board == "hard":
        assert motor.calls[-1] == "safe"
    rig.port.run_ms(50)
    assert motor.on  # it returned


@boards
def test_a_hard_output_is_driven_while_the_foreground_is_stuck(flying, board):
    rig, motor = flying(board, True)
    motor.calls.clear()
    rig.port.clock.hold(round(0.4e9))
    assert (len(motor.calls) >= 99) == (board == "hard")
    assert "safe" not in motor.calls[:-1]


@kinds
def test_a_safe_that_fails_in_the_tick_is_called_again_and_named(flying, hard, capsys):
    rig, motor = flying("hard", hard)
    tries = []

    def safe():
        tries.append(1)
        if len(tries) == 1:
            raise MemoryError("in the tick")
        motor.calls.append("safe")

    rig.app.outputs.clear()
    rig.app.outputs.add(motor.update, safe, hard=hard)
    tries.clear()
    rig.port.run_ms(20)
    rig.bus.faults.append(make("nack", at_s=rig.port.now_ns / 1e9, for_s=0.3))
    rig.port.run_ms(FAILSAFE_MS + 20)
    assert motor.calls[-1] == "safe" and len(tries) == 2


# ---- whatever comes in while they change


def changed(app, how, motor, other):
    """One of the ways to change the outputs, of which `motor` is one."""
    if how == "add":
        app.outputs.add(other.update, other.safe)
    elif how == "remove":
        app.outputs.remove(motor.update)
    elif how == "clear":
        app.outputs.clear()
    else:
        app.outputs.watch(lambda: None)


@boards
@pytest.mark.parametrize("how", ["add", "remove", "clear", "watch"])
def test_what_is_scheduled_in_the_middle_of_a_change_may_change_them_too(flying, board, how):
    rig, motor = flying(board, False)
    app, clock = rig.app, rig.port.clock
    for after in range(40):
        app.outputs.clear()
        first, second, third = Motor(), Motor(), Motor()

        def swaps(app, first=first, third=third):
            if app.outputs.has(first.update):
                app.outputs.remove(first.update)
                app.outputs.add(third.update, third.safe)

        for each in (first.update, motor.update):
            app.outputs.add(each)
        app.outputs.add(swaps)
        with at_jump(clock, after, lambda: app.outputs.run(0)):
            changed(app, how, motor, second)
        wanted = [each for each in (first, second, third, motor) if app.outputs.has(each.update)]
        for each in (first, second, third, motor):
            each.calls.clear()
        app.outputs.run(0)
        if not app.outputs.has(swaps) or first not in wanted:
            assert [each for each in (first, second, third, motor) if each.on] == wanted
        assert (second in wanted) == (how == "add")
        assert (motor in wanted) == (how not in ("remove", "clear"))


@boards
@kinds
@pytest.mark.parametrize("how", ["add", "remove", "clear", "watch"])
def test_a_safe_that_fails_in_the_middle_of_a_change_is_called_again(flying, board, hard, how):
    rig, _ = flying(board, hard)
    app, clock, words = rig.app, rig.port.clock, rig.app.tick.words
    for after in range(100):
        app.outputs.clear()
        one = Motor()
        failed = []

        def fragile(safe=one.safe, failed=failed):
            if failed == ["now"]:
                failed.append("did")
                raise MemoryError("in the tick")
            safe()

        def stale(failed=failed):
            """A tick with a stale estimate, in which safe() fails."""
            failed.append("now")
            age, words[_AGE_US] = words[_AGE_US], words[_STALE_US]
            app.tick.drive(0)
            words[_AGE_US] = age

        app.outputs.add(one.update, fragile, hard=hard)
        app.outputs.run(0)
        app.tick.drive(1)
        assert one.on
        with at_jump(clock, after, stale):
            changed(app, how, one, Motor())
        if not failed:
            assert after > 5  # past the change
            return
        if words[_AGAIN]:  # as the foreground would see after the next tick
            app.outputs.mend()
        assert one.calls[-1] == "safe"
    raise AssertionError("a change of more than 100 jumps")


@boards
def test_a_change_forgives_no_failure(flying, board):
    """Somebody who adds an output at each tick does not keep another one's failures from three."""
    rig, motor = flying(board, True)
    motor.raises = ValueError("always")
    for _ in range(6):
        rig.app.outputs.watch(None)
        rig.app.tick.drive(1)
    assert motor.calls[-1] == "safe" and motor.calls.count("safe") == 1 and rig.app.outputs.raising


# ---- knobs in flight


@boards
@kinds
@pytest.mark.parametrize(
    "name, value",
    [
        ("gyro_dps", 1000), ("accel_g", 4), ("dlpf_hz", 94), ("sensor_hz", 500), ("rate_hz", 500),
        ("burst", "blocking"), ("filter", "kalman2"), ("filter", "float.attitude"),
        ("attitude_tau_s", 5.0), ("failsafe_ms", 200), ("telemetry_hz", 10),
    ],
)  # fmt: skip
def test_a_knob_in_flight_neither_stops_nor_loses_an_output(flying, board, hard, name, value):
    rig, motor = flying(board, hard)
    motor.calls.clear()
    rig.app.set(name, value)
    rig.port.run_ms(100)
    assert "safe" not in motor.calls and motor.on
    assert rig.app.config.values()[name] == value
    assert not rig.app.stale


@boards
def test_controllers_are_told_the_period_whenever_it_changes(flying, board):
    rig, motor = flying(board, True)
    told = []
    rig.app.outputs.add(motor.update, motor.safe, hard=True, tune=told.append)
    assert told == [4000]
    rig.app.set("rate_hz", 1000)
    assert told[-1] == 1000
    rig.app.set("gyro_dps", 250)
    rig.app.set("rate_hz", 80)
    assert told[-1] == 12500


def test_a_soft_output_is_told_how_many_ticks_it_missed(flying):
    rig, _ = flying("hard", False)
    assert rig.app.outputs.late == 0
    rig.port.clock.hold(round(0.04e9))
    rig.port.run_ms(8)
    assert 8 <= rig.app.outputs.late <= 10
    assert rig.app.stats()["output_late"] == rig.app.outputs.late
    assert rig.app.stats()["lost"] == 0

# SPDX-License-Identifier: MIT
"""The shortest walks that broke a promise once (tools/walk), by what was wrong."""

import contextlib

import pytest

from tools.walk.break_in import ctrl_c
from tools.walk.steps import replay, walking
from tools.walk.world import BOARDS

boards = pytest.mark.parametrize("board", BOARDS)
REST = [("move", {"kind": "rest"}), ("wait", {"ms": 800}), ("start", {})]


@boards
def test_a_knob_set_between_calibrating_and_start_reaches_the_chip(board, tmp_path):
    steps = [("calibrating", {}), ("set", {"knob": "gyro_dps", "value": 2000}), ("start", {})]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("after", range(12))
def test_a_start_that_is_interrupted_leaves_the_sensor_to_who_has_it(board, after, tmp_path):
    again = ("start", {"how": "Ctrl-C", "after": after})
    replay(board, [*REST, again, ("second_app", {})], tmp_path)


@boards
@pytest.mark.parametrize("after", range(12))
def test_a_stop_that_is_interrupted_leaves_the_sensor_to_who_wants_it(board, after, tmp_path):
    with walking(board, tmp_path, REST) as walk:
        app = walk.world.app
        with contextlib.suppress(KeyboardInterrupt), ctrl_c(walk.world.port.clock, after):
            app.stop()
        other = type(app)()
        if app.running:
            assert type(app).current() is app
            with pytest.raises(OSError, match="has a running App"):
                other.start()
        else:
            assert type(app).current() is None
            other.start()
            assert type(app).current() is other


@boards
def test_a_soft_output_is_fed_between_the_lines_of_what_is_printed(board, tmp_path):
    output = [("output", {"hard": False}), ("read", {})]
    asked = [("ask", {"name": name}) for name in ("show", "help", "report")]
    replay(board, [*REST, *output, *asked], tmp_path)


@boards
@pytest.mark.parametrize("name", ["balance", "quad", "platform"])
def test_an_application_started_again_runs_again(board, name, tmp_path):
    steps = [*REST, ("application", {"name": name}), ("stop", {}), ("application", {"name": name})]
    with walking(board, tmp_path, steps) as walk:
        assert walk.world.app.running


@boards
@pytest.mark.parametrize("plainly", [False, True])
def test_an_address_where_nobody_answers_changes_nothing(board, plainly, tmp_path):
    steps = [*REST, ("set", {"knob": "address", "value": 0x69, "plainly": plainly})]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("verb", ["level_here", "self_test"])
def test_a_verb_that_cannot_go_on_says_that_the_loop_stands_still(board, verb, tmp_path):
    steps = [*REST, ("fault", {"kind": "brown_out", "ms": 1100}), ("verb", {"name": verb})]
    replay(board, steps, tmp_path)


@boards
def test_a_bias_that_nobody_measured_claims_nothing_in_motion(board, tmp_path):
    steps = [
        ("set", {"knob": "rest_s", "value": 0.0}),
        ("move", {"kind": "free", "amplitude_deg": 25}),
        ("start", {}),
        ("set", {"knob": "attitude_tau_s", "value": 20.0}),
        ("wait", {"ms": 4000}),
    ]
    replay(board, steps, tmp_path)


def test_what_nobody_measured_is_claimed_after_a_rest(tmp_path):
    with walking("hard", tmp_path) as walk:
        walk.do("set", knob="rest_s", value=0.0)
        walk.do("move", kind="free", amplitude_deg=25)
        walk.do("wait", ms=1000)
        walk.do("start")
        walk.do("wait", ms=1000)
        assert walk.world.app.uncertain
        walk.do("move", kind="rest")
        walk.do("wait", ms=7000)  # the filter wants some seconds of rest
        assert not walk.world.app.uncertain and not walk.world.app.stale


@boards
@pytest.mark.parametrize("ms", [30, 60, 120])
def test_a_rate_beyond_the_range_leaves_doubt(board, ms, tmp_path):
    with walking(board, tmp_path, REST) as walk:
        walk.do("wait", ms=500)
        walk.do("fault", kind="saturation", ms=ms)
        walk.do("wait", ms=ms + 60)
        assert walk.world.app.uncertain
        assert walk.world.app.yaw_doubt_deg > 0.4 * ms


@boards
@pytest.mark.parametrize("kind", ["arbitration", "nack", "unplugged"])
def test_a_long_outage_of_what_swings_leaves_its_yaw_in_doubt(board, kind, tmp_path):
    steps = [
        *REST,
        ("move", {"kind": "swing", "axis": "yaw", "amplitude_deg": 30, "hz": 0.4}),
        ("wait", {"ms": 2500}),
        ("fault", {"kind": kind, "ms": 1100}),
        ("wait", {"ms": 1600}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("ms", [120, 240, 300])
@pytest.mark.parametrize(
    "before, after", [(-100, "free"), (-100, "rest"), (-200, "rest"), (100, -60), (60, 100)]
)
def test_a_rate_that_changes_at_one_end_of_a_pause_leaves_its_yaw_in_doubt(
    board, ms, before, after, tmp_path
):
    """Soon after the start, when little else is allowed to be wrong."""
    then = {"free": {"kind": "free", "amplitude_deg": 10}, "rest": {"kind": "rest"}}
    steps = [
        *REST,
        ("wait", {"ms": 2200}),
        ("move", {"kind": "turn", "rate_dps": before}),
        ("wait", {"ms": 150}),
        ("move", then.get(after) or {"kind": "turn", "rate_dps": after}),
        ("pause", {"ms": ms, "masked": False}),
        ("wait", {"ms": 2170}),
    ]
    replay(board, steps, tmp_path)


STILL_FOR = {"while it turns": None, "5 ms later": 5, "0.3 s later": 300, "1 s later": 1000}


@boards
@pytest.mark.parametrize("when", STILL_FOR)
@pytest.mark.parametrize("per_axis", ["kalman2", "float.complementary", "float.kalman"])
def test_after_a_turn_the_tilt_of_one_axis_at_a_time_is_not_claimed_by_the_next_filter(
    board, per_axis, when, tmp_path
):
    ms = STILL_FOR[when]
    steps = [
        *REST,
        ("set", {"knob": "filter", "value": per_axis, "plainly": False}),
        ("move", {"kind": "swing", "axis": "roll", "amplitude_deg": 20, "hz": 0.4}),
        ("move", {"kind": "turn", "rate_dps": -100}),
        ("wait", {"ms": 2200}),
        *([("move", {"kind": "rest"}), ("wait", {"ms": ms})] if ms else []),
        ("set", {"knob": "filter", "value": "attitude", "plainly": False}),
        *[("wait", {"ms": 200})] * 15,
    ]
    with walking(board, tmp_path, steps) as walk:
        assert not walk.world.app.uncertain


@boards
def test_zero_yaw_ahead_of_a_pause_is_that_of_the_call(board, tmp_path):
    steps = [
        *REST,
        ("move", {"kind": "turn", "rate_dps": -100}),
        ("wait", {"ms": 2000}),
        ("verb", {"name": "zero_yaw"}),
        ("pause", {"ms": 300, "masked": True}),
        ("wait", {"ms": 500}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("knob", ["drive", "rate_hz"])
def test_a_pause_ahead_of_the_first_tick_is_a_gap(board, knob, tmp_path):
    value = {"drive": "data-ready", "rate_hz": 500}[knob]
    steps = [
        *REST,
        ("wait", {"ms": 1500}),
        ("set", {"knob": knob, "value": value}),
        ("move", {"kind": "turn", "rate_dps": -100}),
        ("pause", {"ms": 1200, "masked": True}),
        ("wait", {"ms": 500}),
    ]
    replay(board, steps, tmp_path)


@boards
def test_a_start_in_motion_with_a_stored_bias_claims_nothing_at_first(board, tmp_path):
    steps = [
        *REST,
        ("verb", {"name": "level_here"}),
        ("set", {"knob": "rest_s", "value": 0.0}),
        ("move", {"kind": "free", "amplitude_deg": 25}),
        ("wait", {"ms": 900}),
        ("start", {}),
        ("wait", {"ms": 700}),
        ("start", {}),
        ("wait", {"ms": 1000}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("name", ["attitude", "float.attitude"])
def test_a_rate_beyond_the_range_is_doubted_at_once(board, name, tmp_path):
    steps = [
        ("set", {"knob": "filter", "value": name}),
        *REST,
        ("wait", {"ms": 500}),
        ("fault", {"kind": "saturation", "ms": 120}),
        ("set", {"knob": "burst", "value": "blocking"}),
        ("wait", {"ms": 300}),
    ]
    replay(board, steps, tmp_path)


@boards
def test_a_long_failsafe_is_no_licence_to_claim_an_old_angle(board, tmp_path):
    steps = [
        ("set", {"knob": "failsafe_ms", "value": 3000}),
        *REST,
        ("move", {"kind": "swing", "axis": "roll", "amplitude_deg": 30, "hz": 0.4}),
        ("wait", {"ms": 2000}),
        ("fault", {"kind": "nack", "ms": 1100}),
        ("wait", {"ms": 1100}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("knob, value", [("burst", "split"), ("rate_hz", 500), ("gyro_dps", 1000)])
def test_the_bus_is_taken_ahead_of_the_first_tick_after_a_change(board, knob, value, tmp_path):
    """What bridges the gap is the rate of now, not that of the gap before."""
    steps = [
        *REST,
        ("other_device", {"ms": 25}),
        ("move", {"kind": "swing", "axis": "roll", "amplitude_deg": 30, "hz": 0.4}),
        ("wait", {"ms": 3000}),
        ("set", {"knob": knob, "value": value}),
        ("other_device", {"ms": 120}),
        ("wait", {"ms": 500}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("verb", ["self_test", "level_here", "defaults", "undo", "start"])
def test_ctrl_c_anywhere_in_a_verb_leaves_a_loop_that_runs_or_words(board, verb, tmp_path):
    steps = [*REST, ("set", {"knob": "gyro_dps", "value": 1000})]
    for after in (0, 1, 3, 8, 15, 25, 39, 60, 150, 300):
        if verb == "start":
            steps += [("start", {"how": "Ctrl-C", "after": after})]
        else:
            steps += [("verb", {"name": verb, "how": "Ctrl-C", "after": after})]
        steps += [("wait", {"ms": 60}), ("start", {})]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("then", ["start", "stop"])
@pytest.mark.parametrize("place", [0, 1, 2])
def test_no_timer_outlives_a_ctrl_c_in_the_end_of_its_loop(board, place, then, tmp_path):
    """Else the next loop has the ticks of two."""
    with walking(board, tmp_path, REST) as walk:
        app, port = walk.world.app, walk.world.port
        last = place == len(app.loop._sources)
        of, name = (app.loop._timing, "stop") if last else (app.loop._sources[place], "deinit")
        whole = getattr(of, name)

        def interrupted():
            setattr(of, name, whole)  # once
            raise KeyboardInterrupt

        setattr(of, name, interrupted)
        with pytest.raises(KeyboardInterrupt):
            app.paused(lambda imu: None) if then == "start" else app.stop()
        if then == "stop":
            app.stop()
            assert app.loop._sources == []
            app.start()
        assert app.running
        port.run_ms(100)
        before = app.stats()["ticks"]
        port.run_ms(400)
        assert app.stats()["ticks"] - before == pytest.approx(100, abs=1)
        assert app.stats()["skipped_calls"] == 0


@boards
@pytest.mark.parametrize("name", ["balance", "quad"])
def test_an_application_that_was_taken_away_is_not_armed_and_starts_again(board, name, tmp_path):
    steps = [*REST, ("application", {"name": name}), ("wait", {"ms": 500}),
             ("take_away", {"all_of_them": True})]  # fmt: skip
    with walking(board, tmp_path, steps) as walk:
        app = walk.world.app
        with pytest.raises(ValueError, match="not armed: %s was taken away" % name):
            getattr(app, name).arm()
        assert not app.has(name)
        for step, parameters in [("application", {"name": name}), ("wait", {"ms": 500}),
                                 ("arm", {"name": name}), ("wait", {"ms": 300})]:  # fmt: skip
            walk.do(step, **parameters)
        assert getattr(app, name).armed


@boards
def test_an_interrupted_start_leaves_an_app_that_takes_knobs(board, tmp_path):
    steps = [
        ("start", {"how": "Ctrl-C", "after": 2}),
        ("set", {"knob": "address", "value": 0x68}),
        ("set", {"knob": "dlpf_hz", "value": 94}),
        ("application", {"name": "platform"}),
        ("wait", {"ms": 100}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("name", ["sample", "report", "stats", "show", "changed", "help", "repr"])
def test_what_is_asked_before_the_start_is_answered_or_refused_in_words(board, name, tmp_path):
    steps = [("ask", {"name": name}), *REST, ("stop", {}), ("ask", {"name": name})]
    replay(board, steps, tmp_path)


@boards
def test_watch_and_samples_say_that_nothing_runs(board, tmp_path):
    with walking(board, tmp_path) as walk:
        for ask in (walk.world.app.watch, walk.world.app.samples, walk.world.app.stream.start):
            with pytest.raises(ValueError, match="does not run"):
                ask()


@boards
def test_the_watchdogs_knob_works_while_the_loop_runs_and_restarts_feed_it(board, tmp_path):
    with walking(board, tmp_path) as walk:
        for step, parameters in [
            *REST,
            ("set", {"knob": "watchdog_ms", "value": 2000}),
            ("set", {"knob": "rest_s", "value": 3.0}),
            ("start", {}),  # the rest alone takes longer than the watchdog waits
            ("wait", {"ms": 2500}),
        ]:
            walk.do(step, **parameters)
        port = walk.world.port
        assert port.watchdog.timeout_ms == 2000 and walk.world.app.running
        walk.do("set", knob="watchdog_ms", value=0)
        walk.do("ask", name="show")
        assert "stays at 2000 ms until a reset" in walk.world.said
        walk.do("wait", ms=5000)
        assert walk.world.app.running  # and is fed
        walk.do("stop")
        board_before = walk.world.port
        walk.do("wait", ms=2100)  # nobody feeds it any more: the board begins anew
        assert walk.world.port is not board_before


@boards
@pytest.mark.parametrize("hard", [False, True])
@pytest.mark.parametrize("all_of_them", [False, True])
def test_a_safe_that_raises_once_is_called_again_when_taken_away(
    board, hard, all_of_them, tmp_path
):
    steps = [*REST, ("output", {"hard": hard}), ("wait", {"ms": 50}),
             ("output_fails", {"error": "IndexError", "safe": True}),
             ("take_away", {"all_of_them": all_of_them})]  # fmt: skip
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("knob, value", [
    ("sensor_hz", 200), ("rate_hz", 500), ("dlpf_hz", 94), ("filter", "float.attitude"),
    ("failsafe_ms", 200),
])  # fmt: skip
@pytest.mark.parametrize("runs", [False, True])
def test_ctrl_c_anywhere_in_set_leaves_the_knob_as_it_was(board, knob, value, runs, tmp_path):
    steps = list(REST) if runs else []
    for after in (0, 2, 5, 10, 15, 20, 26, 30, 40, 60, 90):
        steps += [("set", {"knob": knob, "value": value, "how": "Ctrl-C", "after": after}),
                  ("wait", {"ms": 20}), ("verb", {"name": "defaults"})]  # fmt: skip
    replay(board, steps, tmp_path)


@boards
def test_a_tilt_that_a_rest_has_shown_is_not_turned_by_the_first_look(board, tmp_path):
    free, rest = ("move", {"kind": "free", "amplitude_deg": 10}), ("move", {"kind": "rest"})
    held = ("other_device", {"ms": 120})
    start = [("set", {"knob": "rest_s", "value": 0.1}), ("start", {})]
    moves = [("other_device", {"ms": 1}), free, free, held, held, rest, ("wait", {"ms": 1600})]
    steps = [*start, *moves, free, rest, ("wait", {"ms": 1600}), rest, ("wait", {"ms": 1600})]
    replay(board, steps, tmp_path)


@boards
def test_nothing_is_asked_where_the_first_rest_was_a_steady_turn(board, tmp_path):
    """Neither sensor tells it from a bias; what is known of one by then would."""
    steps = [
        ("set", {"knob": "rest_s", "value": 0.0}),
        ("start", {}),
        ("move", {"kind": "turn", "rate_dps": -30}),
        ("wait", {"ms": 2200}),
        ("read", {}),
        ("wait", {"ms": 2200}),
    ]
    replay(board, steps, tmp_path)


@boards
def test_show_is_whole_where_something_is_said_between_its_lines(board, tmp_path):
    steps = [
        *REST,
        ("output", {"hard": False}),
        ("output_fails", {"error": "ValueError", "safe": False}),
        ("ask", {"name": "show"}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("ms", [30, 120, 300])
def test_a_pause_after_a_restart_is_not_bridged_with_the_rate_before_it(board, ms, tmp_path):
    steps = [
        *REST,
        ("move", {"kind": "free", "amplitude_deg": 25}),
        ("wait", {"ms": 2200}),
        ("stop", {}),
        ("move", {"kind": "rest"}),
        ("wait", {"ms": 900}),
        ("start", {}),
        ("pause", {"ms": ms}),
        ("wait", {"ms": 300}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("kind, ms", [("timeout", 120), ("int_dead", 1100), ("nack", 300)])
def test_the_guard_of_the_edges_and_they_never_tick_at_once(board, kind, ms, tmp_path):
    steps = [
        *REST,
        ("set", {"knob": "rate_hz", "value": 1000}),
        ("set", {"knob": "drive", "value": "data-ready"}),
        ("wait", {"ms": 100}),
        ("fault", {"kind": kind, "ms": ms}),
        ("set", {"knob": "dlpf_hz", "value": 94}),
        ("other_device", {"ms": 25}),
        ("wait", {"ms": 300}),
    ]
    replay(board, steps, tmp_path)


@boards
@pytest.mark.parametrize("kind", ["brown_out", "nack", "unplugged", "int_dead"])
def test_ctrl_c_in_what_is_done_after_a_tick_harms_nothing(board, kind, tmp_path):
    steps = [*REST, ("application", {"name": "quad"}), ("output", {"hard": False})]
    for after in (0, 1, 2, 3, 5, 8, 13, 20, 30, 45, 70):
        steps += [("fault", {"kind": kind, "ms": 120}), ("interrupt", {"ms": 150, "after": after})]
    replay(board, steps, tmp_path)


@boards
def test_ctrl_c_while_a_value_is_refused_leaves_it_refused(board, tmp_path):
    steps = list(REST)
    for after in range(0, 64, 3):
        for knob, value in (("pin_out_3", 63), ("rate_hz", 7)):
            steps.append(("set", {"knob": knob, "value": value, "how": "Ctrl-C", "after": after}))
    replay(board, steps, tmp_path)


SATURATED = [
    [("fault", {"kind": "saturation", "ms": 120})],
    [("wait", {"ms": 500}), ("fault", {"kind": "saturation", "ms": 120})],
    [("wait", {"ms": 500}), ("fault", {"kind": "saturation", "ms": 60}),
     ("fault", {"kind": "nack", "ms": 120})],
    [("wait", {"ms": 500}), ("other_device", {"ms": 1}),
     ("fault", {"kind": "saturation", "ms": 300})],
]  # fmt: skip
MEANWHILE = [
    [],
    [("application", {"name": "quad"})],
    [("application", {"name": "balance"})],
    [("set", {"knob": "gyro_dps", "value": 2000})],
    [("set", {"knob": "accel_g", "value": 2})],
    [("set", {"knob": "dlpf_hz", "value": 184})],
    [("set", {"knob": "rate_hz", "value": 1000})],
    [("set", {"knob": "filter", "value": "float.attitude"})],
    [("verb", {"name": "zero_yaw"})],
]


@boards
@pytest.mark.parametrize("already", [[], [("application", {"name": "quad"})]])
@pytest.mark.parametrize("meanwhile", MEANWHILE)
@pytest.mark.parametrize("saturated", SATURATED)
def test_a_rate_beyond_the_range_is_no_claim_whatever_is_changed(
    board, already, meanwhile, saturated, tmp_path
):
    """With the quadcopter's long time constant too, which would keep a wrong tilt for minutes."""
    steps = [*REST, *already, *saturated, *meanwhile, ("wait", {"ms": 1500})]
    with walking(board, tmp_path, steps) as walk:
        walk.do("wait", ms=2000)
        assert walk.world.checks.tilt_error(walk.world.app.sample()) < 1


@boards
@pytest.mark.parametrize("ms", [60, 120])
@pytest.mark.parametrize("rate_dps", [-100, 60])
@pytest.mark.parametrize("after", [0, 150, 300])
def test_yaw_over_an_outage_while_a_turn_begins_or_ends(board, after, rate_dps, ms, tmp_path):
    turn = [("move", {"kind": "turn", "rate_dps": rate_dps}), ("wait", {"ms": 300 + after})]
    end = [("move", {"kind": "rest"}), ("wait", {"ms": 300 + after})]
    out = [("other_device", {"ms": ms}), ("wait", {"ms": 30})]
    replay(board, [*REST, ("wait", {"ms": 300}), *turn, *out, *end, *out], tmp_path)


@boards
@pytest.mark.parametrize("rate_dps", [60, 100, -100])
def test_a_turn_faster_than_any_bias_is_never_one(board, rate_dps, tmp_path):
    """Nothing is known of the gyro, and it turns steadily for long: a rest to both sensors."""
    with walking(board, tmp_path) as walk:
        walk.do("move", kind="turn", rate_dps=rate_dps)
        walk.do("wait", ms=1500)
        walk.do("set", knob="rest_s", value=0.1)
        walk.do("start")
        walk.do("wait", ms=9000)
        assert walk.world.app.learning.known == 0 and walk.world.app.uncertain
        assert max(map(abs, walk.world.app.calibration.gyro_bias_dps)) < 40


@boards
def test_the_same_wires_are_one_sensor_by_whatever_number(board, tmp_path):
    steps = [*REST, ("set", {"knob": "bus", "value": 1}), ("second_app", {})]
    replay(board, steps, tmp_path)


def test_a_wire_is_one_apps_alone(tmp_path):
    with walking("esp32", tmp_path, REST) as walk:
        other = type(walk.world.app)()
        other.set("bus", 1)
        for sda, scl in ((21, 23), (18, 22), (22, 18), (22, 21)):
            other.set("pin_sda", sda)
            other.set("pin_scl", scl)
            with pytest.raises(OSError, match="SDA GP21, SCL GP22 for a running App"):
                other.start()


@boards
@pytest.mark.parametrize(
    "lost",
    [
        [],
        [("application", {"name": "quad"})],
        [("set", {"knob": "burst", "value": "blocking"})],
        [("fault", {"kind": "nack", "ms": 30}), ("wait", {"ms": 10})],
        [("other_device", {"ms": 25})],
        [("other_device", {"ms": 120})],
    ],
)
@pytest.mark.parametrize("then", ["read", "pause", "busy"])
def test_zero_yaw_while_there_is_no_sample(board, lost, then, tmp_path):
    """What is predicted until the next one begins at 0 too."""
    steps = [*REST, ("move", {"kind": "free", "amplitude_deg": 10}), ("wait", {"ms": 2200})]
    after = {"read": ("read", {}), "pause": ("pause", {"ms": 5, "masked": False}),
             "busy": ("other_device", {"ms": 25})}  # fmt: skip
    replay(board, [*steps, *lost, ("verb", {"name": "zero_yaw"}), after[then]], tmp_path)


@boards
@pytest.mark.parametrize("learned", [True, False])
@pytest.mark.parametrize("tau_s", [[20.0], [0.1, 60.0], [5.0, 20.0, 1.8]])
def test_a_time_constant_changes_no_angle(board, tau_s, learned, tmp_path):
    """In motion with an acceleration, after a rest that told the gyro's bias and without one."""
    with walking(board, tmp_path, REST) as walk:
        walk.do("wait", ms=4000 if learned else 10)
        walk.do("move", kind="free", amplitude_deg=10)
        walk.do("wait", ms=2500)
        for value in tau_s:
            before = walk.world.checks.tilt_error(walk.world.app.sample())
            walk.do("set", knob="attitude_tau_s", value=value)
            walk.do("wait", ms=12)
            assert walk.world.checks.tilt_error(walk.world.app.sample()) < before + 0.3


ENDS = [("start", {}), ("stop", {})]
ENDS += [("verb", {"name": name}) for name in ("self_test", "level_here")]


@boards
@pytest.mark.parametrize("name, knobs", ENDS, ids=[str(end) for end in ENDS])
@pytest.mark.parametrize("application", ["quad", "balance"])
def test_ctrl_c_where_the_loop_ends_leaves_no_motor_on(board, name, knobs, application, tmp_path):
    """At each of the first jumps of what stops it."""
    arm = [("application", {"name": application}), ("wait", {"ms": 500})]
    arm += [("arm", {"name": application}), ("wait", {"ms": 50})]
    steps = list(REST)
    for after in range(14):
        steps += [*arm, (name, {**knobs, "how": "Ctrl-C", "after": after}), ("wait", {"ms": 300})]
        steps += [("start", {}), ("wait", {"ms": 100})]
    replay(board, steps, tmp_path)

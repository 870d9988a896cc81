# SPDX-License-Identifier: MIT
"""Knobs that tell the truth: changed in motion, refused in words, saved so that the next boot
starts; and robots that stand whatever they are."""

import tempfile
from math import atan2, degrees

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from host_tests.firmware.test_gaps import BOARDS, Rig, Turn
from tools.plants.settings import check, jobs
from tools.virtual.motion import Still
from tools.virtual.port import install_micropython

boards = pytest.mark.parametrize("board", BOARDS)
FILTER_KNOBS = [
    (name, value)
    for value in (0.5, 1.0)
    for name, value in (
        ("attitude_tau_s", 3 * value), ("attitude_rest_tau_s", value),
        ("attitude_bias_tau_s", 60 * value), ("attitude_tau_s", 2 * value),
        ("attitude_rest_tau_s", 0.7 * value), ("attitude_bias_tau_s", 40 * value),
    )
]  # fmt: skip


def yaw_off(rig):
    """Error of the yaw at the instant of the last tick, degrees."""
    at_s = rig.port.now_ns / 1e9 - rig.app.loop.since_us() / 1e6
    w, x, y, z = rig.chip.truth(at_s)
    true = degrees(atan2(2 * (x * y + w * z), w * w + x * x - y * y - z * z))
    return (rig.app.yaw_deg - true + 180) % 360 - 180


@boards
def test_twelve_filter_knobs_in_a_fast_turn_lose_no_tick_and_no_yaw(board, tmp_path):
    with Rig(board, Turn(200.0), tmp_path) as rig:
        rig.app.start()
        rig.until(5.5)
        before, lost = yaw_off(rig), rig.app.stats()["lost"]
        assert len(FILTER_KNOBS) == 12
        for name, value in FILTER_KNOBS:
            rig.app.set(name, value)
            rig.port.run_ms(30)
            off = abs(yaw_off(rig) - before)
            print("%-20s %.3f deg of yaw" % (name, off))
            assert off < 0.1, name
        print("%d ticks lost" % (rig.app.stats()["lost"] - lost))
        assert rig.app.stats()["lost"] == lost
        assert rig.claimed


@boards
@pytest.mark.parametrize("knobs", [
    {"gyro_dps": 1000, "accel_g": 4, "dlpf_hz": 94},
    {"sensor_hz": 500, "rate_hz": 500, "burst": "blocking"},
    {"gyro_dps": 250, "dlpf_hz": 184, "rate_hz": 100},
], ids=str)  # fmt: skip
def test_set_up_knobs_in_a_turn_cost_100_ms_and_half_a_degree_each(board, knobs, tmp_path):
    with Rig(board, Turn(100.0), tmp_path) as rig:
        rig.app.start()
        rig.until(6.0)
        for name, value in knobs.items():
            before, began = yaw_off(rig), rig.port.now_ns
            rig.app.set(name, value)
            while not rig.app.fresh:
                rig.port.run_ms(2)
            took_ms = (rig.port.now_ns - began) / 1e6
            rig.port.run_ms(50)
            off = abs(yaw_off(rig) - before)
            print("%-10s %.1f ms, %.3f deg of yaw" % (name, took_ms, off))
            assert took_ms < 100 and off < 0.5, name
            assert max(abs(rig.app.roll_deg), abs(rig.app.pitch_deg)) < 0.5
            assert not rig.app.stale


@boards
def test_a_filter_there_and_back_keeps_tilt_yaw_and_bias(board, tmp_path):
    with Rig(board, Turn(60.0), tmp_path, rest_s=0.0) as rig:
        rig.app.start()
        rig.until(6.0)  # it has learned its bias at rest, and turned
        before, bias = yaw_off(rig), rig.app.filter.bias_dps
        assert bias == pytest.approx((2.0, -1.5, 1.0), abs=0.3)
        for name in ("float.attitude", "attitude"):
            rig.app.set("filter", name)
            rig.port.run_ms(100)
            off, tilt = abs(yaw_off(rig) - before), max(abs(rig.app.roll_deg),
                                                        abs(rig.app.pitch_deg))  # fmt: skip
            print("%s: %.3f deg of yaw, %.3f of tilt, bias %s"
                  % (name, off, tilt, rig.app.filter.bias_dps))  # fmt: skip
            assert off < 0.5 and tilt < 0.5
            assert rig.app.filter.bias_dps == pytest.approx(bias, abs=0.05)


@boards
@pytest.mark.parametrize("name", ["attitude", "kalman2", "float.attitude", "float.kalman"])
def test_a_setting_written_to_the_filter_is_refused_in_words(board, name, tmp_path):
    with Rig(board, Still(), tmp_path, filter=name) as rig:
        rig.app.start()
        for setting in ("tau_s", "q_angle", "r_mesure"):
            with pytest.raises(AttributeError, match=setting + r".*app\.set\(\)"):
                setattr(rig.app.filter, setting, 3.0)
            assert not hasattr(rig.app.filter, setting)
        rig.app.filter.period_us = rig.app.period_us + 1  # what there is may be written
        rig.port.run_ms(50)
        assert rig.claimed


def test_the_configuration_is_written_like_set_and_errors_name_what_is_meant(tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        app = rig.app
        app.start()
        app.config.rate_hz = 500
        assert app.loop.period_us == 2000 and app.changed()["rate_hz"] == 500
        with pytest.raises(ValueError, match="a whole number, 80 to 1000 Hz"):
            app.config.rate_hz = 333.3
        for wrong, meant in (
            ("rate", "rate_hz"),
            ("gyro_range", "gyro_dps"),
            ("kalman_measure", "kalman_r_measure"),
        ):
            with pytest.raises(ValueError, match="did you mean .*" + meant):
                app.set(wrong, 1)
            with pytest.raises(AttributeError, match="did you mean .*" + meant):
                setattr(app.config, wrong, 1)


def test_a_file_that_was_edited_by_hand_is_taken_line_by_line(tmp_path, capsys):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.set("rate_hz", 200)
        rig.app.save()
        path = tmp_path / "config.txt"
        text = path.read_text().replace("rate_hz = 200", "rate_hz = 400")
        path.write_text(text.replace("gyro_dps = 500", "gyro_dps = 501"))
        app = type(rig.app)()
        assert app.config.rate_hz == 400 and app.config.gyro_dps == 500
        app.start()
        said = capsys.readouterr().out
        assert "edited by hand" in said and "gyro_dps = 501" in said
        app.stop()


EDITS = {  # by hand: the text before -> after
    "ends of lines": lambda text: text.replace("\n", "\r\n"),
    "a mark of the encoding": lambda text: "\ufeff" + text,
    "no end of the last line": lambda text: text.rstrip("\n"),
    "no blanks": lambda text: text.replace(" = ", "="),
    "many blanks": lambda text: text.replace(" = ", "\t =  ").replace("\n", "  \n"),
    "blank lines": lambda text: text.replace("\n", "\n\n"),
    "a comment": lambda text: text.replace("rest_s", "# höher: später\nrest_s"),
    "a line of rubbish": lambda text: text.replace("rest_s", "rubbish here\nrest_s"),
    "a name that is none": lambda text: text.replace("rest_s", "rat_hz = 7\nrest_s"),
}


@pytest.mark.parametrize("edit", EDITS)
def test_a_file_that_an_editor_wrote_otherwise_is_taken(edit, tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.set("rate_hz", 200)
        rig.app.set("gyro_dps", 1000)
        rig.app.save()
        path = tmp_path / "config.txt"
        text = path.read_text().replace("rate_hz = 200", "rate_hz = 400")
        path.write_bytes(EDITS[edit](text).encode())
        app = type(rig.app)()
        assert app.config.rate_hz == 400 and app.config.gyro_dps == 1000, app.warnings
        assert "edited by hand" in app.warnings[0]
        if "rubbish" in edit:
            assert any("no knob rubbish here" in text for text in app.warnings)
        if "none" in edit:
            assert any("no knob rat_hz: did you mean rate_hz?" in text for text in app.warnings)
        app.save()
        assert type(rig.app)().warnings == []


def test_a_file_that_was_cut_is_no_edit(tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.set("rate_hz", 200)
        rig.app.save()
        path = tmp_path / "config.txt"
        text = path.read_text()
        for at in range(0, len(text) - 13, 7):
            path.write_text(text[:at])
            app = type(rig.app)()
            assert app.config.changed() == {} and "defaults used" in str(app.warnings)


def test_what_an_app_is_and_can_is_told(tmp_path, capsys):
    with Rig("hard", Still(), tmp_path) as rig:
        assert "not started" in repr(rig.app)
        rig.app.start()
        assert repr(rig.app) == "<App, attitude at 250 Hz, hard tick; app.help()>"
        rig.app.help()
        said = capsys.readouterr().out
        for verb in ("set(", "save()", "undo()", "defaults()", "zero_yaw()", "level_here()"):
            assert verb in said
        rig.app.stop()
        assert "stopped" in repr(rig.app)


@boards
def test_readers_outlive_a_restart_and_do_not_starve_each_other(board, tmp_path):
    with Rig(board, Still(), tmp_path, rest_s=0.1) as rig:
        rig.app.start()
        aio = rig.port.modules["asyncio"]
        got = [0, 0, 0]

        async def read(i):
            async for app in rig.app.samples():
                assert app is rig.app
                got[i] += 1

        async def main():
            tasks = [aio.create_task(read(i)) for i in range(3)]
            await aio.sleep_ms(200)
            first = list(got)
            rig.app.stop()
            rig.app.start()
            rig.app.set("rate_hz", 500)
            await aio.sleep_ms(200)
            for task in tasks:
                task.cancel()
            return first

        first = aio.run(main())
        assert min(first) > 40
        assert min(n - f for n, f in zip(got, first, strict=True)) > 80


def test_the_key_that_ends_watch_is_eaten(tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.start()
        rig.port.stdin = "qapp"
        rig.app.watch()
        assert rig.port.stdin == "app"


# ---- a saved file can never stop the next boot


def _knobs():
    install_micropython()
    from firmware.config import KNOBS

    made = {}
    for knob in KNOBS:
        if knob.choices:
            made[knob.name] = st.sampled_from(knob.choices)
        elif isinstance(knob.default, float):
            made[knob.name] = st.floats(knob.low, knob.high, allow_nan=False)
        else:
            made[knob.name] = st.integers(knob.low, knob.high)
    # nobody there; nobody feeds it between the boots
    for name in ("address", "bus", "pin_sda", "pin_scl", "pin_int", "watchdog_ms"):
        del made[name]
    made["rest_s"] = st.floats(0.0, 0.5)
    edges = {k.name: st.sampled_from((k.low, k.high)) for k in KNOBS
             if not k.choices and k.name in made and k.name != "rest_s"}  # fmt: skip
    pairs = [st.tuples(st.just(name), values) for name, values in (*made.items(), *edges.items())]
    return st.lists(st.one_of(pairs), min_size=1, max_size=12)


@settings(max_examples=60, deadline=None, derandomize=True, database=None,
          suppress_health_check=list(HealthCheck))  # fmt: skip
@given(changes=_knobs(), board=st.sampled_from(list(BOARDS)))
def test_whatever_set_takes_and_save_writes_starts_the_next_time(changes, board):
    with tempfile.TemporaryDirectory() as folder:
        with Rig(board, Still(), folder) as rig:
            for name, value in changes:
                try:
                    rig.app.set(name, value)
                except ValueError:
                    pass
            try:
                rig.app.save()
            except ValueError as error:
                assert "is to be two things" in str(error)  # an output on a pin that is taken
                return
            saved = rig.app.config.values()
        with Rig(board, Still(), folder) as rig:
            assert rig.app.config.values() == saved
            assert rig.app.warnings == []
            rig.app.start()
            rig.port.run_ms(600)
            assert rig.app.running and not rig.app.stale


# ---- robots (all of them: python -m tools.plants.settings)


@pytest.mark.parametrize("job", jobs(101), ids=str)
def test_robots_stand_and_step_whatever_the_range_the_rate_the_low_pass_and_the_mounting(job):
    good, value, ratio, _ = check(job)
    print("%.2f degrees, to the straight one %.3f" % (value, ratio))
    assert good

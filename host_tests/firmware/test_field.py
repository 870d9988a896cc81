# SPDX-License-Identifier: MIT
"""What users ran into, and what is right instead: files on the flash, the object `imu`, changes of
the filter, directions and turns. More of it: test_outputs, test_arming, test_knobs, test_walked.
"""

import binascii
from math import cos, radians, sin

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig, Turn
from tools.virtual.motion import Still

boards = pytest.mark.parametrize("board", BOARDS)


def stored(path, kind, **values):
    """A whole file as firmware.store writes it, whatever is in it."""
    lines = ["%s = %s" % (name, value) for name, value in sorted(values.items())]
    body = "\n".join(["plumb %s version 1 generation 7" % kind, *lines]) + "\n"
    path.write_text(body + "crc %08x\n" % binascii.crc32(body.encode()))


# ---- a file that is whole never stops the next boot, whatever it says


@boards
@pytest.mark.parametrize("knobs, told", [
    ({"rate_hz": 80, "kalman_q_bias": 10.0, "filter": "kalman2"}, "q_bias"),
    ({"dlpf_hz": 260, "sensor_hz": 20}, "sensor_hz"),
    ({"drive": "data-ready", "rate_hz": 700}, "700"),
    ({"rate_hz": 10**6}, "rate_hz"),
    ({"gyro_dps": "fast"}, "gyro_dps"),
    ({"no_such_knob": 1}, "no_such_knob"),
    ({"rest_s": "0.1 0.2"}, "rest_s"),
], ids=str)  # fmt: skip
def test_knobs_on_the_flash_that_do_not_go_together_are_named_and_it_starts(
    board, knobs, told, tmp_path, capsys
):
    stored(tmp_path / "config.txt", "config", **knobs)
    with Rig(board, Still(), tmp_path) as rig:
        rig.app.start()
        rig.port.run_ms(300)
        assert rig.claimed
        if rig.app.config.changed() != knobs:
            assert told and told in capsys.readouterr().out


@boards
@pytest.mark.parametrize("field, value", [
    ("gyro_bias_dps", "1e9 0 0"), ("accel_bias_g", "0 0 40"), ("mounting", "9 9 9 9 9 9 9 9 9"),
    ("gyro_matrix", "1 0 0 0 1 0 0 0 900"), ("accel_matrix", "1 0"), ("temp_c", "nan"),
])  # fmt: skip
def test_a_calibration_that_is_out_of_all_range_is_not_used_and_it_starts(
    board, field, value, tmp_path
):
    from host_tests.firmware.test_gaps import Rig as rigs
    from tools.virtual.port import install_micropython

    install_micropython()
    stored(tmp_path / "calibration.txt", "calibration", who_am_i=0x68, **{field: value})
    with rigs(board, Still(), tmp_path) as rig:
        rig.app.start()
        rig.port.run_ms(300)
        assert rig.claimed
        assert abs(rig.app.roll_deg) < 1.0 and abs(rig.app.pitch_deg) < 1.0


# ---- one object


@boards
@pytest.mark.parametrize("knob, value", [
    ("gyro_dps", 2000), ("accel_g", 2), ("dlpf_hz", 94), ("sensor_hz", 500), ("rate_hz", 500),
    ("burst", "blocking"), ("filter", "float.attitude"), ("drive", "data-ready"),
])  # fmt: skip
def test_imu_stays_the_same_object_and_lives(board, knob, value, tmp_path):
    with Rig(board, Still(), tmp_path, rest_s=0.1) as rig:
        rig.app.start()
        imu = rig.app.imu
        rig.app.set(knob, value)
        rig.port.run_ms(100)
        before = list(imu.counts)
        rig.port.run_ms(100)
        assert rig.app.imu is imu and list(imu.counts) != before
        rig.app.stop()
        rig.app.start()
        assert rig.app.imu is imu


# ---- another filter goes on where the old one stands, before its first tick


@boards
@pytest.mark.parametrize("name", ["kalman2", "float.attitude", "float.kalman", "attitude",
                                  "float.complementary"])  # fmt: skip
@pytest.mark.parametrize("roll_deg, pitch_deg", [(-146.0, 0.0), (30.0, -40.0), (0.0, 75.0)])
def test_a_new_filter_reads_the_same_at_once(board, name, roll_deg, pitch_deg, tmp_path):
    start = "kalman2" if name == "attitude" else "attitude"
    with Rig(board, Still(roll_deg, pitch_deg), tmp_path, filter=start) as rig:
        rig.app.start()
        rig.port.run_ms(700)
        rig.app.set("filter", name)
        for _ in range(20):
            assert rig.app.roll_deg == pytest.approx(roll_deg, abs=0.5)
            assert rig.app.pitch_deg == pytest.approx(pitch_deg, abs=0.5)
            rig.port.run_ms(1)


# ---- directions, turns, and what is saved


class Slope:
    """It stands on a slope of some degrees of roll, at rest."""

    duration_s = None

    def __init__(self, roll_deg):
        self.roll = radians(roll_deg)

    def at(self, t):
        return (0.0, sin(self.roll), cos(self.roll), 0.0, 0.0, 0.0, 25.0)

    def truth(self, t):
        return (cos(self.roll / 2), sin(self.roll / 2), 0.0, 0.0)


@boards
@pytest.mark.parametrize("roll_deg", [-12.0, 4.0, 25.0])
def test_level_here_is_kept_over_the_next_start(board, roll_deg, tmp_path):
    with Rig(board, Slope(roll_deg), tmp_path) as rig:
        rig.app.start()
        rig.port.run_ms(200)
        assert rig.app.roll_deg == pytest.approx(roll_deg, abs=0.5)
        rig.app.level_here()
        assert rig.app.running
        rig.port.run_ms(200)
        assert abs(rig.app.roll_deg) < 0.3 and abs(rig.app.pitch_deg) < 0.3
    with Rig(board, Slope(roll_deg), tmp_path) as rig:
        rig.app.start()
        rig.port.run_ms(200)
        assert abs(rig.app.roll_deg) < 0.3 and abs(rig.app.pitch_deg) < 0.3


@boards
def test_level_here_on_its_side_is_refused_in_words_and_the_loop_goes_on(board, tmp_path):
    with Rig(board, Slope(80.0), tmp_path) as rig:
        rig.app.start()
        with pytest.raises(ValueError, match="80 degrees from"):
            rig.app.level_here()
        rig.port.run_ms(100)
        assert rig.claimed and rig.app.roll_deg == pytest.approx(80.0, abs=0.5)


@boards
@pytest.mark.parametrize("rate_dps", [-200.0, 200.0])
def test_turns_are_counted_and_zero_yaw_begins_anew(board, rate_dps, tmp_path):
    with Rig(board, Turn(rate_dps), tmp_path) as rig:
        rig.app.start()
        rig.until(10.0)  # 90 degrees, and five seconds of the turn
        assert rig.app.turned_deg == pytest.approx(90 + 5 * rate_dps, abs=4.0)
        assert -180 <= rig.app.yaw_deg <= 180
        rig.app.zero_yaw()
        rig.port.run_ms(1000)
        assert rig.app.turned_deg == pytest.approx(rate_dps, abs=3.0)


@boards
def test_the_integer_filter_tells_the_linear_acceleration(board, tmp_path):
    with Rig(board, Still(20.0, -30.0), tmp_path) as rig:
        rig.app.start()
        rig.port.run_ms(500)
        assert rig.app.filter.linear_accel_g() == pytest.approx((0.0, 0.0, 0.0), abs=0.03)


# ---- what is shown


def test_stats_come_in_groups_and_show_marks_what_differs(tmp_path, capsys):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.start()
        rig.port.run_ms(300)
        lines = repr(rig.app.stats()).split("\n")
        assert 4 <= len(lines) <= 10 and max(len(line) for line in lines) < 400
        late = [line for line in lines if "late_p99_us" in line]
        assert len(late) == 1 and "late_max_us" in late[0] and "period" not in late[0]
        rig.app.set("rate_hz", 500)
        capsys.readouterr()
        rig.app.show()
        rows = {line[2:].split()[0]: line for line in capsys.readouterr().out.splitlines()}
        assert rows["rate_hz"].startswith("*~") and "default 250" in rows["rate_hz"]
        assert rows["gyro_dps"].startswith("  ") and "default" not in rows["gyro_dps"]


@boards
def test_undo_and_defaults_are_one_change_each(board, tmp_path):
    with Rig(board, Still(), tmp_path, rest_s=0.1) as rig:
        app = rig.app
        app.start()
        assert app.undo() == {}
        app.set("rate_hz", 500)
        app.set("attitude_tau_s", 5.0)
        with pytest.raises(ValueError):
            app.set("attitude_tau_s", -1)
        app.defaults()
        assert app.changed() == {} and app.loop.period_us == 4000
        assert app.undo() == {"rate_hz": 500, "attitude_tau_s": 5.0, "rest_s": 0.1}
        assert app.loop.period_us == 2000
        assert app.undo() == {"attitude_tau_s": 2.3} and app.undo() == {"rate_hz": 250}
        assert app.loop.period_us == 4000 and app.undo() == {}
        rig.port.run_ms(100)
        assert rig.claimed


# ---- a watchdog, and knobs that take their time


@boards
@pytest.mark.parametrize("knob, value", [
    ("gyro_dps", 1000), ("rate_hz", 500), ("dlpf_hz", 94), ("burst", "blocking"),
    ("filter", "float.attitude"),
])  # fmt: skip
def test_a_set_up_knob_under_a_watchdog_resets_nothing(board, knob, value, tmp_path):
    with Rig(board, Still(), tmp_path, watchdog_ms=2000, rest_s=2.0) as rig:
        rig.app.start()
        rig.port.run_ms(100)
        began = rig.port.now_ns
        rig.app.set(knob, value)
        assert rig.port.now_ns - began < 300e6
        rig.port.run_ms(2500)  # a VirtualReset would leave
        assert rig.claimed


# ---- wrong hands


def test_a_knob_written_to_the_app_is_refused_in_words(tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        for name in ("rate_hz", "attitude_tau_s", "quad_rate_p"):
            with pytest.raises(AttributeError, match=name + r" is a knob: app\.set"):
                setattr(rig.app, name, 500)
        rig.app.mine = 3  # what is no knob may be written
        assert rig.app.mine == 3


@pytest.mark.parametrize("wrong", [(3,), (None,), (print, 3), (print, "safe")])
def test_an_output_that_is_no_function_is_refused_at_once(wrong, tmp_path):
    with Rig("hard", Still(), tmp_path) as rig:
        rig.app.start()
        with pytest.raises(ValueError, match="functions, not"):
            rig.app.outputs.add(*wrong)
        assert not rig.app.outputs.active

# SPDX-License-Identifier: MIT
"""The guided calibration, with a virtual board in place of the serial line and a script for a
person: after it the board's own start-up code loads true readings."""

import contextlib
import io
import math

import numpy as np
import pytest
from mpremote.transport import TransportError
from scipy.spatial.transform import Rotation

from host_tests.lib.sensor_rig import Feel, rig
from tools.calibrate import __main__ as calibrate
from tools.calibrate.__main__ import Guide
from tools.deploy import link
from tools.virtual.chip import MPU6050Chip

MATRIX = ((1.03, 0.02, -0.02), (-0.02, 0.97, 0.02), (0.02, -0.02, 1.03))
FACES = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)]
TURN = Rotation.random(random_state=8).as_matrix()  # robot = TURN sensor


@pytest.fixture
def board(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chip = MPU6050Chip(
        seed=4, accel_matrix=MATRIX, accel_bias_g=(0.08, -0.08, 0.08), gyro_bias_dps=(5, -4, 3)
    )
    with rig("rp2", chip) as r:
        space = {"__builtins__": r.port.importer.builtins}

        def run(code):
            printed = io.StringIO()
            with contextlib.redirect_stdout(printed):
                exec(code, space)
            return printed.getvalue()

        yield r, run


def _person(r, feelings):
    """Answers each question by giving the sensor the next thing to feel, or by a call."""
    feelings = iter(feelings)

    def ask(text):
        feeling = next(feelings)
        while callable(feeling):  # something else that happens before
            feeling()
            feeling = next(feelings)
        r.chip.set_motion(feeling if isinstance(feeling, Feel) else Feel(feeling))
        r.wait_ms(300)

    return ask


def _robot(true):
    return tuple(TURN.T @ true)


NOSE_UP = (math.sin(0.5), 0.0, math.cos(0.5))


def test_faces_and_mounting_end_in_true_readings(board):
    r, run = board
    said = []
    moving = Feel((1, 0, 0), (60, 0, 0))
    steps = [FACES[0], moving, *FACES[1:], (0, 0, 1), _robot((0, 0, 1)), _robot(NOSE_UP)]
    guide = Guide(run, _person(r, steps), said.append, seconds=0.5)
    guide.poses()
    guide.mounting()
    guide.save("2026-04-01")
    assert any("again: moved: gyro x turns at" in text for text in said)
    assert any("residual" in text and "mg" in text for text in said)

    from calibration.rest import rest

    from firmware.calibration import load_calibration

    cal, warnings = load_calibration()
    assert (warnings, cal.date, cal.who_am_i) == ([], "2026-04-01", 0x68)
    assert cal.gyro_bias_dps == pytest.approx((5, -4, 3), abs=0.05)
    imu = r.sensor()
    for true in ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, -1.0, 0.0)):
        r.chip.set_motion(Feel(_robot(true)))
        r.wait_ms(100)
        assert cal.apply(rest(imu, 0.3).accel_g, (0, 0, 0))[0] == pytest.approx(true, abs=4e-3)


def test_any_poses_and_a_slope(board):
    r, run = board
    slope = Rotation.from_euler("yx", (8.0, -3.0), degrees=True)
    headings = [Rotation.from_euler("z", 90 * k, degrees=True) for k in range(4)]
    ground = [_robot((slope * h).inv().apply((0, 0, 1))) for h in headings]
    poses = list(Rotation.random(14, random_state=1).apply((0, 0, 1)))
    steps = [*poses, (0, 0, 1), *ground, _robot(NOSE_UP)]
    guide = Guide(run, _person(r, steps), lambda text: None, seconds=0.5, faces=False)
    guide.poses(14)
    guide.mounting(headings=4)
    guide.save("")

    from firmware.calibration import load_calibration

    cal, _ = load_calibration()
    # what was felt when the sensor lay level in the robot's sense, through the worst chip
    for true in ((0.0, 0.0, 1.0), (0.6, 0.0, 0.8)):
        reading = np.array(MATRIX) @ _robot(true) + (0.08, -0.08, 0.08)
        assert cal.apply(reading, (0, 0, 0))[0] == pytest.approx(true, abs=0.02)


def test_a_tilt_too_small_is_refused_in_words_and_asked_again(board):
    r, run = board
    said = []
    steps = [*FACES, (0, 0, 1), _robot((0, 0, 1)), _robot((0.05, 0, 0.998)), _robot(NOSE_UP)]
    guide = Guide(run, _person(r, steps), said.append, seconds=0.3)
    guide.poses()
    guide.mounting()
    assert any("again: tilted by" in text and "between 10 and 80" in text for text in said)
    assert said[-1].startswith("sensor: forward is ")


def test_a_side_that_was_up_twice_costs_one_more_pose(board):
    r, run = board
    asked = []
    steps = [FACES[0], *FACES, (0, 0, 1)]
    person = _person(r, steps)
    guide = Guide(run, lambda t: (asked.append(t), person(t)), lambda t: None, seconds=0.3)
    guide.poses()
    assert asked[6] == "Another side up (not yet up: -z), then Enter "


def test_a_wire_that_came_off_costs_one_pose(board):
    r, run = board
    said = []
    off, on = r.chip.power_off, r.chip.power_on
    steps = [FACES[0], off, FACES[1], on, FACES[1], off, on, FACES[2], *FACES[2:], (0, 0, 1)]
    guide = Guide(run, _person(r, steps), said.append, seconds=0.3)
    guide.poses()
    again = [text for text in said if "again:" in text]
    assert "check its wires" in again[0] and "no data" in again[1] and len(again) == 2
    assert "residual 0." in said[-2]


def test_a_large_residual_is_kept_only_on_purpose(board):
    r, run = board
    asked = []
    steps = [(1, 0.1, 0), *FACES[1:], (0, 0, 1), (0, 0, 1)]
    person = _person(r, steps)
    Guide(run, lambda t: (asked.append(t), person(t)), lambda t: None, seconds=0.3).poses()
    assert asked[6] == "Enter keeps it, Ctrl-C stops "


class Line:
    """mpremote's transport to the virtual board, or one that does as `exec_raw` says once the
    program before has been stopped."""

    def __init__(self, exec_raw):
        self.does = exec_raw
        self.serial = self
        self.wrote = []

    def enter_raw_repl(self, soft_reset):
        pass

    def exec_raw(self, text, timeout):
        return (b"", b"") if text.endswith("feed()\n") else self.does(text, timeout)

    def write(self, data):
        self.wrote.append(data)

    def exit_raw_repl(self):
        self.write("exit")

    def close(self):
        self.write("close")


def _main(monkeypatch, exec_raw):
    """(exit code, what the line was told at the end) of the program with no input."""
    line = Line(exec_raw)
    monkeypatch.setattr(link, "_opened", lambda port: line)
    monkeypatch.setattr("sys.argv", ["calibrate", "--port", "x", "--seconds", "20"])
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    return calibrate.main(), line.wrote


def test_the_end_of_the_input_leaves_the_friendly_repl(board, monkeypatch, capsys):
    code, wrote = _main(monkeypatch, lambda text, timeout: (board[1](text).encode(), b""))
    assert (code, wrote) == (1, [b"\x03", "exit", "close"])
    assert "stopped; nothing new is stored; RESET the board" in capsys.readouterr().err


def _gone(text, timeout):
    assert timeout > 2 * 20  # a rest takes twice its time when reading takes a millisecond
    raise OSError(5, "Input/output error")


def _late(text, timeout):
    raise TransportError("timeout waiting")


def _traceback(*last):
    lines = ["Traceback (most recent call last):", '  File "<stdin>", line 2, in <module>', *last]
    return lambda text, timeout: (b"", "\r\n".join([*lines, ""]).encode())


@pytest.mark.parametrize(
    "exec_raw, told",
    [
        (_gone, "x: the board is gone ([Errno 5] Input/output error)\n"),
        (_late, "x: the board is gone (timeout waiting)\n"),
        (_traceback("OSError: [Errno 5] no answer", "Seen: this"), "no answer\nSeen: this\n"),
        (_traceback("ImportError: no module named 'firmware'"), "make deploy PORT=...\n"),
    ],
)
def test_each_failure_ends_in_words(monkeypatch, capsys, exec_raw, told):
    assert _main(monkeypatch, exec_raw)[0] == 1
    said = capsys.readouterr().err
    assert told + "nothing new is stored; RESET the board" in said and "Traceback" not in said


@pytest.mark.parametrize("wrong", [("--poses", "5"), ("--seconds", "nan"), ("--slope", "1")])
def test_impossible_numbers_are_refused_at_once(monkeypatch, capsys, wrong):
    monkeypatch.setattr("sys.argv", ["calibrate", "--port", "x", *wrong])
    with pytest.raises(SystemExit):
        calibrate.main()
    assert f"{wrong[0]}: {wrong[1]}: at least" in capsys.readouterr().err

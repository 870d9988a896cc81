# SPDX-License-Identifier: MIT
"""`python -m tools.calibrate` as a program of its own, against the emulated board.

A script plays the person who holds the datasheet's worst sensor: it reads the prompts, turns the
sensor and presses Enter. One board for the file; the tests are its life, in this order.
"""

import ast
import math
import os
import sys
from pathlib import Path

import pytest

from tools.calibrate.virtual import FACES
from tools.demo.__main__ import settings_file
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.chip.tolerances import worst_case
from tools.virtual.motion import Sinusoid, Still
from tools.virtual.motion import quaternions as quat
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040.console import CTRL_C

SETTLE_MS = 100  # the sensor's low-pass forgets the pose before
SEAT = (4.0, -7.0)  # roll and pitch of the sensor when the robot stands level
HELD = (25.0, -40.0)  # the robot at its next start; any pose will do


class Person:
    """Answers each prompt with the next of some motions and Enter; then presses `last`."""

    def __init__(self, port, chip, motions, last):
        self._port, self._chip, self._last = port, chip, last
        self._motions = list(motions)

    def __call__(self, text):
        if not self._motions:
            last, self._last = self._last, None
            return last
        if not text.endswith(b"Enter "):
            return None
        self._chip.set_motion(self._motions.pop(0))
        self._port.serve_ms(SETTLE_MS)
        return b"\n"


def calibrate(board, *arguments, chip=None, motions=(), last=None):
    """(exit code, text) of the tool on a board, which is left to a person at a terminal."""
    with board.terminal() as port:
        command = [sys.executable, "-m", "tools.calibrate", "--port", port.path, *arguments]
        code, printed = port.program(command, 900, Person(port, chip, motions, last))
        line = os.open(port.path, os.O_RDWR | os.O_NOCTTY)
        os.write(line, b"6*7\r")
        port.serve_ms(50)
        assert os.read(line, 4096).endswith(b"6*7\r\n42\r\n>>> ")  # no raw REPL, no output
        os.close(line)
    print(printed.decode())
    assert b"Traceback" not in printed
    return code, printed.decode()


@pytest.fixture(scope="module")
def chip():
    return MPU6050Chip(seed=3, **worst_case(3))


@pytest.fixture(scope="module")
def board(chip):
    """Without main.py at first; without a rest at start it uses the gyro bias that is stored."""
    files = {"config.txt": settings_file(rest_s=0.0, watchdog_ms=2000)}
    with VirtualPico(bus=Bus(chip, log_length=1), root=True, main=False, files=files) as pico:
        yield pico


def robot(roll_deg, pitch_deg):
    """What the sensor feels when the robot has this pose: it is not square with it (SEAT)."""
    seat, turn = quat.from_euler(*SEAT), quat.from_euler(roll_deg, pitch_deg)
    x, y, z = quat.gravity(quat.product(turn, seat))
    return Still(math.degrees(math.atan2(y, z)), math.degrees(math.atan2(-x, math.hypot(y, z))))


def test_a_person_who_moves_once_calibrates_the_board(board, chip):
    first, *faces = [Still(*face) for face in FACES]
    motions = [first, Sinusoid(frequency_hz=3.0), *faces, first, robot(0, 0), robot(0, -30)]
    code, printed = calibrate(board, "--mounting", "--seconds", "0.05", chip=chip, motions=motions)
    assert code == 0 and printed.endswith("saved; RESET the board to use it\n")
    assert printed.count("again: moved: ") == 1
    assert "+z is up" in printed and "not yet up: +x, +y, -x, -y, -z" in printed
    assert "forward is +x, up is +z, " in printed
    square = float(printed.partition("up is +z, ")[2].split()[0])
    assert square == pytest.approx(8.0, abs=0.3)
    assert b"residual_mg" in board.files()["calibration.txt"]


def test_the_next_start_uses_it(board, chip):
    main = Path(__file__).parents[2] / "main.py"
    board.exec(f"with open('main.py', 'w') as f: f.write({main.read_text()!r})")
    chip.set_motion(robot(*HELD))
    board.power_cycle()
    board.run_ms(1500)  # three time constants at rest: the first samples are noise of 0.2 degrees
    roll, pitch, residual_mg, rates_dps, warnings = ast.literal_eval(
        board.exec(
            "c = app.calibration\nr = c.apply(imu.accel_g(), imu.gyro_dps())[1]\n"
            "print((app.roll_deg, app.pitch_deg, c.residual_mg, r, app.warnings))"
        )
    )
    print(roll, pitch, residual_mg, rates_dps)
    assert (roll, pitch) == pytest.approx(HELD, abs=0.3)
    assert residual_mg < 2
    assert rates_dps == pytest.approx((0, 0, 0), abs=0.5)  # one sample; the bias was 20 deg/s
    assert warnings == []


def test_it_stops_the_running_app_and_ctrl_c_leaves_all_as_it_was(board, chip):
    assert board.exec("print(app.loop.running)") == "True\n"
    before, restarts = board.files(), board.restarts
    up, down = Still(), Still(180)
    code, printed = calibrate(
        board, "--seconds", "0.05", chip=chip, motions=[up, down], last=CTRL_C
    )
    assert code == 1
    assert "+z is up" in printed and "again:" not in printed and "-z is up" not in printed
    assert printed.endswith(
        "stopped; nothing new is stored; RESET the board to start its program again\n"
    )
    assert board.files() == before
    assert board.exec("print('app' in globals())") == "False\n"
    board.run_ms(2500)
    assert board.restarts == restarts  # the watchdog, which nothing stops, is fed


def test_a_board_without_the_project_is_told_so():
    with VirtualPico() as bare:
        code, printed = calibrate(bare)
    assert code == 1
    assert "Plumb is not on this board" in printed and "'firmware'" in printed

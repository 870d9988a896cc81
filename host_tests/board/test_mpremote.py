# SPDX-License-Identifier: MIT
"""The real mpremote, a program of its own, against the emulated board's serial line."""

import subprocess
import sys

import pytest

from tools.virtual.pico import PicoError, VirtualPico


@pytest.fixture(scope="module")
def board():
    with VirtualPico(files={"lib/here.txt": ""}) as pico:
        yield pico


def test_copies_a_folder_lists_it_and_runs_it(board, tmp_path):
    package = tmp_path / "pack"
    (package / "inner").mkdir(parents=True)
    (package / "__init__.py").write_text("from pack.inner.deep import twice\n")
    (package / "inner" / "deep.py").write_text("def twice(x):\n    return 2 * x\n" + "#" * 600)
    board.mpremote("fs", "cp", "-r", str(package), ":/lib/")
    assert "deep.py" in board.mpremote("fs", "ls", "lib/pack/inner")
    assert board.mpremote("exec", "import pack; print(pack.twice(21))") == "42\n"
    assert board.files()["lib/pack/inner/deep.py"].startswith(b"def twice")


def test_reports_an_exception(board):
    with pytest.raises(PicoError, match="NameError"):
        board.mpremote("exec", "nothing_here")


def test_a_background_timer_goes_on_while_mpremote_changes_a_variable(board):
    board.mpremote(
        "exec",
        "from machine import Timer\nstep = 1\ncount = 0\ndef tick(t):\n global count\n"
        " count += step\ntimer = Timer(-1, freq=250, callback=tick)",
    )
    board.mpremote("resume", "exec", "step = 1000")
    board.run_ms(100)
    assert int(board.mpremote("resume", "exec", "timer.deinit(); print(count)")) >= 20_000


def test_reset_runs_main_py(board):
    board.exec("with open('main.py', 'w') as f: f.write('ran = 7')")
    board.mpremote("reset")
    board.run_ms(300)
    assert board.mpremote("resume", "exec", "print(ran)") == "7\n"


def test_served_by_the_command_line():
    """`python -m tools.virtual.pico` prints a path at which mpremote finds the sensor."""
    command = [sys.executable, "-m", "tools.virtual.pico", "--bare", "--seconds", "60"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        try:
            path = next(line.split()[1] for line in server.stdout if line.startswith("port:"))
            line = "import machine; print(machine.I2C(0).scan())"
            done = subprocess.run(
                [sys.executable, "-m", "mpremote", "connect", path, "exec", line],
                capture_output=True, text=True, timeout=50, check=False,
            )  # fmt: skip
        finally:
            server.terminate()
    assert done.stdout.strip() == "[104]", done.stderr

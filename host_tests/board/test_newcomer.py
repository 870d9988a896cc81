# SPDX-License-Identifier: MIT
"""A newcomer's walk, in the pages' own words: a fresh copy, demo, a virtual Pico with nothing on
it, deploy, the REPL, calibration, save, reset. Programs of their own, as a person starts them.

One walk; the tests are its steps, in this order.
"""

import os
import pty
import re
import select
import shutil
import signal
import subprocess
import sys
import time
import tty
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LEFT = shutil.ignore_patterns(".venv", "out", "build", "__pycache__", ".*_cache", ".hypothesis")
PROMPT = "\r\n>>> "
KNOB_BLOCK = 'app.set("filter", "kalman2")'


def page(name):
    return (ROOT / name).read_text()


def command(text, start):
    """The line of a page that begins so, without its comment."""
    found = re.search(rf"^ *({re.escape(start)}.*?) *(#.*)?$", text, re.M)
    assert found, start
    return found[1]


def block(text, line):
    """The lines of the Python block that holds `line`."""
    blocks = re.findall(r"^```python\n(.*?)^```", text, re.M | re.S)
    return next(b for b in blocks if line in b).splitlines()


class Walk:
    """A folder with a fresh copy, and what runs in it."""

    def __init__(self, folder):
        self.folder = folder
        shutil.copytree(ROOT, folder, ignore=LEFT)
        (folder / ".venv").symlink_to(Path(sys.prefix))
        (folder / ".venv" / "ready").touch()
        self.port = None
        self.board = None

    def start(self, line, **how):
        """The program of a command line."""
        return subprocess.Popen(
            line,
            shell=True,
            cwd=self.folder,
            start_new_session=True,
            # a background job ignores Ctrl-C, and so would what it starts
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
            **how,
        )

    def run(self, line, timeout_s):
        """What it printed; it must end well."""
        program = self.start(
            line, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL
        )
        try:
            printed = program.communicate(timeout=timeout_s)[0].decode()
        except subprocess.TimeoutExpired:
            os.killpg(program.pid, signal.SIGKILL)
            printed = program.communicate()[0].decode()
        assert program.returncode == 0, printed
        return printed

    def plug_in(self, line):
        """The virtual board of this command line, until end()."""
        self.board = self.start(line, stdout=subprocess.PIPE, text=True)
        for said in self.board.stdout:
            if said.startswith("port: "):
                self.port = said.split()[1]
                return
        raise AssertionError("the board said no port")

    def end(self):
        if self.board:
            os.killpg(self.board.pid, signal.SIGINT)
            self.board.wait(60)
            self.board.stdout.close()


class Repl:
    """A person at `mpremote connect PORT repl`."""

    def __init__(self, walk, line):
        self._master, slave = pty.openpty()
        tty.setraw(slave)
        self._program = walk.start(line, stdin=slave, stdout=slave, stderr=slave)
        os.close(slave)
        self.text = ""

    def until(self, mark, timeout_s=120):
        """What comes up to and with the mark."""
        end = time.monotonic() + timeout_s
        while mark not in self.text:
            assert time.monotonic() < end and self._program.poll() is None, self.text
            if select.select([self._master], [], [], 1)[0]:
                self.text += os.read(self._master, 4096).decode()
        before, _, self.text = self.text.partition(mark)
        return before + mark

    def key(self, keys):
        os.write(self._master, keys)

    def type(self, line):
        """What the board prints for a line."""
        self.key(line.encode() + b"\r")
        printed = self.until(PROMPT)
        assert "Traceback" not in printed, printed
        return printed.partition("\r\n")[2].removesuffix(PROMPT).removesuffix("\r\n")

    def leave(self):
        self.key(b"\x1d")  # Ctrl-]
        self._program.wait(60)
        os.close(self._master)


@pytest.fixture(scope="module")
def walk(tmp_path_factory):
    walk = Walk(tmp_path_factory.mktemp("home") / "plumb")
    yield walk
    walk.end()


@pytest.fixture
def repl(walk):
    line = command(page("docs/site/start.md"), ".venv/bin/mpremote connect /dev/ttyACM0")
    repl = Repl(walk, line.replace("/dev/ttyACM0", walk.port))
    yield repl
    repl.leave()


def test_help_and_the_demo(walk):
    readme = page("README.md")
    printed = walk.run(command(readme, "make help"), 60)
    for target in ("demo", "test", "deploy", "accuracy", "scope"):
        assert f"make {target} " in printed
    printed = walk.run(command(readme, "make demo"), 400)
    picture = re.search(r"\S+\.png", printed)[0]
    assert (walk.folder / picture).read_bytes().startswith(b"\x89PNG")


def test_deploy_to_a_virtual_pico_with_nothing_on_it(walk):
    page_of_it = page("docs/site/virtual.md")
    walk.plug_in(command(page_of_it, ".venv/bin/python -m tools.virtual.pico --bare"))
    line = command(page("docs/site/start.md"), "make deploy PORT=/dev/ttyACM0")
    printed = walk.run(line.replace("/dev/ttyACM0", walk.port), 600)
    assert "it runs: " in printed and "roll_deg:" in printed


def test_the_lines_of_the_start_and_the_knobs_of_the_readme(repl):
    assert "roll_deg:" in page("docs/site/start.md")
    repl.until("roll_deg:")
    repl.key(b"\r")  # "Any key ends the lines and leaves the REPL"
    repl.until(PROMPT)
    printed = {line: repl.type(line) for line in block(page("README.md"), KNOB_BLOCK)}
    angles = eval(next(said for line, said in printed.items() if "roll_deg" in line))
    assert all(abs(angle) < 1 for angle in angles)
    assert repl.type("app.config.filter") == "'kalman2'"


def test_calibration_as_its_page_says_while_it_lies_still(repl):
    assert "Ctrl-D" in page("docs/site/calibration.md")
    repl.key(b"\x04")
    repl.until("roll_deg:")
    repl.key(b" ")
    repl.until(PROMPT)
    steps = block(page("docs/site/calibration.md"), "steps = app.calibrating()")
    printed = [repl.type(line) for line in steps]
    assert any("pose" in said for said in printed)  # what comes next
    assert repl.type("app.running") == "True"


def test_what_was_saved_is_there_after_a_reset(walk, repl):
    repl.type("app.set('kalman_r_measure', 0.2)")
    repl.type(command(page("README.md"), "app.save()"))
    repl.key(b"\x04")  # Ctrl-D: the board starts anew
    repl.until("roll_deg:")
    repl.key(b" ")
    repl.until(PROMPT)
    assert repl.type("app.config.filter, app.config.kalman_r_measure") == "('kalman2', 0.2)"
    assert repl.type("app.stale") == "False"

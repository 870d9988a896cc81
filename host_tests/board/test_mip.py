# SPDX-License-Identifier: MIT
"""mip, by the real mpremote, from an index on this machine to the emulated board."""

import functools
import http.server
import threading

import pytest

from tools.release.checks import version
from tools.release.index import packages, write_index
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import PicoError, VirtualPico

INSTALL_S = 900  # real seconds; a hundred files through an emulated serial line


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *arguments):
        pass


@pytest.fixture(scope="module")
def index(tmp_path_factory):
    """The address of the index, served on this machine only."""
    folder = tmp_path_factory.mktemp("index")
    write_index(folder, version())
    handler = functools.partial(Quiet, directory=folder)
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


ABSENT = ("firmware/app.py", "plumb_main.py", "attitude/__init__.py", "control/pid.py",
          "calibration/__init__.py", "mpu6050/registers.py")  # fmt: skip


@pytest.fixture(scope="module")
def pico():
    """Most of the app is there, so that not every test copies a hundred files."""
    files = {}
    for name, (own, _) in packages().items():
        if name != "minimu9":
            files |= {f"lib/{path}": data for path, data in own.items() if path not in ABSENT}
    with VirtualPico(bus=Bus(MPU6050Chip(seed=3)), files=files, mpy=False) as board:
        yield board


def install(pico, index, *names):
    command = ("mip", "install", "--index", index, *names)
    return pico.mpremote(*command, timeout_s=INSTALL_S)


def test_one_library_brings_what_it_depends_on(pico, index):
    printed = install(pico, index, "minimu9")
    assert "Installing mpu6050" in printed
    wanted = {*packages()["minimu9"][0], *packages()["mpu6050"][0]}
    assert {f"lib/{name}" for name in wanted} <= set(pico.files())
    assert pico.exec("import minimu9; print(minimu9.MinIMU9.__name__)") == "MinIMU9\n"
    # what is there is known by its digest
    assert printed.count("Exists:") == len(packages()["mpu6050"][0]) - 1
    assert printed.count("Installing: ") == 2


def test_the_whole_app_with_every_other_library_starts_from_a_line(pico, index):
    pico.exec("with open('lib/control/servo.py', 'a') as f: f.write('# edited')")
    printed = install(pico, index, "plumb")
    assert printed.count("Installing: ") == len(ABSENT)  # one less is missing, one was edited
    files = pico.files()
    for name, (own, _) in packages().items():
        for path, data in own.items():
            assert files[f"lib/{path}"] == data, name
    pico.exec("with open('main.py', 'w') as f: f.write('from plumb_main import *')")
    pico.reset(30)
    line = "print(app.running, abs(app.roll_deg) < 1, app.stale)"
    assert pico.exec(line) == "True True False\n"


def test_a_name_that_is_not_there_ends_in_words(pico, index):
    with pytest.raises(PicoError, match="Package not found"):
        install(pico, index, "nothing")

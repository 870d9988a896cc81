# SPDX-License-Identifier: MIT
"""app.stats() prints in groups and becomes JSON, on MicroPython as well."""

import ast
import inspect
import json
import subprocess

import pytest

from tools.virtual import images
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.port import Port

ON_BOARD = """
import json
{source}
stats = Stats({values!r})
print(json.dumps(stats.copy()))
print(repr(stats))
"""


@pytest.fixture
def stats(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Port("rp2", {0: Bus(MPU6050Chip(Still()))}, wiring={0: (4, 5)}) as port:
        from firmware.app import App

        app = App()
        app.start()
        port.run_ms(300)
        yield app.stats()
        app.stop()


def test_a_copy_is_a_plain_dict_that_json_writes(stats):
    copy = stats.copy()
    assert type(copy) is dict and type(stats) is not dict
    assert json.loads(json.dumps(copy, allow_nan=False)) == copy == stats
    assert copy["ticks"] > 50 and copy["stale"] is False


def test_it_is_so_on_micropython_too_and_the_groups_stay(stats):
    code = ON_BOARD.format(source=inspect.getsource(type(stats)), values=stats.copy())
    micropython = images.unix_micropython()
    run = subprocess.run([micropython, "-c", code], capture_output=True, text=True, check=True)
    first, shown = run.stdout.split("\n", 1)
    assert json.loads(first) == stats
    assert ast.literal_eval(shown) == stats
    rows = shown.strip().splitlines()
    assert len(rows) > 4 and all(row.startswith(" '") for row in rows[1:])
    assert any(row.count("telemetry_") == row.count(": ") > 1 for row in rows)

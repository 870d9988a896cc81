# SPDX-License-Identifier: MIT
"""The product on the real firmware: deployed by mpremote, started from flash, tuned while it runs.

One board for the whole file: its emulated time is what these tests cost.
"""

import ast
import subprocess
import sys
import time

import pytest

from tools.demo.__main__ import settings_file
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040 import flash


def deploy(board, timeout_s=600):
    """`python -m tools.deploy` on the board's serial line; what it printed."""
    with board.terminal() as port:
        process = subprocess.Popen(
            [sys.executable, "-m", "tools.deploy", "--port", port.path, "--wait", "300"],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        end = time.monotonic() + timeout_s
        while process.poll() is None and time.monotonic() < end:
            port.serve_ms(10)
        if process.poll() is None:
            process.kill()
        printed = process.communicate()[0]
    assert process.returncode == 0, printed
    return printed


@pytest.fixture(scope="module")
def deployed(micropython):
    """(board, what deploy printed): most of the project was there, the rest came by mpremote."""
    files = flash.compiled({**flash.project_files(main=False), "firmware/gone.py": "old = 1\n"})
    for name in ("firmware/loop.mpy", "firmware/telemetry.mpy", "boot.py"):
        del files[name]
    files["firmware/loop.py"] = "this is no Python\n"  # would be imported before the .mpy
    files["config.txt"] = settings_file(rest_s=0.02)
    chip = MPU6050Chip(seed=2, gyro_bias_dps=(2.0, -1.0, 0.5))
    with VirtualPico(bus=Bus(chip), files=files, mpy=False, micropython=micropython) as board:
        printed = deploy(board)
        yield board, printed


def stats_of(board, source, timeout_s=30):
    """Run `source`, which leaves app.stats() in `s`; returns it."""
    board.exec(source, timeout_s)
    return ast.literal_eval(board.exec("print(s)"))


def test_deploy_copies_what_is_missing_and_removes_what_is_gone(deployed):
    board, printed = deployed
    assert "RP2040" in printed and "100 %" in printed
    assert "it runs: roll_deg:" in printed
    for name in ("main.py", "boot.py", "firmware/telemetry.mpy", "firmware/loop.mpy"):
        assert name in printed
    assert "firmware/tick/timing.mpy" not in printed  # it was there, and the same
    on_flash = board.files()
    assert {"main.py", "boot.py", "firmware/loop.mpy"} <= set(on_flash)
    assert "firmware/gone.mpy" not in on_flash and "firmware/loop.py" not in on_flash


def test_main_runs_from_flash_and_the_repl_sees_app_and_imu(deployed):
    board, _ = deployed
    out = board.exec("print(app.loop.running, imu is app.imu, app.tick.error)")
    assert out == "True True None\n"
    first, second = (
        board.exec("print(app.stats()['ticks'])"),
        board.exec("import time\ntime.sleep_ms(100)\nprint(app.stats()['ticks'])"),
    )
    assert int(second) - int(first) >= 20


def angles(printed):
    """Roll of each telemetry line."""
    return [float(x.split()[1]) for x in printed.splitlines() if x.startswith("roll_deg:")]


def test_mpremote_changes_a_parameter_while_it_runs_and_the_output_shows_it(deployed):
    board, _ = deployed
    # the sensor is told to be mounted half a radian askew, and the accelerometer not to be trusted
    printed = board.mpremote(
        "resume",
        "exec",
        "app.set('rate_hz', 100)\n"  # floats take 3 ms, and the collector's share
        "app.set('filter', 'float.complementary')\nimport math\n"
        "c, n = math.cos(0.5), math.sin(0.5)\n"
        "app.recalibrate(app.calibration.mounted((1, 0, 0, 0, c, -n, 0, n, c)))\n"
        "app.set('complementary_tau_s', 60)\napp.watch(0.1)",
    )
    assert printed.startswith("# roll, pitch and yaw in degrees")
    assert len(angles(printed)) >= 3 and abs(angles(printed)[-1]) < 2
    tune = "app.set('complementary_tau_s', 0.02)\napp.watch(0.1)"
    printed = board.mpremote("resume", "exec", tune)
    assert angles(printed)[-1] < -20  # on its way to 28.6 degrees the other way
    left = "print(app.loop.running, app.stats()['errors'])\napp.set('filter', 'attitude')\n"
    left += "app.set('rate_hz', 250)"
    assert board.mpremote("resume", "exec", left) == "True 0\n"


def test_250_hz_for_half_a_second(deployed):
    board, _ = deployed
    s = stats_of(
        board,
        "import time\napp.stop()\napp.start()\ntime.sleep_ms(500)\ns = app.stats()\napp.stop()",
    )
    print("250 Hz:", s)
    assert s["ticks"] >= 124
    assert s["lost"] == s["overruns"] == s["errors"] == s["skipped_calls"] == 0
    assert s["period_mean_us"] == pytest.approx(4000, abs=0.5)
    assert s["jitter_p50_us"] <= 2
    assert s["jitter_p99_us"] <= 20
    assert s["late_max_us"] <= 100


def test_the_asynchronous_form_on_the_real_asyncio(deployed):
    board, _ = deployed
    out = board.exec(
        "import asyncio\n"
        "async def main():\n"
        "    n = 0\n"
        "    async for same in app.samples():\n"
        "        n += same is app\n"
        "        if n == 20:\n"
        "            return app.stats()['ticks']\n"
        "app.start()\nprint(asyncio.run(main()))\napp.stop()\n"
    )
    assert 20 <= int(out) <= 24


def test_the_int_line_sets_the_pace(deployed):
    board, _ = deployed
    s = stats_of(
        board,
        "import time\napp.set('drive', 'data-ready')\napp.start()\nwords = app.tick.timing.words\n"
        "before, began = words[5], time.ticks_us()\ntime.sleep_ms(301)\n"  # the first may be short
        "ticks, took = words[5] - before, time.ticks_diff(time.ticks_us(), began)\n"
        "s = app.stats().copy()\ns['ticks'], s['took_us'] = ticks, took\n"  # which takes 17 ms
        "app.stop()\napp.set('drive', 'timer')",
    )
    assert s["took_us"] >= 300_000
    assert s["ticks"] == pytest.approx(s["took_us"] / 4000, abs=1.5)
    assert s["lost"] == s["errors"] == s["edges_missing"] == 0
    assert s["jitter_p99_us"] <= 100


def test_one_kilohertz_for_two_seconds_with_the_heap_locked(deployed):
    board, _ = deployed
    board.exec(
        "import micropython, time\n"
        "app.set('rate_hz', 1000)\n"
        "app.start()\napp.stop()\n"
        "run = app.tick.run\n"
        "def locked(source):\n"
        "    micropython.heap_lock()\n"
        "    try:\n"
        "        run(source)\n"
        "    finally:\n"
        "        micropython.heap_unlock()\n"
        "app.tick.run = locked\n"
    )
    s = stats_of(
        board,
        "app.loop.start()\ntime.sleep_ms(2000)\ns = app.stats()\nn = app.tick.error\napp.stop()",
        timeout_s=60,
    )
    print("1 kHz:", s)
    assert board.exec("print(n)") == "None\n"
    assert s["ticks"] >= 1999
    assert s["lost"] == s["overruns"] == s["errors"] == 0
    assert s["period_mean_us"] == pytest.approx(1000, abs=0.5)
    assert s["jitter_p99_us"] <= 20

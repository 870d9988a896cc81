# SPDX-License-Identifier: MIT
"""The virtual Pico itself: firmware, REPL, time, flash, restarts, the project's modules."""

import re

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import PicoError, VirtualPico
from tools.virtual.rp2040.flash import project_files


def test_repl_answers_and_names_an_rp2040(pico):
    assert pico.exec("print(6 * 7)") == "42\n"
    assert "RP2040" in pico.exec("import sys; print(sys.implementation._machine)")


def test_an_exception_on_the_board_is_a_pico_error(pico):
    with pytest.raises(PicoError, match="ZeroDivisionError"):
        pico.exec("1 / 0")


def test_a_program_that_does_not_end_is_a_pico_error_and_can_be_interrupted(pico):
    with pytest.raises(PicoError, match="no answer within"):
        pico.exec("import time\nwhile True: time.sleep(1)", timeout_s=3)
    assert pico.exec("print('back')") == "back\n"


LOOP_US = """
import time
def loop():
    t = time.ticks_us()
    for _ in range(1000):
        pass
    return time.ticks_diff(time.ticks_us(), t)
print(loop(), loop())
"""


def test_a_run_repeats_itself_to_the_microsecond():
    runs = []
    for _ in range(2):
        with VirtualPico() as board:
            runs.append((board.exec(LOOP_US), board.nanos))
    assert runs[0] == runs[1]


def test_an_idle_serial_line_takes_no_time_from_the_program(pico):
    """An empty loop takes the RP2040 at 125 MHz about 3 us each time round."""
    assert all(2500 <= int(us) <= 4000 for us in pico.exec(LOOP_US).split())


def test_sleeping_takes_as_long_as_it_says(pico):
    lines = "import time; t = time.ticks_us(); time.sleep_ms(300); print(time.ticks_us() - t)"
    assert 300_000 <= int(pico.exec(lines)) <= 301_000


def test_main_py_runs_from_flash_and_flash_survives_reset_and_power_cut():
    files = {
        "main.py": "import machine, data\nprint('cause', machine.reset_cause(), data.X)\n",
        "data.py": "X = 5\n",
        "sub/name.txt": b"\x00\xff",
    }
    with VirtualPico(files=files, mpy=False) as board:
        board.exec("with open('new.txt', 'w') as f: f.write('kept')")
        board.exec("import os; os.sync()")
        board.reset()
        assert board.exec("print(open('new.txt').read(), open('sub/name.txt', 'rb').read())") == (
            "kept b'\\x00\\xff'\n"
        )
        board.power_cycle()
        assert board.files()["new.txt"] == b"kept"
        assert set(board.files()) == {*files, "new.txt"}


@pytest.mark.parametrize(
    ("line", "cause"),
    [("machine.reset()", "WDT_RESET"), ("machine.WDT(timeout=100); time.sleep(1)", "WDT_RESET")],
)
def test_a_restart_by_the_program_or_the_watchdog_is_noticed(line, cause):
    with VirtualPico() as board:
        with pytest.raises(PicoError, match="restarted"):
            board.exec("import machine, time; " + line)
        board.wait_prompt()
        line = f"import machine; print(machine.reset_cause() == machine.{cause})"
        assert board.exec(line) == "True\n"
        assert board.restarts == 1


def test_a_power_cut_puts_the_sensor_to_sleep_again():
    """PWR_MGMT_1 (0x6B) resets to 0x40; the chip answers some milliseconds after power-on."""
    bus = Bus(MPU6050Chip())
    with VirtualPico(bus=bus) as board:
        board.exec("from machine import I2C\ni = I2C(0)\ni.writeto_mem(0x68, 0x6B, b'\\x01')")
        board.power_cycle()
        board.run_ms(100)
        line = "from machine import I2C; print(I2C(0).readfrom_mem(0x68, 0x6B, 1))"
        assert board.exec(line) == "b'@'\n"


def test_every_module_of_the_project_imports_on_the_board(pico):
    names = []
    for path in project_files(main=False):
        found = re.fullmatch(r"(?:lib/)?(.+?)(?:/__init__)?\.py", path)
        if path != "boot.py":
            names.append(found.group(1).replace("/", "."))
    assert names
    printed = pico.exec(  # not all at once: they are more than a heap
        "import gc, sys\nlast = None\n"
        f"for name in {sorted(names)!r}:\n"
        "    top = '.'.join(name.split('.')[:2 if name.startswith('attitude.fixed') else 1])\n"
        "    if top != last or gc.mem_free() < 40000:\n"
        "        sys.modules.clear()\n        gc.collect()\n"
        "    last = top\n"
        "    try:\n        __import__(name)\n"
        "    except Exception as error:\n        print(name, repr(error))\n",
        timeout_s=60,
    )
    assert printed == ""

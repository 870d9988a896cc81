# SPDX-License-Identifier: MIT
"""What a person asks and sets at the REPL, one after the other, leaves heap for the next."""

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.pico import VirtualPico

LEFT = 16_000  # bytes, for a program of one's own
VERBS = """\
app.stats()
app.report()
app.self_test()
app.show()
app.help()
app.save()
app.set("filter", "kalman2")
app.set("filter", "attitude")
app.level_here()
steps = app.calibrating(); steps.gyro(0.5); del steps
app.start()
app.set("filter", "float.complementary")
app.set("filter", "attitude")
app.set("filter", "kalman2")
app.report()
""".splitlines()


@pytest.fixture(scope="module")
def pico(micropython):
    bus = Bus(MPU6050Chip(Still(), seed=1))
    with VirtualPico(bus=bus, root=True, main=False, micropython=micropython) as board:
        board.exec("from firmware.app import App\napp = App()\napp.start()\nimport gc", 60)
        yield board


def free(pico):
    return int(pico.exec("gc.collect(); print(gc.mem_free())"))


def test_a_session_at_the_repl_leaves_heap(pico):
    for line in VERBS:
        pico.exec(line, 60)
        left = free(pico)
        print(line, left)
        assert left > LEFT, line
    assert pico.exec("print(app.running, app.stale)") == "True False\n"


def test_a_large_filter_takes_the_place_of_the_code_that_nobody_uses():
    """The float attitude takes 42 KB of 50; the integer one, not used then, gives 43."""
    bus = Bus(MPU6050Chip(Still(), seed=1))
    with VirtualPico(bus=bus, root=True, main=False) as pico:
        pico.exec("from firmware.app import App\napp = App()\napp.start()\nimport gc", 60)
        pico.exec("app.set('filter', 'float.attitude')", 60)
        assert free(pico) > LEFT
        assert pico.exec("print(app.running, app.config.filter)") == "True float.attitude\n"

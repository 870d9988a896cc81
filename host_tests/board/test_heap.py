# SPDX-License-Identifier: MIT
"""What a person asks and sets at the REPL leaves heap and stack for what comes next."""

import pytest

from tools import names
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.pico import PicoError, VirtualPico

LEFT = 15_000  # bytes of heap, for a program of one's own
PIECE = 1_200  # in one piece: a file that is opened takes 1148
STACK = 500  # bytes of 8192 that nothing ever touched; MicroPython itself keeps 256
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
app.set("filter", "kalman2")
app.set("filter", "attitude")
app.report()
app.self_test()
app.set("gyro_dps", 1000)
app.undo()
app.level_here()
app.set("filter", "kalman2")
app.report()
app.stop()
app.start()
app.help()
app.set("rate_hz", 500)
app.set("filter", "float.complementary")
app.set("filter", "float.kalman")
app.set("filter", "attitude")
app.report()
app.level_here()
app.stop()
app.start()
app.set("filter", "kalman2")
""".splitlines()
FILTERS = ("kalman2", "float.kalman", "float.complementary", "attitude")


def started(micropython):
    bus = Bus(MPU6050Chip(Still(), seed=1))
    pico = VirtualPico(bus=bus, root=True, main=False, micropython=micropython)
    pico.boot()
    pico.exec("import gc, micropython\nfrom firmware.app import App\napp = App()\napp.start()", 60)
    return pico


def heap(pico):
    """(bytes free, in the largest piece)."""
    told = pico.exec("gc.collect()\nprint(gc.mem_free())\nmicropython.mem_info()")
    pieces = told.split("max free sz: ")[1]
    return int(told.split()[0]), 16 * int(pieces.split()[0].rstrip(")"))


def says(pico):
    return pico.exec("print(app.running, app.stale, app.config.filter)").split()


def test_a_session_leaves_heap_and_stack(micropython):
    pico = started(micropython)
    for line in VERBS:
        pico.mark_stack()
        pico.exec(line, 60)
        stack, (free, piece) = pico.stack_left(), heap(pico)
        print(f"{line:50} {stack} {free} {piece}")
        assert stack > STACK and free > LEFT and piece > PIECE, line
    assert says(pico) == ["True", "False", "kalman2"]


@pytest.mark.parametrize("first", FILTERS)
def test_the_stack_has_room_while_a_filter_is_loaded_beside_any_other(micropython, first):
    """Imports are deep, and ticks come in between, with whatever the filter of now takes."""
    pico = started(micropython)
    pico.exec(f"app.set('filter', '{first}')", 60)
    for name in FILTERS:
        pico.mark_stack()
        pico.exec(f"app.set('filter', '{name}')", 60)
        stack = pico.stack_left()
        print(first, name, stack)
        assert stack > STACK, name
        pico.exec(f"app.set('filter', '{first}')", 60)
    assert says(pico) == ["True", "False", first]


def test_what_has_no_room_is_refused_soon_and_the_loop_goes_on(micropython):
    pico = started(micropython)
    pico.exec("held = [bytearray(2000) for _ in range(5)]", 60)
    for running in ("attitude", "kalman2", "float.kalman"):
        pico.exec(f"app.set('filter', '{running}')", 60)
        for _ in range(2):
            pico.mark_stack()
            began = pico.nanos
            with pytest.raises(PicoError, match="no room for float"):
                pico.exec("app.set('filter', 'float.attitude')", 60)
            assert pico.stack_left() > STACK
            assert pico.nanos - began < 10e9  # a float filter leaves little time
            assert says(pico) == ["True", "False", running]
    pico.exec("del held; app.config.set('filter', 'float.attitude'); app.save()", 60)  # as it says
    pico.reset()
    pico.exec("from firmware.app import App\napp = App()\napp.start()", 60)
    assert says(pico) == ["True", "False", "float.attitude"]


def test_the_names_are_those_of_the_code():
    assert names.PATH.read_text() == names.text(), "python -m tools.names"

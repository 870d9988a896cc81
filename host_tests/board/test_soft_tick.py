# SPDX-License-Identifier: MIT
"""Soft ticks of the emulated Pico (MicroPython 1.25) while nobody is at the REPL."""

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Sequence, Sinusoid, Still
from tools.virtual.pico import VirtualPico

START = """
from uctypes import addressof
from firmware.apps import platform
app = platform.start()
print(addressof(app.tick.words), addressof(app.tick.timing.words))
"""
MOVES = Sequence((Still(), 3.0), (Sinusoid(15.0, 0.8, "roll"), 1e9))


def test_hardly_a_burst_is_read_too_late_while_the_board_is_left_alone():
    """The waiting REPL calls one scheduled function for each event that wakes it. Were one left
    over, each burst would be begun when it is to be read, and read when it is too old."""
    bus = Bus(MPU6050Chip(MOVES, seed=1, gyro_bias_dps=(1.0, -1.0, 0.5)))
    with VirtualPico(bus=bus, root=True, main=False, micropython="1.25.0") as pico:
        words, timing = map(int, pico.exec(START, 30).split()[-2:])
        before = pico.word(words + 16), pico.word(timing + 20)
        pico.run_ms(4000)
        predicted = pico.word(words + 16) - before[0]
        ticks = pico.word(timing + 20) - before[1]
        print(f"{predicted} predicted of {ticks} ticks")
        assert predicted < 20 and 990 <= ticks <= 1001

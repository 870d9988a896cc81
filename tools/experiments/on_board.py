# SPDX-License-Identifier: MIT
"""Measure on the emulated RP2040 with the real firmware: time and heap of a step, and programs."""

import ast
from contextlib import contextmanager

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico

# measure(f): least microseconds of f() net of an empty call, and the heap bytes of one call
MEASURE = """
import gc, micropython, time

def _nothing():
    pass

def _least(f, n):
    best = 1 << 29
    for _ in range(n):
        began = time.ticks_us()
        f()
        best = min(best, time.ticks_diff(time.ticks_us(), began))
    return best

def measure(f, n=8):
    f()
    f()
    gc.collect()
    gc.disable()
    before = gc.mem_alloc()
    f()
    used = gc.mem_alloc() - before
    before = gc.mem_alloc()
    _nothing()
    used -= gc.mem_alloc() - before
    us = _least(f, n) - _least(_nothing, n)
    gc.enable()
    return us, used
"""


@contextmanager
def board(motion=None, files=None, **chip):
    """A Pico with the project on its flash, nothing running, the sensor on its bus."""
    device = MPU6050Chip(motion=motion, **chip)
    with VirtualPico(bus=Bus(device), root=True, main=False, files=files) as pico:
        yield pico


def run(pico, code, timeout_s=60):
    """Run code (with measure() at hand) and return the value that its last line printed."""
    return ast.literal_eval(pico.exec(MEASURE + code, timeout_s=timeout_s).strip().split("\n")[-1])

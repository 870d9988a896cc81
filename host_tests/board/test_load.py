# SPDX-License-Identifier: MIT
"""A 1 kHz timer under each load: the hard one of 1.26 keeps its grid, the soft one of 1.25 not."""

import ast

import pytest

from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040.load import LOADS, under_load

MS = 60
_TIMER = """
import machine, time
from array import array
times, seen = array("i", [0] * 400), array("i", [0])
@micropython.native
def tick(timer, times=times, seen=seen, now=time.ticks_us):
    n = seen[0]
    if n < 400:
        times[n] = now()
        seen[0] = n + 1
hard = {"hard": True} if sys.implementation.version >= (1, 26) else {}
"""
_START = "seen[0] = 0; timer = machine.Timer(freq=1000, callback=tick, **hard)"
_STOP = "timer.deinit(); print([time.ticks_diff(t, times[0]) for t in times[:seen[0]]])"


@pytest.fixture(scope="module")
def board(micropython):
    with VirtualPico(micropython=micropython) as pico:
        pico.exec("import micropython, sys\n" + _TIMER)
        yield pico


def _lateness_us(board, load):
    """(rounds of the load, [us of each tick behind its instant]) at 1 kHz."""
    board.exec(_START)
    begun = board.nanos
    rounds = under_load(board, load, MS)
    assert board.nanos - begun >= MS * 1_000_000
    times = ast.literal_eval(board.exec(_STOP))
    due = [round(t / 1000) * 1000 for t in times]
    lost = round(times[-1] / 1000) + 1 - len(set(due))
    return rounds, lost, [t - at for t, at in zip(times, due)]


@pytest.mark.parametrize("load", LOADS)
def test_a_load_keeps_the_foreground_busy_and_the_hard_timer_on_its_grid(board, load):
    rounds, lost, late_us = _lateness_us(board, load)
    assert len(late_us) > MS * 0.6
    assert rounds >= (3 if load != "idle" else 0)
    if board.version >= (1, 26):
        assert lost == 0
        assert max(map(abs, late_us)) <= 20
    elif load == "collecting":
        assert max(map(abs, late_us)) > 300  # a collection moves a soft one


def test_a_load_of_ones_own(board):
    rounds, _, _ = _lateness_us(board, "\n        total = sum(range(100))")
    assert rounds > 50

# SPDX-License-Identifier: MIT
"""Wrong wirings on the real firmware: what the message names, and that the REPL is there."""

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.pico import VirtualPico

START = """
from firmware.board import find
from firmware.config import Config
from firmware.startup import sensor
def attempt():
    try:
        sensor(find(), Config())
        print('found')
    except OSError as error:
        print(error.args[0], error.args[1])
"""


@pytest.fixture(scope="module")
def board():
    with VirtualPico(bus=Bus(MPU6050Chip(seed=1)), root=True, main=False) as pico:
        pico.exec(START)
        yield pico


def seen(board):
    """What the board says it saw, after the driver's own words."""
    printed = board.exec("attempt()")
    assert "MPU6050" in printed.partition("Seen:")[0]
    assert "Check:" in printed
    return printed.partition("Seen:")[2]


def test_the_right_wiring_is_found(board):
    assert board.exec("attempt()") == "found\n"


def test_no_device(board):
    devices, board.bus.devices = board.bus.devices, []
    text = seen(board)
    board.bus.devices = devices
    assert "no device answers" in text and "VCC" in text and "GP4" in text


def test_another_address(board):
    board.bus.devices[0].address = 0x69
    text = seen(board)
    board.bus.devices[0].address = 0x68
    assert "found: 0x69" in text and "AD0" in text


@pytest.mark.parametrize("fault, line", [("sda_held", "SDA"), ("timeout", "SCL")])
def test_a_line_held_low(board, fault, line):
    parameters = {"clocks": 10**9} if fault == "sda_held" else {}
    board.bus.faults.append(make(fault, at_s=board.nanos / 1e9, **parameters))
    text = seen(board)
    board.bus.faults.clear()
    assert f"{line} held low" in text and "GND" in text
    assert board.exec("attempt()") == "found\n"  # and nothing is left of it


def test_swapped_wires():
    with VirtualPico(bus=Bus(MPU6050Chip()), sda=5, scl=4, root=True, main=False) as pico:
        pico.exec(START)
        assert "SDA and SCL are swapped" in seen(pico)


def test_nothing_connected():
    with VirtualPico(bus=None, root=True, main=False) as pico:
        pico.exec(START)
        assert "no pull-up on SDA and SCL" in seen(pico)

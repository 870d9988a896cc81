# SPDX-License-Identifier: MIT
"""Fixtures for tests on the emulated board. Without a firmware image they fail; none is skipped.

A boot takes half a second, so a module shares one board; what a test leaves in the board's RAM
the next one finds.
"""

import os

import pytest

from host_tests.virtual.port_rig import Ram
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.images import VERSIONS
from tools.virtual.pico import VirtualPico

# An image that the environment names runs in place of all, so once.
RELEASES = VERSIONS[:1] if os.environ.get("PLUMB_FIRMWARE") else VERSIONS


@pytest.fixture(scope="module", params=RELEASES)
def micropython(request):
    """The release that a board runs: whoever asks for it is run once with each."""
    return request.param


@pytest.fixture(scope="module")
def plain_board(micropython):
    """(board, its device, its bus) with 256 plain registers in the sensor's place."""
    device = Ram()
    bus = Bus(device)
    with VirtualPico(bus=bus, micropython=micropython) as board:
        yield board, device, bus


@pytest.fixture(scope="module")
def chip():
    """The MPU6050 on the board's bus: still, level, at 25 degC."""
    return MPU6050Chip(seed=1)


@pytest.fixture(scope="module")
def bus(chip):
    return Bus(chip)


@pytest.fixture(scope="module")
def pico(bus):
    """A board with the chip on I2C0 (GP4, GP5, INT on GP6) and the project on its flash.

    main.py is not on it, so nothing runs yet.
    """
    with VirtualPico(bus=bus, root=True, main=False) as board:
        yield board

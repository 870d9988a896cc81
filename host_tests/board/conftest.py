# SPDX-License-Identifier: MIT
"""Fixtures for tests on the emulated board. Without a firmware image they fail; none is skipped.

A boot takes half a second, so a module shares one board; what a test leaves in the board's RAM
the next one finds.
"""

import pytest

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.pico import VirtualPico


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

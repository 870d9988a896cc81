# SPDX-License-Identifier: MIT
"""MicroPython's world on CPython: checked viper, virtual clock, `machine` with the personality of
a port.
"""

import sys

from tools.virtual.viper import ViperTypeError, install_types

from .micropython import make_module
from .outputs import VirtualReset
from .port import Port


def install_micropython():
    """Provide `micropython` and the names that viper annotations need, so that board code imports
    on a PC.
    """
    install_types()
    return sys.modules.setdefault("micropython", make_module())


__all__ = ["Port", "ViperTypeError", "VirtualReset", "install_micropython"]

# SPDX-License-Identifier: MIT
"""MicroPython's world on CPython: checked viper, virtual clock, `machine` with the personality of
a port.
"""

import sys

from tools.virtual.viper import ViperTypeError, install_types, unchecked

from .micropython import make_module
from .outputs import VirtualReset
from .port import Port


def install_micropython(checked=True):
    """Provide `micropython` and the names that viper annotations need, so that board code imports
    on a PC. Not `checked`: viper code runs ten times as fast, and nothing looks at what it does.
    """
    install_types()
    module = sys.modules.setdefault("micropython", make_module())
    if not checked:
        module.viper = unchecked.viper
    return module


__all__ = ["Port", "ViperTypeError", "VirtualReset", "install_micropython"]

# SPDX-License-Identifier: MIT
"""MicroPython's world on CPython: checked viper, virtual clock, `machine` with the personality of
a port.
"""

import gc
import sys

from tools.virtual.viper import ViperTypeError, install_types, unchecked

from .micropython import make_module
from .outputs import VirtualReset
from .port import Port


def install_micropython(checked=True):
    """Provide `micropython` and the names that viper annotations need, so that board code imports
    on a PC. Not `checked`, in a process that has none yet: viper code runs twice as fast, and
    nothing looks at what it does.
    """
    install_types()
    if not hasattr(gc, "threshold"):  # of no effect here; a Port has one of its own
        setattr(gc, "threshold", lambda *amount: None if amount else -1)  # noqa: B010
    if "micropython" not in sys.modules:
        module = sys.modules["micropython"] = make_module()
        if not checked:
            module.viper = unchecked.viper
    return sys.modules["micropython"]


__all__ = ["Port", "ViperTypeError", "VirtualReset", "install_micropython"]

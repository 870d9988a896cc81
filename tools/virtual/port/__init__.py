# SPDX-License-Identifier: MIT
"""MicroPython's world on CPython."""

import builtins
import sys
import types


def install_micropython():
    """Provide `micropython` and the names that viper annotations need, so that `attitude.fixed` imports on a PC."""
    if "micropython" in sys.modules:
        return sys.modules["micropython"]
    module = types.ModuleType("micropython")
    module.const = module.native = module.viper = lambda x: x
    for name in ("ptr", "ptr8", "ptr16", "ptr32", "uint"):
        if not hasattr(builtins, name):
            setattr(builtins, name, lambda value: value)
    sys.modules["micropython"] = module
    return module

# SPDX-License-Identifier: MIT
"""Integer twins of the controllers: the same verbs, no allocation in update().

Needs lib/attitude beside it, which knows what compilers get wrong.
"""

import attitude.fixed  # noqa: F401  raises where viper was compiled wrongly

_HOME = {"PID": "pid", "QuadControl": "quad"}


def __getattr__(name):
    home = _HOME.get(name)
    if home is None:
        raise AttributeError("control.fixed has no %s" % name)
    value = getattr(__import__("control.fixed." + home, None, None, (name,)), name)
    globals()[name] = value
    return value

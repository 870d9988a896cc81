# SPDX-License-Identifier: MIT
"""Integer twins of the controllers: the same verbs, no allocation in update()."""

_HOME = {"PID": "pid", "QuadControl": "quad"}


def __getattr__(name):
    home = _HOME.get(name)
    if home is None:
        raise AttributeError("control.fixed has no %s" % name)
    value = getattr(__import__("control.fixed." + home, None, None, (name,)), name)
    globals()[name] = value
    return value

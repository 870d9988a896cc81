# SPDX-License-Identifier: MIT
"""Modules that are wanted for a moment: code that nobody runs is heap that nobody has; and those
that stay: not strewn over the heap, between garbage."""

import gc
import sys

_SHORT = 64000  # bytes of heap
_heard = []  # type: list  # something: firmware.names


class Lasting:
    """`with Lasting(): from firmware.stream import Stream`: what is loaded here lies together, by
    frequent collections; without them where a soft tick would wait for each (wanted=False)."""

    def __init__(self, wanted=True):
        self.on = wanted

    def __enter__(self):
        self._kept = gc.threshold()
        if self.on:
            gc.threshold(8192)

    def __exit__(self, *error):
        gc.threshold(self._kept)


class Briefly:
    """`with Briefly("firmware.store"): from firmware import store`: what is loaded inside of these
    names is forgotten after it, and its heap is free at the next collection. What was there
    before stays: its classes are somebody's. Nobody may keep a function of such a module.
    """

    def __init__(self, *names):
        self._names = list(names)

    def __enter__(self):
        self._names = [name for name in self._names if name not in sys.modules]

    def __exit__(self, *error):
        forget(self._names)


def forget(names):
    """The modules of these names are to be loaded anew when they are next wanted; nobody's classes
    change by that."""
    for name in names:
        if name in sys.modules:
            del sys.modules[name]
            package, _, own = name.rpartition(".")
            if hasattr(sys.modules.get(package), own):  # not where its loading failed
                delattr(sys.modules[package], own)


def hear_names():
    """To be called before much code is loaded beside an app.

    MicroPython keeps each name that it has heard, in pools of 20, 40, ... 640; the one for the
    1261st takes 9 KB in one piece. A short heap has that for the first code that is loaded beside
    the app, but not after some: so it is made ahead of it.
    """
    if _heard or not hasattr(gc, "mem_free") or gc.mem_free() > _SHORT:
        return
    _heard.append(1)
    gc.collect()
    try:
        from firmware.names import hear

        hear()
    except MemoryError:  # then what comes finds none either, and says so
        gc.collect()
    forget(("firmware.names",))

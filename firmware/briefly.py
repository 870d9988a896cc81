# SPDX-License-Identifier: MIT
"""Modules that are wanted for a moment: code that nobody runs is heap that nobody has; and those
that stay: not strewn over the heap, between garbage."""

import gc
import sys

_SHORT = 64000  # bytes of heap
_due = []  # type: list  # something while the pool of names is to be made


class Lasting:
    """`with Lasting(): from firmware.stream import Stream`: what is loaded here lies together, by
    frequent collections; without them where a soft tick would wait for each (wanted=False)."""

    def __init__(self, wanted=True):
        self.on = wanted

    def __enter__(self):
        if _due:
            _names_ahead()
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
        if _due:
            _names_ahead()
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


def beside_app(soft):
    """From now on what is loaded is so beside an app that runs; soft: each moment of that holds up
    its ticks.

    MicroPython keeps each name that it has heard, in pools of 20, 40, ... 640; the one for the
    1261st takes 9 KB in one piece. A short heap has that for the first code that is loaded then,
    but not after some: so it is made ahead of it.
    """
    if gc.mem_free() < _SHORT:
        _due.append(1)
        if soft:
            _names_ahead()


def _names_ahead():
    _due.clear()
    gc.collect()
    from firmware import names

    del names
    forget(("firmware.names",))

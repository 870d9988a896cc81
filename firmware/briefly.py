# SPDX-License-Identifier: MIT
"""Modules that are wanted for a moment: code that nobody runs is heap that nobody has; and those
that stay: not strewn over the heap, between garbage."""

import gc
import sys


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
        for name in self._names:
            if name in sys.modules:
                del sys.modules[name]
                package, _, own = name.rpartition(".")
                if hasattr(sys.modules.get(package), own):  # not where its loading failed
                    delattr(sys.modules[package], own)

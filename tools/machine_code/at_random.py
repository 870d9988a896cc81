# SPDX-License-Identifier: MIT
"""A program that calls every function of numbers and pointers with numbers and buffers at random.

What the checked viper refuses, as no board may be given it, does not count.
"""

import importlib
import random
import signal
from array import array

from . import functions

_CALLS = 60  # of each function
_ELEMENTS = 200  # of a buffer
_PATIENCE_S = 1.0
_CODES = {"ptr16": ("h", 15), "ptr32": ("i", 31)}  # array type and bits; else bytes


def at_random(port):
    """Every function of numbers and pointers, on numbers and buffers at random."""
    rng = random.Random(7)
    for path in functions.sources():
        found = [f for f in functions.find(path) if f.types and not f.inner and all(f.types)]
        space = port.run_file(path) if path == functions.SNIPPETS else None
        for function in found:
            module = functions.module_name(path)
            name = function.name.removeprefix(module + ".")
            if "." in name:
                continue
            space = space or vars(importlib.import_module(module))
            for _ in range(_CALLS):
                _try(space[name], [_random(rng, kind) for kind in function.types])


def _random(rng, kind):
    """An argument of a type; half of the buffers are small numbers, so that products fit."""
    if kind.startswith("ptr"):
        code, bits = _CODES.get(kind, ("B", 8))
        low, high = (0 if code == "B" else -(1 << bits)), 1 << bits
        if rng.random() < 0.5:
            low, high = max(low, -50), 64
        return array(code, [rng.randrange(low, high) for _ in range(_ELEMENTS)])
    if kind == "object":
        return [rng.randrange(-50, 1000) for _ in range(rng.randint(2, 9))]
    bits = rng.choice((3, 5, 8, 15, 16, 30, 31))
    if kind == "uint":
        return rng.randrange(2 << bits)
    return rng.randrange(-(1 << bits), 1 << bits)


class _Endless(BaseException):
    """The function was given numbers with which it does not end soon: no outcome of it."""


def _try(function, arguments):
    """Call; input that the checked viper refuses, or that takes for ever, is none."""

    def stop(_signal, _frame):
        raise _Endless

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, _PATIENCE_S)
    try:
        function(*arguments)
    except (OverflowError, IndexError, ZeroDivisionError, _Endless):
        pass
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)

# SPDX-License-Identifier: MIT
"""The `micropython` module for CPython: identity decorators, checked viper, the schedule queue,
heap lock counters.
"""

import types

from tools.virtual.viper import ViperTypeError, viper

__all__ = ["ViperTypeError", "make_module"]


def _identity(value):
    return value


class _Heap:
    """`heap_lock()` counts, as on the board; nothing on CPython stops an allocation, the emulated
    board's tests do.
    """

    def __init__(self):
        self.depth = 0

    def lock(self):
        self.depth += 1

    def unlock(self):
        self.depth = max(0, self.depth - 1)
        return self.depth


class _Setting:
    """A function that stores its argument and returns it when called without."""

    def __init__(self, value):
        self.value = value

    def __call__(self, value=None):
        if value is not None:
            self.value = value
            return None
        return self.value


def _schedule_at_once(function, argument):
    function(argument)


def _no_assembler(_function):
    raise SyntaxError("invalid micropython decorator")  # as without the processor it is for


def make_module(scheduler=None):
    """Return a new `micropython` module; without a `scheduler` what is scheduled runs at once."""

    def schedule(function, argument, /):
        if not scheduler.offer(function, argument):
            scheduler.dropped -= 1  # refused aloud, so not a silent drop
            raise RuntimeError("schedule queue full")

    heap = _Heap()
    module = types.ModuleType("micropython", "MicroPython's own functions, on CPython.")
    module.const = module.native = module.bytecode = _identity
    module.viper = viper
    module.asm_thumb = _no_assembler
    module.schedule = schedule if scheduler else _schedule_at_once
    module.heap_lock, module.heap_unlock = heap.lock, heap.unlock
    module.alloc_emergency_exception_buf = lambda size, /: None
    module.opt_level = _Setting(0)
    module.kbd_intr = lambda character, /: None
    module.mem_info = module.qstr_info = lambda verbose=0, /: None
    module.stack_use = lambda: 0
    return module

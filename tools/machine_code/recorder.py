# SPDX-License-Identifier: MIT
"""Calls of viper and native functions, written down with all they are given and leave behind.

While programs run on a virtual board, its decorators `micropython.viper` and `native` are these:
each function is executed by the checked viper as ever, and some of its calls are kept.
"""

import builtins
import functools
import inspect
import random
import sys
import types
from typing import NamedTuple

from . import tape
from .faults import Impure
from .snapshot import Copier, Opaque, picture
from .virtual import address_space

_ALL = 40  # the first calls of a function that are kept, each one
_MOST = 120  # kept at a time; later ones take the place of earlier ones by chance
_PURE = {"array", "math", "struct"}  # modules without a world of their own
# (module, function) of the board whose results can be played back
_OUTSIDE = (("time", "ticks_us"), ("time", "ticks_ms"), ("micropython", "schedule"))
# what the checked viper says of input that no board may be given
_REFUSALS = (OverflowError, IndexError, ZeroDivisionError)


class Call(NamedTuple):
    """One call: `arguments` (a copy, from before), and the picture of what it came to.

    globals: of the function; outcome: ("returns", picture) or ("raises", type, first argument);
    after: picture of the arguments then; hardware: entries of a tape.
    """

    globals: dict
    arguments: tuple
    outcome: tuple
    after: dict
    hardware: tuple


def _no_import(name, *_more):
    raise Impure("it imports %s" % name)


def _cut_off(variables, folders):
    """Make a module's imports, and what it has imported of the board, Opaque."""
    own = variables.get("__builtins__", vars(builtins))
    if own is vars(builtins):  # not loaded by a board
        return
    own["__import__"] = _no_import
    for name, value in variables.items():
        if type(value) in (types.ModuleType, types.FunctionType):
            home = getattr(value, "__module__", None) or value.__name__
            if home.partition(".")[0] not in folders | _PURE:
                known = {n: v for n, v in vars(value).items() if type(v) is tape.Outside}
                variables[name] = Opaque(name, **known)


class Recorder:
    """`calls` {(file, line of the decorator): [Call]}.

    folders: modules whose objects are copied, others are left out.
    """

    def __init__(self, folders):
        self.folders = {"__main__", *folders}  # __main__: what Port.run_file runs
        self.calls = {}
        self.recording = True
        self._met = {}
        self._random = random.Random(1)
        self.hardware = tape.Log(address_space)
        address_space.insert(0, self.hardware)

    def close(self):
        """Stop: from now on the functions are for Bench.run."""
        self.recording = False
        for calls in self.calls.values():
            for call in calls:
                _cut_off(call.globals, self.folders)

    def leave(self):
        """The programs on a board have ended: what its code has of the outside is opaque now."""
        for name, module in list(sys.modules.items()):
            if name.partition(".")[0] in self.folders - {"__main__"}:
                _cut_off(vars(module), self.folders)

    def attach(self, port):
        """Make a Port's decorators those of this recorder, and its time and its queue known to
        the tape. Before board code is imported.
        """
        module = port.modules["micropython"]
        module.viper = functools.partial(self._decorate, module.viper)
        module.native = functools.partial(self._decorate, module.native)
        for home, name in _OUTSIDE:
            home = port.modules[home]
            setattr(home, name, tape.Outside(name, getattr(home, name), self.hardware))

    def _decorate(self, decorator, function):
        checked = decorator(function)
        code = function.__code__
        key = code.co_filename, code.co_firstlineno

        if function.__closure__:  # made of more than its arguments: no copy of a call is whole
            return checked

        @functools.wraps(function)
        def recorded(*arguments, **keywords):
            if not self.recording or not self._wanted(key):
                return checked(*arguments, **keywords)
            bound = inspect.signature(function).bind(*arguments, **keywords)
            bound.apply_defaults()
            return self._record(key, function.__globals__, checked, bound.args)

        recorded.checked = checked
        return recorded

    def _wanted(self, key):
        """Whether to keep this call: the first ones, then ever fewer."""
        n = self._met[key] = self._met.get(key, 0) + 1
        return n <= _ALL or self._random.random() < 4 * _ALL / n

    def _record(self, key, variables, checked, arguments):
        before = Copier(self.folders).copy(arguments)
        log, was_on = self.hardware, self.hardware.on
        log.on, start = True, len(log.entries)
        result = error = None
        try:
            result = checked(*arguments)
            outcome = "returns", picture(result, self.folders)
        except _REFUSALS:
            raise
        except Exception as raised:
            error = raised
            outcome = "raises", type(error).__name__, (error.args or (None,))[0]
        finally:
            log.on = was_on
        after = picture(arguments, self.folders)
        call = Call(variables, before, outcome, after, tuple(log.entries[start:]))
        kept = self.calls.setdefault(key, [])
        if len(kept) < _MOST:
            kept.append(call)
        else:
            kept[self._random.randrange(_ALL, _MOST)] = call
        if error is not None:
            raise error
        return result

# SPDX-License-Identifier: MIT
"""Whether the machine code of a function does what the checked viper did, call by call."""

from typing import NamedTuple

from . import compilers, functions
from .faults import Impure, MachineFault
from .machine import Native
from .mpy import Mpy
from .processors import Processor
from .snapshot import Copier, picture
from .tape import Replay


class Verdict(NamedTuple):
    """What came of one function's calls.

    equal: None when it was not tried: `text` says why; False: `text` says what is wrong.
    calls: so many were equal; instructions: of them; coverage: see Native.coverage().
    """

    function: str
    equal: bool | None
    text: str = ""
    calls: int = 0
    instructions: int = 0
    coverage: tuple = (0, 0)


class Bench:
    """One compiler for one processor, and the recorder whose calls are run."""

    def __init__(self, recorder, arch, version):
        self.recorder, self.arch, self.version = recorder, arch, version
        self.processor = Processor(arch)
        self._parsed = {}
        self._right = None  # the pinned compiler's Bench, made when something is wrong

    def natives(self, path):
        """{function: Native} of a file. CompileError."""
        if path not in self._parsed:
            data = compilers.compile_file(self.version, self.arch, path.read_text(), path.name)
            mpy = Mpy(data)
            functions.check_places(path, mpy.root)
            static = functions.static_names(self.version)
            names = [static.get(n, "name %d" % n) if isinstance(n, int) else n for n in mpy.names]
            self._parsed[path] = {
                f: Native(self.processor, mpy, names, functions.code_at(mpy, f.place),
                          self.recorder.folders)
                for f in functions.find(path)
            }  # fmt: skip
        return self._parsed[path]

    def calls(self, function):
        """The recorded calls of a function."""
        return self.recorder.calls.get((function.path, function.line), ())

    def run(self, native, call, trace=None):
        """Differences (texts) of a call on the machine from what was recorded. Impure."""
        native.globals = call.globals
        arguments = Copier(self.recorder.folders).copy(call.arguments)
        hardware = Replay(call.hardware)
        self.recorder.hardware.replay = hardware
        Impure.last = None
        try:
            result = native.call(arguments, hardware if call.hardware else None, trace)
            outcome = "returns", picture(result, self.recorder.folders)
        except Impure:
            raise
        except MachineFault as fault:
            at = " at " + native.instruction(fault.address) if fault.address else ""
            return [str(fault) + at]
        except Exception as error:
            outcome = "raises", type(error).__name__, (error.args or (None,))[0]
        finally:
            self.recorder.hardware.replay = None
        if Impure.last is not None:
            raise Impure.last
        after = picture(arguments, self.recorder.folders)
        return _differences(call, outcome, after, hardware)

    def judge(self, path, function):
        """The Verdict on a function of a file."""
        if function.inner and not self.calls(function):
            return Verdict(function.name, None, "it is made anew inside another function")
        if not self.calls(function):
            return Verdict(function.name, None, "no program here calls it")
        try:
            native = self.natives(path)[function]
        except compilers.CompileError as error:
            return Verdict(function.name, False, "does not compile: %s" % error)
        equal, instructions, reason = 0, 0, ""
        for number, call in enumerate(self.calls(function)):
            try:
                wrong = self.run(native, call)
            except Impure as error:
                reason = str(error)
                continue
            if wrong:
                text = "call %d: %s%s" % (number, wrong[0], self._where(path, function, call))
                return Verdict(function.name, False, text, equal, instructions)
            equal += 1
            instructions += native.count
        if not equal:
            return Verdict(function.name, None, reason)
        covered = native.coverage() if self.version == compilers.PINNED else (0, 0)
        return Verdict(function.name, True, "", equal, instructions, covered)

    def _where(self, path, function, call):
        """The first access that the pinned compiler's code does otherwise, as text, or ""."""
        if self.version == compilers.PINNED:
            return ""
        if self._right is None:
            self._right = Bench(self.recorder, self.arch, compilers.PINNED)
        own, right = self.natives(path)[function], self._right.natives(path)[function]
        ours, theirs = [], []
        try:
            self.run(own, call, ours)
            if self._right.run(right, call, theirs):
                return ""
        except Impure:
            return ""
        for here, there in zip(ours, theirs):
            if here[1:] != there[1:]:
                told = own.instruction(here[0]), _told(here), _told(there)
                return "; first: %s %s, right: %s" % told
        return ""


def _told(access):
    _at, what, buffer, offset, value = access
    where = " at byte %d of buffer %d" % (offset, buffer & 0xFF) if buffer else ""
    return "%s 0x%X%s" % (what, value, where)


def _differences(call, outcome, after, hardware):
    found = []
    if outcome != call.outcome:
        found.append("%s; right: %s" % (_short(outcome), _short(call.outcome)))
    places = dict.fromkeys([*call.after, *after]) if after != call.after else ()
    for place in places:
        ours, right = after.get(place), call.after.get(place)
        if ours != right:
            found.append("argument %s is %s, expected %s" % _apart(place, ours, right))
    if hardware.at < len(call.hardware):
        found.append("%d accesses outside, expected %d" % (hardware.at, len(call.hardware)))
    return found


def _apart(place, ours, right):
    """Place and contents; of two buffers the first element that differs."""
    if isinstance(ours, tuple) and isinstance(right, tuple) and len(ours) == len(right):
        for i, pair in enumerate(zip(ours, right)):
            if pair[0] != pair[1]:
                return ("%s[%d]" % (place, i), *pair)
    return place, ours, right


def _short(outcome):
    """An outcome as text: its number alone where it is one."""
    if outcome[0] == "raises":
        return "raises %s(%s)" % outcome[1:]
    whole = outcome[1].get("")
    return "returns %s" % (whole[-1] if isinstance(whole, list) else outcome[1],)


def job(recorder, arch, version, only=None):
    """The Verdicts on every function (of which `only`, a predicate, says yes)."""
    bench = Bench(recorder, arch, version)
    found = []
    for path in functions.sources():
        for function in functions.find(path):
            if only is None or only(function):
                found.append(bench.judge(path, function))
    return found

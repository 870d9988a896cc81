# SPDX-License-Identifier: MIT
"""Source compiled on the board by a MicroPython that gets viper wrong is refused, .mpy is not."""

import pytest

from tools.virtual import images
from tools.virtual.pico import PicoError, VirtualPico
from tools.virtual.rp2040 import flash

PACKAGES = ("attitude.fixed", "control.fixed")


def board(version, mpy):
    files = {
        path: content
        for path, content in flash.project_files(main=False).items()
        if path.startswith(("lib/attitude/", "lib/control/"))
    }
    return VirtualPico(files=files, mpy=mpy, image=images.rp2040_image(version))


@pytest.mark.parametrize("package", PACKAGES)
def test_1_26_refuses_what_it_compiled_itself(package):
    with board("1.26.1", mpy=False) as pico, pytest.raises(PicoError) as error:
        pico.exec(f"import {package}", timeout_s=20)
    assert "RuntimeError" in str(error.value)
    assert "Here runs 1.26.1" in str(error.value)
    assert "mpy-cross 1.28" in str(error.value)


@pytest.mark.parametrize("version, mpy", [("1.26.1", True), ("1.25.0", True), ("1.25.0", False)])
def test_sound_code_is_taken(version, mpy):
    with board(version, mpy) as pico:
        for package in PACKAGES:
            assert pico.exec(f"import {package}; print('good')", timeout_s=20) == "good\n"

# SPDX-License-Identifier: MIT
"""What deploy copies, and what it says when there is no board. The board itself: board/."""

import sys

import pytest

from tools import deploy


def test_no_board_ends_in_a_text_that_tells_what_to_check(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["deploy", "--port", "/dev/nobody"])
    assert deploy.main() == 1
    said = capsys.readouterr().err
    assert "no board at /dev/nobody" in said and "Check:" in said and "PORT=" in said


def test_a_missing_port_shows_the_command(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["deploy"])
    with pytest.raises(SystemExit):
        deploy.main()
    assert "make deploy PORT=" in capsys.readouterr().err


def test_the_project_as_source_and_compiled():
    source = deploy.project(None)
    assert {"boot.py", "main.py", "firmware/app.py", "lib/mpu6050/__init__.py"} <= set(source)
    assert not any(path.startswith(("tools", "host_tests")) for path in source)
    assert list(source)[-1] == "main.py"  # a copy cut short starts nothing
    compiled = deploy.project("xtensawin")
    assert {p.removesuffix(".mpy") + ".py" if p.endswith(".mpy") else p for p in compiled} == set(
        source
    )
    assert compiled["main.py"] == source["main.py"]
    assert compiled["firmware/app.mpy"][:2] == b"M\x06"  # mpy's mark and version


def test_the_architectures_are_micropythons():
    # py/persistentcode.h: ARMV6 is 3, ARMV6M 4, ... XTENSAWIN 10, RV32IMC 11
    assert deploy.ARCHITECTURES[4] == "armv6m"
    assert deploy.ARCHITECTURES[10] == "xtensawin"
    assert deploy.ARCHITECTURES[11] == "rv32imc"

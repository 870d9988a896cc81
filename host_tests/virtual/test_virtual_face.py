# SPDX-License-Identifier: MIT
"""`from tools.virtual import ...`: what it hands out, and what it must not need."""

import importlib
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from tools import virtual

ROOT = Path(virtual.__file__).resolve().parents[2]
FULL_NAMES = {
    "Bus": "tools.virtual.bus.Bus",
    "MPU6050Chip": "tools.virtual.chip.MPU6050Chip",
    "Port": "tools.virtual.port.Port",
    "VirtualPico": "tools.virtual.pico.VirtualPico",
    "install_micropython": "tools.virtual.port.install_micropython",
}
MODULES = {
    "faults": "tools.virtual.faults",
    "firmware": "tools.virtual.images",
    "motion": "tools.virtual.motion",
    "profiles": "tools.virtual.chip.profiles",
    "quaternions": "tools.virtual.motion.quaternions",
    "registers": "tools.virtual.chip.registers",
    "tolerances": "tools.virtual.chip.tolerances",
}


@pytest.mark.parametrize("name", FULL_NAMES)
def test_each_name_is_the_one_of_its_file(name):
    module, _, attribute = FULL_NAMES[name].rpartition(".")
    assert getattr(virtual, name) is getattr(importlib.import_module(module), attribute)


@pytest.mark.parametrize("name", MODULES)
def test_each_module_is_the_one_of_its_place(name):
    assert getattr(virtual, name) is importlib.import_module(MODULES[name])


def test_the_face_lists_all_of_it_and_no_more():
    assert set(virtual.__all__) == {*FULL_NAMES, *MODULES}
    assert set(virtual.__all__) <= set(dir(virtual))
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        virtual.nonsense  # noqa: B018
    with pytest.raises(ImportError):
        from tools.virtual import nonsense  # noqa: F401


def fresh(code):
    """Run `code` in a Python of its own, in which rp2040py is not installed."""
    blocked = "import sys\nsys.modules['rp2040py'] = None\n"
    command = [sys.executable, "-c", blocked + textwrap.dedent(code)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120)


def test_all_but_the_emulated_board_needs_no_emulator():
    names = [name for name in virtual.__all__ if name != "VirtualPico"]
    done = fresh(f"from tools.virtual import {', '.join(names)}\nprint(Port.__name__)")
    assert (done.returncode, done.stdout) == (0, "Port\n"), done.stderr
    done = fresh("from tools.virtual import VirtualPico")
    assert done.returncode == 1 and "rp2040py" in done.stderr


def test_the_face_alone_loads_nothing():
    done = fresh("""
        import tools.virtual
        print(sorted(name for name in sys.modules if name.startswith("tools.virtual.")))
    """)
    assert (done.returncode, done.stdout) == (0, "[]\n"), done.stderr


def example():
    lines = virtual.__doc__.splitlines()
    return textwrap.dedent("\n".join(x for x in lines if x.startswith("    ") or not x))


def run_test_of(source, folder):
    names = {}
    exec(source, names)
    next(value for name, value in names.items() if name.startswith("test_"))(folder)


def test_the_example_of_the_docstring_runs_and_can_fail(tmp_path):
    run_test_of(example(), tmp_path)
    tilted = example().replace("Still(roll_deg=10.0)", "Still(roll_deg=11.0)")
    with pytest.raises(AssertionError):
        run_test_of(tilted, tmp_path)
    unharmed = example().replace("at_s=2.5", "at_s=25.0")
    with pytest.raises(KeyError, match="nack"):  # stats() counts the causes that there were
        run_test_of(unharmed, tmp_path)

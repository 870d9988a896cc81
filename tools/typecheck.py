# SPDX-License-Identifier: MIT
"""Type-checks what runs on the board against the MicroPython stubs of both ports.

`python -m tools.typecheck` installs the pinned stubs beside the other caches on first use and
runs mypy over lib/, firmware/, boot.py and main.py once per port. Exit status 1 on any error.
"""

import shutil
import subprocess
import sys
from pathlib import Path

from tools.virtual.images import cache_dir

ROOT = Path(__file__).resolve().parent.parent
SOURCES = [ROOT / name for name in ("lib", "firmware", "boot.py", "main.py")]
PORTS = ("rp2", "esp32")
STUBS = "1.29.0.post1"
# The stubs know viper's pointers only in a file for another checker, and lack what viper adds.
_VIPER_TYPES = """
class ptr8:
    def __init__(self, source: object) -> None: ...
    def __getitem__(self, index: int) -> int: ...
    def __setitem__(self, index: int, value: int) -> None: ...
class ptr16(ptr8): ...
class ptr32(ptr8): ...
class uint(int): ...
"""


def stubs(port):
    """The folder with the stubs of a port ("rp2" or "esp32"), installed if it is not there."""
    folder = cache_dir() / "stubs" / f"{port}-{STUBS}"
    if folder.exists():
        return folder
    work = folder.with_suffix(".part")
    shutil.rmtree(work, ignore_errors=True)
    subprocess.run(
        [sys.executable, "-m", "pip", "install", "--quiet", "--target", str(work),
         f"micropython-{port}-stubs=={STUBS}"],
        check=True,
    )  # fmt: skip
    with open(work / "stdlib" / "builtins.pyi", "a") as f:
        f.write(_VIPER_TYPES)
    micropython = work / "micropython.pyi"
    text = micropython.read_text()
    # A viper function takes any buffer where it names a pointer, so its parameters stay open.
    open_text = text.replace(
        "def viper(_func: Callable[_Param, _Ret], /) -> Callable[_Param, _Ret]:",
        "def viper(_func: Callable[..., _Ret], /) -> Callable[..., _Ret]:",
    )
    if open_text == text:
        raise RuntimeError(f"{micropython}: viper's stub is not the one of version {STUBS}")
    micropython.write_text(open_text)
    work.rename(folder)
    return folder


def check(port, sources=SOURCES):
    """mypy's complaints about the sources for one port: a list of lines, empty when sound."""
    folder = stubs(port)
    config = Path(folder, "mypy.ini")
    # Bodies count although the board's code carries no annotations; None stands for "not yet".
    # Not asked: the order in which methods set attributes, a twin class imported under one name,
    # a constant of the base class that a subclass computes.
    options = (
        "check_untyped_defs = True\nstrict_optional = False\n"
        "disable_error_code = has-type, no-redef, override\n"
    )
    config.write_text(f"[mypy]\nmypy_path = {folder}:{ROOT / 'lib'}\n{options}")
    run = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", str(config), "--custom-typeshed-dir",
         str(folder), "--no-site-packages", "--platform", "linux", "--explicit-package-bases",
         "--cache-dir", str(cache_dir() / "mypy" / port), *map(str, sources)],
        capture_output=True, text=True, cwd=ROOT,
    )  # fmt: skip
    if run.returncode not in (0, 1) or not run.stdout:
        raise RuntimeError(f"mypy did not run:\n{run.stdout}{run.stderr}")
    # The stubs have errors of their own, which do not count; the last line is mypy's sum.
    return [line for line in run.stdout.splitlines()[:-1] if str(folder) not in line]


def main():
    failed = 0
    for port in PORTS:
        complaints = check(port)
        failed += len(complaints)
        print("\n".join(complaints + [f"{port}: {len(complaints)} errors"]))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())

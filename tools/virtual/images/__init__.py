# SPDX-License-Identifier: MIT
"""MicroPython itself, for the virtual boards: found, else downloaded, else built.

`python -m tools.virtual.images [rp2|unix|rv32|all]` gets the images and prints their paths.
A UF2 named by $PLUMB_FIRMWARE goes before everything; the rest is kept in $PLUMB_CACHE (or
~/.cache/plumb). Building needs a Debian machine and its mirror, nothing else (recipes.py).
"""

import os
import urllib.request
from pathlib import Path

from tools.virtual.images import qemu, recipes
from tools.virtual.images.releases import DEFAULT, VERSIONS, find, image_version, is_uf2
from tools.virtual.images.workshop import FirmwareError, cache_dir, one_builder, publish, say

__all__ = [
    "DEFAULT",
    "VERSIONS",
    "FirmwareError",
    "cache_dir",
    "frozen_image",
    "image_version",
    "rp2040_image",
    "run_rv32",
    "rv32_micropython",
    "unix_micropython",
]

DOWNLOAD_S = 10


def rp2040_image(version=DEFAULT):
    """Path of the UF2 for a Raspberry Pi Pico, of one of VERSIONS ($PLUMB_FIRMWARE: of its own).

    FirmwareError when there is no way to it.
    """
    named = os.environ.get("PLUMB_FIRMWARE")
    if named:
        path = Path(named)
        if not path.is_file() or not is_uf2(path.read_bytes()):
            raise FirmwareError(f"PLUMB_FIRMWARE={named}: not a UF2 file")
        return path
    release = find(version)
    name = f"micropython-{version}-RPI_PICO.uf2"
    return _kept(
        name, lambda: _official(release, name) or recipes.build_rp2(name, version=version)
    )


def unix_micropython():
    """Path of MicroPython as a program for this machine: the fast one, for long runs.

    On x86-64 it is built for 32 bits, so that small ints and viper wrap as on the boards; its
    floats are doubles. On other machines it has that machine's width.
    """
    return _kept(f"micropython-{DEFAULT}-unix", recipes.build_unix)


def rv32_micropython():
    """Path of MicroPython for QEMU's 32-bit RISC-V machine, an ELF file."""
    return _kept(f"micropython-{DEFAULT}-rv32.elf", recipes.build_rv32)


def run_rv32(files, script, timeout_s=60):
    """Run `script` on the RISC-V MicroPython; what it printed.

    `files` are {path: text, bytes or Path} that it can import, e.g. {"attitude/tilt.py": ...}.
    RuntimeError with the traceback when it raises. There is no `time` module on that board.
    """
    return qemu.run_script(rv32_micropython(), files, script, timeout_s)


def frozen_image(name, manifest, board="RPI_PICO", board_dir=None, version=DEFAULT):
    """Build a UF2 `name` in the cache with `manifest` frozen in; always built anew."""
    with one_builder():
        return recipes.build_rp2(name, manifest, board, board_dir, version)


def _kept(name, make):
    path = cache_dir() / name
    if not path.exists():
        with one_builder():
            if not path.exists():
                make()
    return path


def _official(release, name):
    """The release's own image, from the project's site; None where there is no way to it."""
    say(f"trying {release.official}")
    try:
        with urllib.request.urlopen(release.official, timeout=DOWNLOAD_S) as answer:
            data = answer.read()
    except OSError as error:
        say(f"not reachable ({error}); building it")
        return None
    if not is_uf2(data):
        say("that was no UF2 file; building it")
        return None
    fetched = cache_dir() / "fetched.uf2"
    fetched.write_bytes(data)
    try:
        return publish(fetched, name)
    finally:
        fetched.unlink()

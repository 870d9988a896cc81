# SPDX-License-Identifier: MIT
"""uPlot, the quick chart, from npm into the cache; None where it cannot be had."""

import shutil
import subprocess
import tarfile
import tempfile
from pathlib import Path

from tools.virtual.images.workshop import cache_dir

VERSION = "1.6.32"
FILES = ("uPlot.iife.min.js", "uPlot.min.css")
FETCH_S = 120


def uplot(fetch=True):
    """The folder with FILES, or None: then the page draws more slowly with a chart of NiceGUI."""
    folder = cache_dir() / f"uplot-{VERSION}"
    if all((folder / name).is_file() for name in FILES):
        return folder
    if not fetch or shutil.which("npm") is None:
        return None
    with tempfile.TemporaryDirectory() as work:
        command = ["npm", "pack", "--silent", f"uplot@{VERSION}"]
        try:
            subprocess.run(command, cwd=work, check=True, timeout=FETCH_S, capture_output=True)
            [archive] = Path(work).glob("*.tgz")
            folder.mkdir(parents=True, exist_ok=True)
            with tarfile.open(archive) as tar:
                for name in FILES:
                    source = tar.extractfile(f"package/dist/{name}")
                    (folder / name).write_bytes(source.read())
        except (OSError, subprocess.SubprocessError, KeyError, ValueError):
            return None
    return folder

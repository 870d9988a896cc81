# SPDX-License-Identifier: MIT
"""MicroPython images."""
import os
from pathlib import Path


def cache_dir():
    path = Path(os.environ.get("PLUMB_CACHE") or Path.home() / ".cache" / "plumb")
    path.mkdir(parents=True, exist_ok=True)
    return path


def rp2040_image():
    return cache_dir() / "micropython-1.25.0-RPI_PICO.uf2"

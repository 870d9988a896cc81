# SPDX-License-Identifier: MIT
"""The MicroPython releases that the virtual boards run, and where each can be had."""

import re
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from tools.virtual.images.workshop import FirmwareError

SDK_SUITE = "trixie"  # pico-sdk 2.1.1 builds all of these; sid's 2.2.0 lacks a header they want
UF2_BLOCK, UF2_DATA = 512, 32  # bytes of a block, of its head; a block's head says how many it has
UF2_MAGIC = b"UF2\n\x57\x51\x5d\x9e"


class Release(NamedTuple):
    """`date` is in the official image's name and in the banner; `suites` have the sources."""

    version: str
    date: str
    suites: tuple

    @property
    def official(self):
        """Address of the project's own image for the Raspberry Pi Pico."""
        name = f"RPI_PICO-{self.date}-v{self.version}.uf2"
        return f"https://micropython.org/resources/firmware/{name}"

    @property
    def epoch(self):
        """Seconds since 1970 of the release's day, as text: what SOURCE_DATE_EPOCH wants."""
        day = datetime.strptime(self.date, "%Y%m%d").replace(tzinfo=UTC)
        return str(int(day.timestamp()))


_TABLE = (
    Release("1.25.0", "20250415", (SDK_SUITE,)),  # timers are soft
    Release("1.26.1", "20250911", ("forky", "sid")),  # the first ones with hard timers: 1.26
)
RELEASES = {release.version: release for release in _TABLE}
VERSIONS = tuple(RELEASES)
DEFAULT = VERSIONS[0]


def find(version):
    """The Release of a version as text; FirmwareError for one that is not in the table."""
    if version not in RELEASES:
        raise FirmwareError(f"no MicroPython {version} here; choose from {', '.join(VERSIONS)}")
    return RELEASES[version]


def is_uf2(data):
    """Whether every block of `data` is a UF2 block."""
    blocks = range(0, len(data), UF2_BLOCK)
    return len(data) >= UF2_BLOCK and all(data[at : at + 8] == UF2_MAGIC for at in blocks)


def image_version(path):
    """(major, minor, micro) of the MicroPython in a UF2, read from its banner; FirmwareError."""
    data = Path(path).read_bytes()
    blocks = (data[at : at + UF2_BLOCK] for at in range(0, len(data), UF2_BLOCK))
    flash = b"".join(
        block[UF2_DATA : UF2_DATA + int.from_bytes(block[16:20], "little")] for block in blocks
    )
    found = re.search(rb"MicroPython v(\d+)\.(\d+)\.(\d+)", flash)
    if found is None:
        raise FirmwareError(f"{path}: no banner of a MicroPython in it")
    return tuple(map(int, found.groups()))

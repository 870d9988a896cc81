# SPDX-License-Identifier: MIT
"""`python -m tools.virtual.images [rp2|unix|rv32|all]`: gets the images, prints their paths."""

import sys
from functools import partial

from tools.virtual.images import (
    VERSIONS,
    FirmwareError,
    rp2040_image,
    rv32_micropython,
    unix_micropython,
)

GETTERS = {
    "rp2": [partial(rp2040_image, version) for version in VERSIONS],
    "unix": [unix_micropython],
    "rv32": [rv32_micropython],
}


def main(arguments):
    """Get what is named on the command line and print where it is; exit code 1 on failure."""
    wanted = arguments or ["all"]
    if wanted == ["all"]:
        wanted = list(GETTERS)
    unknown = [name for name in wanted if name not in GETTERS]
    if unknown:
        print(f"unknown: {' '.join(unknown)}; choose from {' '.join(GETTERS)} all")
        return 2
    try:
        for name in wanted:
            for get in GETTERS[name]:
                print(f"{name}: {get()}", flush=True)
    except FirmwareError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))

# SPDX-License-Identifier: MIT
"""One archive for each processor: what deploy would copy, to be copied by hand."""

import zipfile

from tools.deploy.plan import project

# mpy-cross's names, and the boards that have such a processor
ARCHITECTURES = {
    "armv6m": "RP2040: Pico, Pico W",
    "armv7emsp": "RP2350: Pico 2",
    "xtensawin": "ESP32, ESP32-S3",
    "rv32imc": "ESP32-C3, ESP32-C6",
}
DAY = (1980, 1, 1, 0, 0, 0)  # the same in every archive, so that its bytes are too
README = """Plumb {version} for {boards}. MicroPython 1.23 or newer.

Copy lib/, firmware/, boot.py and main.py to the board's top folder, main.py last.
A main.py of your own stays yours: it starts Plumb with

    from firmware.app import App
    app = App()
    app.start()
"""


def write_bundles(folder, version):
    """Write an archive for each processor; [(path, files, bytes unpacked)]."""
    rows = []
    for architecture, boards in ARCHITECTURES.items():
        files = project(architecture)
        readme = README.format(version=version, boards=boards).encode()
        path = folder / f"plumb-{version}-{architecture}.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, data in sorted({**files, "/README.txt": readme}.items()):
                archive.writestr(zipfile.ZipInfo(name[1:], DAY), data, zipfile.ZIP_DEFLATED)
        rows.append((path, len(files), sum(map(len, files.values()))))
    return rows

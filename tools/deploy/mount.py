# SPDX-License-Identifier: MIT
"""Running from the PC's disk: mpremote mounts a folder, nothing is copied to the flash."""

import subprocess
import sys

from tools.deploy.fits import asked, chosen
from tools.deploy.link import Link
from tools.deploy.plan import project
from tools.virtual.rp2040.flash import ROOT

# The board's own copies are out of reach: two halves must not be mixed.
RUN = "import sys; sys.path[:] = ['', '/remote/lib', '.frozen']; exec(open('main.py').read())"


def mount(port, say=print, repl=True):
    """Run main.py from out/mount/, compiled for the board; the REPL follows. Exit code.

    Knobs and calibration are kept in that folder, apart from those on the board's flash.
    """
    with Link(port) as board:
        board.stop()
        architecture = chosen(asked(board))
        board.restart = False
    folder = ROOT / "out" / "mount" / architecture
    files = project(architecture)
    old = [p for p in folder.rglob("*") if p.suffix in (".py", ".mpy")]
    for path in old:
        path.unlink()
    for name, data in files.items():
        path = folder / name[1:]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)
    say(f"mounted: {folder}; end with Ctrl-X")
    command = [sys.executable, "-m", "mpremote", "connect", port, "mount", str(folder)]
    return subprocess.run([*command, "exec", RUN, *(["repl"] if repl else [])]).returncode

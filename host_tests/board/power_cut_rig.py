# SPDX-License-Identifier: MIT
"""What the tests of power cuts share: a board's saves as flash commands, and who cuts them.

Two MicroPythons: the emulated board makes the saves, and starts again from some of the cuts; the
unix port, of the same version and with the same littlefs, tries all cuts at a PC's speed.
"""

import ast
import random
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

from tools.virtual import images
from tools.virtual.rp2040.flash import BLOCK_COUNT, BLOCK_SIZE
from tools.virtual.rp2040.flash_cuts import ERASED, Flash, cuts

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "tools" / "board_scripts"
CUTS = ROOT / "tools" / "virtual" / "rp2040"  # flash_cuts.py, without the packages around it
_MODULES = [ROOT / "boot.py", *sorted((ROOT / "lib" / "calibration").glob("*.py"))]
_NAMES = ("briefly", "calibration", "config", "store")
_MODULES += [ROOT / "firmware" / f"{name}.py" for name in _NAMES]
FILES = {path.relative_to(ROOT).as_posix(): path for path in _MODULES}
FILES["lib/saves.py"] = SCRIPTS / "saves.py"
FILES["main.py"] = "print('main.py has run')\n"
HEAD = """import sys
sys.path[:] = [{root!r}, {lib!r}, {scripts!r}, {cuts!r}]
"""


class Save(NamedTuple):
    """A save of number n of `kind`: the flash before it, and the commands that it took."""

    kind: str
    before: int
    n: int
    start: Flash
    commands: list

    def after(self):
        """The flash after it."""
        flash = Flash(self.start.blocks, BLOCK_COUNT)
        for command in self.commands:
            flash.command(*command)
        return flash

    def erases(self):
        """Which of the commands are erases."""
        return [number for number, (_, data) in enumerate(self.commands) if data is None]

    def cut(self, number):
        """(what, flash) in the middle of a command: of all its cuts the one in the middle."""
        flash = self._replace(commands=self.commands[:number]).after()
        address, data = self.commands[number]
        ways = list(cuts(flash.piece(address, data), data, noises()))
        name, piece = ways[len(ways) // 2]
        flash.put(address, piece)
        what = "erase" if data is None else "program"
        return f"{what} {number} of {len(self.commands)} at 0x{address:05x}, {name}", flash


class Cuts(NamedTuple):
    """What tools/board_scripts/power_cut.py counted for one save."""

    kind: str
    n: int
    commands: int
    tried: int
    new: int
    deep: int
    twice: int
    lost: int


def noises():
    """The same three blocks of random bytes each time."""
    generator = random.Random(1)
    return [generator.randbytes(BLOCK_SIZE) for _ in range(3)]


def flash_of(content):
    """A Flash with these bytes."""
    pieces = (content[at : at + BLOCK_SIZE] for at in range(0, len(content), BLOCK_SIZE))
    return Flash({n: piece for n, piece in enumerate(pieces) if piece != ERASED}, BLOCK_COUNT)


def save_on(pico, kind, before, n, lines=None):
    """Have the board save number n, by the firmware's own way or by `lines`; the Save."""
    start = flash_of(pico.flash.content)
    pico.flash.log.clear()
    pico.exec(lines or f"import saves\nsaves.save({kind!r}, {n})", timeout_s=60)
    return Save(kind, before, n, start, list(pico.flash.log))


def try_cuts(saves, step=1):
    """([Cuts] of saves that follow each other, what was lost as texts)."""
    names = {"BLOCKS": saves[0].start.blocks, "NOISES": noises(), "STEP": step}
    names["SAVES"] = [(s.kind, s.before, s.n, s.commands) for s in saves]
    found, losses = [], []
    for line in _run("power_cut.py", names):
        word, _, rest = line.partition(" ")
        if word == "save":
            kind, *counts = rest.split()
            found.append(Cuts(kind, *[int(count) for count in counts]))
        else:
            losses.append(line)
    return found, losses


def worn(flash, n):
    """Two saves of configurations n and n + 1, in each of which littlefs levels wear."""
    found = []
    for line in _run("wear.py", {"BLOCKS": flash.blocks, "FIRST": n}):
        blocks, number, commands = ast.literal_eval(line)
        found.append(Save("config", number - 1, number, Flash(blocks, BLOCK_COUNT), commands))
    return found


def _run(script, names):
    """Lines that the script prints on the unix port, with `names` set before."""
    paths = {"root": ROOT, "lib": ROOT / "lib", "scripts": SCRIPTS, "cuts": CUTS}
    head = HEAD.format(**{name: str(path) for name, path in paths.items()})
    head += "".join(f"{name} = {value!r}\n" for name, value in names.items())
    head += f"COUNT = {BLOCK_COUNT}\n"
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, script)
        path.write_text(head + (SCRIPTS / script).read_text())
        command = [str(images.unix_micropython()), "-X", "heapsize=4M", str(path)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(done.stdout + done.stderr)
    return done.stdout.splitlines()

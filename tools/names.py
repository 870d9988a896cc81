# SPDX-License-Identifier: MIT
"""Write firmware/names.py: the names that code brings which a board loads for a moment.

MicroPython keeps each name that it has heard, in pieces that lie between the code they came with.
Code that is loaded for a moment would leave them behind as islands in the heap.
"""

import contextlib
import io
import tempfile
from pathlib import Path

from tools.virtual import Bus, MPU6050Chip, Port, motion
from tools.virtual.rp2040.flash import cross_compile

ROOT = Path(__file__).resolve().parents[1]
PATH = ROOT / "firmware" / "names.py"
_MORE = ("firmware.stats", "firmware.texts", "firmware.levelling", "firmware.loading")
_TEXT = '''\
# SPDX-License-Identifier: MIT
"""Names that code brings which is loaded for a moment (python -m tools.names writes this): heard
before it, they lie together and are no islands in the heap when it has gone. MicroPython keeps
names in pools of 20, 40, ... 640; the next, from the 1261st on, takes 9 KB in one piece.
"""

_NAMES = (
%s
)


def hear():
    """MicroPython keeps them from now on."""
    for row in _NAMES:
        for name in row.split("|"):
            getattr(None, name, None)
'''


def names_in(path):
    """The names that compiled code of this file brings, which not every MicroPython has."""
    data = cross_compile(path.read_bytes(), path.relative_to(ROOT).as_posix())
    found, at = set(), 4

    def number():
        nonlocal at
        value = 0
        while True:
            byte = data[at]
            at += 1
            value = value << 7 | byte & 127
            if byte < 128:
                return value

    count, _ = number(), number()
    for _ in range(count):
        length = number()
        if not length & 1:  # else its number in the list that all have
            found.add(data[at : at + length // 2].decode())
            at += length // 2 + 1
    return found


def file_of(module):
    """The file of one of the board's modules, or None."""
    inner = module.replace(".", "/")
    folder = ROOT if module.split(".")[0] == "firmware" else ROOT / "lib"
    for path in (folder / f"{inner}.py", folder / inner / "__init__.py"):
        if path.exists():
            return path
    return None


def modules():
    """(modules that stay while the app runs, those that are loaded beside it for a moment)."""
    port = Port("rp2", {0: Bus(MPU6050Chip(motion.Still(), seed=1))}, version=(1, 26, 1))
    with tempfile.TemporaryDirectory() as port.root, port:
        import sys

        from firmware import app as module

        with contextlib.redirect_stdout(io.StringIO()):
            app = module.App()
            app.start()
            port.run_ms(1000)
            stay = [name for name in sys.modules if file_of(name)]
            app.stop()
        from firmware.loading import PARTS

        beside = [*module._START, *module._CLAIMS, *module._CALIBRATING, *_MORE]
        for name, parts in PARTS.items():
            if name != "float.attitude":  # which has no room beside the default one
                beside += parts
    return stay, beside


def needed():
    """The names of these that those do not have, sorted."""
    stay, beside = modules()
    known = set().union(*[names_in(file_of(name)) for name in stay])
    new = set().union(*[names_in(file_of(name)) for name in beside])
    new = new.union(beside, [name.split(".")[-1] for name in beside]) - known
    return sorted(name for name in new if name.isprintable() and name.isascii())


def text():
    """What firmware/names.py has to say."""
    rows = [""]
    for name in needed():
        if len(_literal(rows[-1] + name)) > 93:
            rows.append("")
        rows[-1] += ("|" if rows[-1] else "") + name
    return _TEXT % "\n".join(f"    {_literal(row)}," for row in rows)


def _literal(text):
    return '"%s"' % text.replace("\\", "\\\\").replace('"', '\\"')


def main():
    """Write it."""
    PATH.write_text(text())
    print(PATH)


if __name__ == "__main__":
    main()

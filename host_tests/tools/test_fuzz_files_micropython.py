# SPDX-License-Identifier: MIT
"""10 000 hostile files on MicroPython itself: it survives them, and says what CPython says."""

import json
import math
import random
import re
import subprocess
import sys
from pathlib import Path

from host_tests.firmware.hostile_files import (
    KINDS,
    NAMES,
    ODD_COUNTS,
    ODD_NAMES,
    ODD_VALUES,
    OPERATIONS,
    check_warnings,
    good,
    mended,
    mutated,
    outcome,
    quick_folder,
    valid,
    whole,
    written,
)
from tools.virtual import images
from tools.virtual.rp2040.flash import compiled, project_files

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "tools" / "board_scripts" / "fuzz_files.py"
SETS = 5_600  # of one to three files
MODULES = ("firmware/", "lib/calibration/")
HEAP = "108K"  # a Pico has 240 kB
NO_FILE = b"\xff\xff"


def noise(rng, size):
    return bytes(rng.randrange(256) for _ in range(rng.randrange(size)))


def number(rng):
    """A number as text: near a limit, of any size, with more digits than a float has."""
    value = rng.choice((0.1, 1, 10, 80, 1000))
    value *= rng.choice((1, -1, rng.random(), 10.0 ** rng.randint(-9, 9)))
    digits = rng.randrange(25)
    return rng.choice((repr(value), f"{value:.{digits}f}", f"{value:.3e}", str(int(value))))


def rows(rng, kind):
    for _ in range(rng.randrange(1, 5)):
        name = rng.choice(NAMES[kind] if rng.random() < 0.8 else ODD_NAMES)
        several = " ".join(number(rng) for _ in range(rng.choice((2, 3, 3, 9))))
        yield name, rng.choice((rng.choice(ODD_VALUES), number(rng), several))


def hostile(rng, kind):
    """One file of every sort of damage, malice and accident."""
    sort = rng.randrange(12)
    if sort == 0:
        return rng.choice((noise(rng, 300), b"", b"\n" * 4096, b"a\n" * 2048, b"x" * 4097))
    if sort == 1:
        return written(noise(rng, 200) + b"\n")
    if sort < 6:
        return whole(kind, rng.choice((5, 6)), rows(rng, kind))
    if sort == 6:
        counts = rng.choice(ODD_COUNTS), rng.choice(ODD_COUNTS)
        return whole(rng.choice(KINDS + ("", "x y")), counts[0], rows(rng, kind), counts[1])
    if sort == 7:
        text = rng.choice(("1", "1 " * 110, "9" * 30, "1234567890 12345 1.5 5 6 7"))
        return whole(kind, 5, [(f"q{i}", text) for i in range(rng.randrange(15, 70))])
    data = good(kind, rng)
    if sort == 8:
        return data
    for _ in range(rng.randrange(1, 4)):
        change = rng.choice(OPERATIONS), rng.randrange(999), rng.randrange(999), noise(rng, 9)
        data = mutated(data, *change)
    return mended(data) if sort < 11 else data


def sets():
    """[(kind, files)], always the same ones."""
    rng = random.Random(1)
    made = []
    for n in range(SETS):
        kind = KINDS[n % 2]
        others = (hostile(rng, kind) if rng.random() < 0.4 else None for _ in range(2))
        made.append((kind, (hostile(rng, kind), *others)))
    return made


def pack(made):
    """The sets as the script reads them."""
    parts = []
    for kind, files in made:
        parts.append(bytes([KINDS.index(kind)]))
        parts += [NO_FILE if data is None else len(data).to_bytes(2, "big") for data in files]
        parts += [data for data in files if data is not None]
    return b"".join(parts)


def answers(command, head, corpus, modules=None):
    """What the script prints for these sets, run by `command`; with the project's own modules, or
    these (path: bytes) in their place."""
    paths = [str(ROOT), str(ROOT / "lib")] if modules is None else ["", "lib"]
    head = f"import sys\nsys.path[:0] = {paths}\nCORPUS = 'corpus'\n{head}"
    with quick_folder() as folder:
        for name, content in (modules or {}).items():
            Path(folder, name).parent.mkdir(parents=True, exist_ok=True)
            Path(folder, name).write_bytes(content)
        Path(folder, "corpus").write_bytes(corpus)
        Path(folder, "fuzz_files.py").write_text(head + SCRIPT.read_text())
        done = subprocess.run(
            [*command, "fuzz_files.py"], cwd=folder, capture_output=True, text=True, timeout=300
        )
    lines = done.stdout.splitlines()
    assert done.returncode == 0, f"set {len(lines)}: {done.stderr}{lines[-5:]}"
    return [json.loads(line) for line in lines]


def same(ours, theirs):
    """Whether values are equal; a float's last digits may differ, as its text does."""
    if isinstance(ours, dict):
        return ours.keys() == theirs.keys() and all(same(ours[k], theirs[k]) for k in ours)
    if isinstance(ours, (list, tuple)):
        return len(ours) == len(theirs) and all(map(same, ours, theirs))
    if isinstance(ours, (int, float)) and isinstance(theirs, (int, float)):
        return math.isclose(ours, theirs, rel_tol=1e-14)
    return ours == theirs


def without_floats(texts):
    """The texts with a mark for each float, whose digits may differ in the last place."""
    return [re.sub(r"-?\d+\.?\d*(e[+-]?\d+)?(?=[,;:) ])", "#", text) for text in texts]


def test_micropython_survives_and_agrees_with_cpython():
    made = sets()
    corpus = pack(made)
    command = [str(images.unix_micropython()), "-X", f"heapsize={HEAP}"]
    files = {path: file for path, file in project_files().items() if path.startswith(MODULES)}
    modules = compiled(files, "x64")  # as on a board: there no source is read either
    *board, board_ms = answers(command, "", corpus, modules)
    pc_head = "from tools.virtual.port import install_micropython\ninstall_micropython()\n"
    *pc, _ = answers([sys.executable], pc_head, corpus)
    assert len(board) == len(pc) == SETS
    assert board_ms < 1000
    defaults = {kind: outcome((None, None, None), kind)[0] for kind in KINDS}
    for (kind, files), theirs, ours in zip(made, board, pc):
        changed, warnings, mends = theirs
        expected, blamed = outcome(files, kind)
        values = {**defaults[kind], **changed}
        assert same(expected, values), (files, values)
        assert same(ours[0], changed), (files, ours[0], changed)
        check_warnings(files, kind, blamed, warnings)
        assert without_floats(ours[1]) == without_floats(warnings), files
        assert mends and ours[2], files
    present = [(kind, f) for kind, files in made for f in files if f is not None]
    assert len(present) >= 10_000
    refused = sum(not valid(data, kind) for kind, data in present)
    print(
        f"\n{len(present)} files in {SETS} sets on MicroPython: {refused} refused, "
        f"{len(present) - refused} accepted, 0 exceptions, {board_ms} ms at most"
    )

# SPDX-License-Identifier: MIT
"""What a deploy does, decided from what the project has and what the board has."""

import ast
import hashlib
import json
from typing import NamedTuple

from tools.image.frozen import MAIN_OF_IMAGE
from tools.virtual.rp2040.flash import cross_compile, project_files

ASIDE = "/plumb.old"
RECORD = "/plumb.json"  # digests of each boot.py and main.py that was ours
STARTERS = ("/boot.py", "/main.py")
GATE = "/firmware"  # the package without which nothing of ours starts
KEPT = {
    "/main.py": (
        "main.py on the board is your own and stays. It starts Plumb with\n"
        "    from firmware.app import App\n    app = App()\n    app.start()"
    ),
    "/boot.py": (
        "boot.py on the board is your own and stays. For the tracebacks of interrupts it wants\n"
        "    import micropython\n    micropython.alloc_emergency_exception_buf(100)"
    ),
}
RP2_ONLY = ("firmware/stack.py", "lib/mpu6050/split_rp2.py")  # loaded there alone


def project(architecture):
    """{path on the board: bytes}; modules as .mpy for this architecture, None: as source."""
    files = {}
    for name, source in project_files().items():
        if name in RP2_ONLY and (architecture or "").startswith("xtensa"):
            continue
        path, data = "/" + name, source.read_bytes()
        if architecture is None or path in STARTERS:
            files[path] = data
        else:
            files[path[:-3] + ".mpy"] = cross_compile(data, name, architecture)
    return files


def package(path):
    """The folder that is exchanged as a whole: /firmware, /lib/NAME; None for a starter."""
    parts = path.split("/")
    if len(parts) < 3:
        return None
    return "/".join(parts[: 3 if parts[1] == "lib" else 2])


def packages(files):
    """All of them, the gate last: what is ours alone on a board."""
    found = {package(path) for path in files} - {None}
    return sorted(found - {GATE}) + [GATE] * (GATE in found)


class There(NamedTuple):
    """What a board has: {path: digest} where it belongs and aside, the names of what waits, the
    record of what is ours, and what each starter says.
    """

    live: dict
    aside: dict
    waiting: list
    record: dict
    texts: dict


def there(board, ours):
    """Ask a Link what the board has of our packages, and of those that were ours before."""
    try:
        record = json.loads(board.ask(f"text({RECORD!r})"))
    except ValueError:
        record = {}
    places = sorted({*ours, *record.get("packages", ())})
    *lines, names = board.run(f"show({[*places, *STARTERS, ASIDE]!r})").splitlines()
    found = dict(map(ast.literal_eval, lines))
    aside = {p[len(ASIDE) :]: d for p, d in found.items() if p.startswith(ASIDE)}
    live = {p: d for p, d in found.items() if not p.startswith(ASIDE)}
    texts = {path: board.ask(f"text({path!r})") for path in STARTERS}
    return There(live, aside, ast.literal_eval(names), record, texts)


class Plan(NamedTuple):
    """What the board is to do: exchange(packages, new, gone, last), and {name: bytes} for it."""

    packages: list
    new: list
    gone: list
    last: list
    data: dict
    notes: list

    @property
    def nothing(self):
        return not (self.packages or self.last)

    @property
    def copied(self):
        """How many files of the project are copied; the record is none of them."""
        return sum(path != RECORD for path, name in [*self.new, *self.last] if name)


def planned(files, found):
    """The Plan that makes the files {path: bytes} of what was found on a board."""
    files, notes = dict(files), []
    now = _now(found)
    for path in STARTERS:
        if path in files and not is_ours(path, files[path], found):
            notes.append(KEPT[path])
            del files[path]
    record = {path: _digests(path, files, found) for path in STARTERS}
    record["packages"] = packages(files)
    if record != found.record:
        files[RECORD] = json.dumps(record).encode()
    differ = [path for path in sorted(files) if now.get(path) != digest(files[path])]
    gone = sorted(path for path in now if path not in files and package(path))
    new = [(path, waiting_name(path, files[path])) for path in differ]
    return _plan(
        [pair for pair in new if package(pair[0])],
        gone,
        sorted((pair for pair in new if not package(pair[0])), key=lambda pair: pair[0] != RECORD),
        {name: files[path] for path, name in new},
        notes,
        found,
    )


def removal(found):
    """The Plan that takes all that is ours off a board."""
    last, notes = [(RECORD, None)], []
    for path in STARTERS:
        if path in found.live:
            if is_ours(path, None, found):
                last.append((path, None))
            else:
                notes.append(f"{path[1:]} on the board is your own and stays")
    return _plan([], sorted(filter(package, _now(found))), last, {}, notes, found)


def _plan(new, gone, last, data, notes, found):
    changed = {package(path) for path in [*dict(new), *gone, *found.aside]}
    if changed or len(last) > 1:
        changed.add(GATE)
    shut = sorted(changed - {GATE}) + [GATE] * (GATE in changed)
    return Plan(shut, new, gone, last, data, notes)


def _now(found):
    """{path: digest} of the files, wherever a copy that was cut has left them."""
    whole = {package(path) for path in found.live}
    return {p: d for p, d in found.aside.items() if package(p) not in whole} | found.live


def is_ours(path, data, found):
    """Whether a boot.py or main.py on the board may be replaced: there is none, it does nothing,
    it is as it would be, or it was put there by a deploy or by an image.
    """
    there_now = found.live.get(path)
    lines = (line.strip() for line in found.texts.get(path, "").splitlines())
    if not any(line and not line.startswith("#") for line in lines):
        return True
    known = [*found.record.get(path, ()), digest(MAIN_OF_IMAGE.encode())]
    return there_now in known or (data is not None and there_now == digest(data))


def _digests(path, files, found):
    known = found.record.get(path, [])
    mine = [digest(files[path])] if path in files else []
    return [*known, *(d for d in mine if d not in known)]


def digest(data):
    return hashlib.sha256(data).hexdigest()


def waiting_name(path, data):
    """Under what name a file waits on the board until all have arrived."""
    return digest(path.encode() + b"\0" + data)[:16]

# SPDX-License-Identifier: MIT
"""A package index as mip reads it: files by their digests, packages by name and version.

    index/package/{py, 6}/NAME/{VERSION, latest}.json       6: the version of .mpy that boards name
    index/file/ab/abcdef...
"""

import hashlib
import json

from tools.image.frozen import LIB, frozen_files, imported

APP = "plumb"
FORMATS = ("py", "6")
DIGEST = 16  # hexadecimal digits that name a file
ALSO = ("plumb_main.py",)  # of the app: a main.py of one line starts it


def packages():
    """{name: ({path under /lib: bytes}, [names it depends on])}: each library, and the app."""
    found = {}
    for folder in sorted(path.parent for path in LIB.glob("*/__init__.py")):
        paths = sorted(folder.rglob("*.py"))
        found[folder.name] = _package(folder.name, {p.relative_to(LIB): p for p in paths})
    ours = frozen_files()
    own = {n: p for n, p in ours.items() if n in ALSO or n.startswith("firmware/")}
    found[APP] = _package(APP, own)
    return found


def _package(name, paths):
    files = {str(path): source.read_bytes() for path, source in paths.items()}
    names = set().union(*map(imported, paths.values())) - {name}
    return files, sorted(n for n in names if (LIB / n / "__init__.py").exists())


def write_index(folder, version):
    """Write the index of all packages; [(name, files, bytes)]."""
    rows = []
    for name, (files, depends) in packages().items():
        listed = []
        for path, data in files.items():
            digest = hashlib.sha256(data).hexdigest()[:DIGEST]
            target = folder / "file" / digest[:2] / digest
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(data)
            listed.append([path, digest])
        fields = {"v": 1, "version": version, "hashes": listed}
        fields["deps"] = [[dependency, version] for dependency in depends]
        for form in FORMATS:
            for called in (version, "latest"):
                path = folder / "package" / form / name / f"{called}.json"
                path.parent.mkdir(parents=True, exist_ok=True)
                path.write_text(json.dumps(fields, indent=1) + "\n")
        rows.append((name, len(files), sum(map(len, files.values()))))
    return rows

# SPDX-License-Identifier: MIT
"""Write the package.json of each folder of lib/, from which `mpremote mip install` works."""

import json
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def manifest(folder, version):
    """The text of one folder's package.json: every Python file in it, by its place on a board."""
    names = sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*.py"))
    urls = ",\n".join("    " + json.dumps([f"{folder.name}/{name}", name]) for name in names)
    return '{\n  "urls": [\n%s\n  ],\n  "version": "%s"\n}\n' % (urls, version)


def main():
    """Write them all."""
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    for init in sorted((ROOT / "lib").glob("*/__init__.py")):
        (init.parent / "package.json").write_text(manifest(init.parent, version))
        print(init.parent / "package.json")


if __name__ == "__main__":
    main()

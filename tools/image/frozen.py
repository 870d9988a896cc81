# SPDX-License-Identifier: MIT
"""What is frozen, found by walking: firmware/, what it imports of lib/, and the starting files."""

import ast
from pathlib import Path

from tools.virtual.rp2040.flash import ROOT, project_files

LIB = ROOT / "lib"
START = ROOT / "firmware" / "image" / "plumb_image.py"
MODULES = 'freeze("$(PORT_DIR)/modules")'  # the line in each port's manifest
PORTS_OWN = 'include("$(PORT_DIR)/boards/manifest.py")'
RUN_START = "\nimport plumb_image\n\ndel plumb_image\n"

MAIN_OF_IMAGE = next(  # the main.py that an image writes to a flash that has none
    ast.literal_eval(node.value)
    for node in ast.parse(START.read_text()).body
    if isinstance(node, ast.Assign) and node.targets[0].id == "_MAIN"
)


def packages(roots):
    """Names of the packages of lib/ that these files import, and those that these import."""
    found, waiting = set(), list(roots)
    while waiting:
        names = imported(waiting.pop())
        new = {name for name in names - found if (LIB / name / "__init__.py").exists()}
        found |= new
        for name in new:
            waiting += (LIB / name).rglob("*.py")
    return found


def imported(path):
    """First parts of the names of all modules that a file imports, anywhere in it."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            names |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names.add(node.module.partition(".")[0])
    return names


def frozen_files():
    """{path by which it is imported: Path here} of all that is frozen, sorted."""
    here = project_files()
    main = here.pop("main.py")
    here.pop("boot.py", None)  # its reserve for tracebacks is made by plumb_image.py
    here.pop("firmware/names.py")  # those are heard already
    wanted = packages([main, *(p for name, p in here.items() if name.startswith("firmware/"))])
    files = {"plumb_image.py": START, "plumb_main.py": main}
    for name, path in here.items():
        top, _, rest = name.partition("/")
        if top == "firmware":
            files[name] = path
        elif rest.partition("/")[0] in wanted:
            files[rest] = path
    return dict(sorted(files.items()))


def write_manifest(folder, tree, port, board_dir, ours=True):
    """Write manifest.py (and what it names) into `folder`; its path.

    tree: of MicroPython's sources; port: "rp2", "esp32"; ours=False: only what the board's own
    manifest has. Drivers from micropython-lib are left out where the tree lacks it.
    """
    folder = Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    modules = tree / "ports" / port / "modules"
    names = sorted(p.relative_to(modules).as_posix() for p in modules.rglob("*.py"))
    if ours:
        names.remove("_boot.py")
        boot = (modules / "_boot.py").read_text()
        (folder / "_boot.py").write_text(boot + RUN_START)
    lines = [f'freeze("$(PORT_DIR)/modules", {tuple(names)!r})']
    lines += [line for line in _base(tree, port, board_dir) if line != MODULES]
    if ours:
        lines.append(f'freeze({str(folder)!r}, ("_boot.py",))')
        for name, path in frozen_files().items():
            lines.append(_line(folder, name, path))
    manifest = folder / "manifest.py"
    manifest.write_text("\n".join(lines) + "\n")
    return manifest


def _line(folder, name, path):
    """The manifest's line for one file; one that is imported by another name is copied first.
    Without line numbers, as deploy compiles it: the flash of a Pico is short, too.
    """
    base = path.as_posix().removesuffix("/" + name)
    if base == path.as_posix():
        (folder / name).write_bytes(path.read_bytes())
        base = folder.as_posix()
    return f"freeze({base!r}, ({name!r},), opt=3)"


def _base(tree, port, board_dir):
    """The lines of the board's own manifest, else of the port's, without what is not there."""
    ports_own = tree / "ports" / port / "boards" / "manifest.py"
    own = board_dir / "manifest.py"
    text = (own if own.exists() else ports_own).read_text()
    lines = text.replace(PORTS_OWN, ports_own.read_text()).splitlines()
    whole = (tree / "lib" / "micropython-lib" / "micropython").is_dir()
    return [line for line in lines if line and (whole or not line.startswith("require("))]

# SPDX-License-Identifier: MIT
"""The walls between the folders: who may import whom, and that nothing imports in a circle."""

import ast
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
# (files, what none of them imports, and what of it is allowed after all)
WALLS = {
    "lib has no machine and no app": (("lib",), ("machine", "firmware"), ()),
    "the virtual hardware is the ground": (("tools/virtual",), ("tools",), ("tools.virtual",)),
    "the board is alone": (
        ("lib", "firmware", "main.py", "boot.py"), ("tools", "host_tests"), (),
    ),
}  # fmt: skip
IN_CIRCLES = ("lib", "firmware", "tools")


def files(root, places):
    for place in places:
        yield from [root / place] if place.endswith(".py") else (root / place).rglob("*.py")


def module_name(root, path):
    """The name by which the file is imported; folders of lib/ stand at the top."""
    parts = path.relative_to(root).with_suffix("").parts
    parts = parts[1:] if parts[0] == "lib" else parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def at_load(node):
    """The nodes that run when the module is loaded: all but the bodies of functions."""
    for child in ast.iter_child_nodes(node):
        if not isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            yield child
            yield from at_load(child)


def imports(root, path, walk=ast.walk):
    """(line, module, names taken from it) of each import statement of a file."""
    package = module_name(root, path).split(".")
    if path.name != "__init__.py":
        package.pop()
    for node in walk(ast.parse(path.read_text(), str(path))):
        if isinstance(node, ast.Import):
            yield from ((node.lineno, alias.name, ()) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            above = package[: len(package) + 1 - node.level] if node.level else []
            module = ".".join([*above, *filter(None, [node.module])])
            yield node.lineno, module, tuple(alias.name for alias in node.names)


def within(name, tops):
    return any(name == top or name.startswith(top + ".") for top in tops)


def breaches(root, places, banned, allowed):
    """What goes through a wall, a text for each."""
    found = []
    for path in files(root, places):
        for line, module, names in imports(root, path):
            for name in [f"{module}.{name}" for name in names] or [module]:
                if within(name, banned) and not within(name, allowed):
                    found.append(f"{path.relative_to(root)}:{line}: {name}")
    return found


def graph(root, places=IN_CIRCLES):
    """{module: modules of the project that it imports when it is loaded}."""
    paths = {module_name(root, path): path for path in files(root, places)}
    edges = {}
    for own, path in paths.items():
        edges[own] = set()
        for _, module, names in imports(root, path, at_load):
            taken = [f"{module}.{name}" for name in names]
            inner = {name for name in taken if name in paths}
            edges[own] |= inner
            if module in paths and len(inner) < len(taken or [module]):
                edges[own].add(module)
    return edges


def circle(edges):
    """The modules of a circle, or None."""
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        return error.args[1]
    return None


@pytest.mark.parametrize("name", WALLS)
def test_nothing_goes_through_the_wall(name):
    places = WALLS[name][0]
    assert all((ROOT / place).exists() for place in places)
    assert breaches(ROOT, *WALLS[name]) == []


def test_nothing_imports_in_a_circle():
    edges = graph(ROOT)
    assert len(edges) > 150 and sum(map(len, edges.values())) > 200
    assert {"mpu6050", "attitude.fixed", "firmware.app", "tools.virtual.port.port"} <= set(edges)
    assert circle(edges) is None


# the measure itself, on a house with faults


@pytest.mark.parametrize(
    ("name", "file", "line"),
    [
        ("lib has no machine and no app", "lib/a/b.py", "from machine import I2C"),
        ("lib has no machine and no app", "lib/a/__init__.py", "def f():\n    import firmware"),
        ("the virtual hardware is the ground", "tools/virtual/x/y.py", "from tools import demo"),
        ("the virtual hardware is the ground", "tools/virtual/x.py", "import tools.faults.kinds"),
        ("the virtual hardware is the ground", "tools/virtual/x.py", "from ..faults import rig"),
        ("the board is alone", "main.py", "import tools.demo"),
        ("the board is alone", "firmware/app.py", "from host_tests.lib import sensor_rig"),
    ],
)  # fmt: skip
def test_a_breach_is_found(tmp_path, name, file, line):
    (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
    for place in ("main.py", "boot.py", file):
        (tmp_path / place).write_text("from tools.virtual import bus\n" if place[0] == "t" else "")
    assert breaches(tmp_path, *WALLS[name]) == []
    (tmp_path / file).write_text(line + "\n")
    [found] = breaches(tmp_path, *WALLS[name])
    assert found.startswith(f"{file}:{line.count(chr(10)) + 1}: ")


def test_a_circle_is_found_and_what_is_none_is_not(tmp_path):
    house = {
        "tools/a/__init__.py": "from tools.a import b\n",
        "tools/a/b.py": "from tools.a import c\n",
        "tools/a/c.py": "def late():\n    from tools.a import b\n",
        "lib/d/__init__.py": "from .e import f\n",
        "lib/d/e.py": "import math\nclass Late:\n    def f(self):\n        import d\n",
    }
    for file, text in house.items():
        (tmp_path / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / file).write_text(text)
    assert circle(graph(tmp_path)) is None
    (tmp_path / "lib/d/e.py").write_text("if True:\n    from d import late\n")
    assert set(circle(graph(tmp_path))) == {"d", "d.e"}
    (tmp_path / "lib/d/e.py").write_text("")
    (tmp_path / "tools/a/c.py").write_text("from . import b\n")
    assert set(circle(graph(tmp_path))) == {"tools.a.b", "tools.a.c"}

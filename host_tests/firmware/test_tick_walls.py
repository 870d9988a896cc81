# SPDX-License-Identifier: MIT
"""What runs in an interrupt stays in its folder, and keeps to what an interrupt may do."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
TICK = sorted((ROOT / "firmware" / "tick").glob("*.py"))
OTHERS = [p for p in sorted((ROOT / "firmware").rglob("*.py")) if p not in TICK]
MAY_IMPORT = {"array", "micropython", "time", "firmware.tick"}
FAST = {"native", "viper"}
SLOW = {"print", "open", "getattr", "setattr", "type", "float", "str", "bytes", "list", "tuple"}


def tree(path):
    return ast.parse(path.read_text())


def is_fast(node):
    decorators = getattr(node, "decorator_list", ())
    return any(isinstance(d, ast.Attribute) and d.attr in FAST for d in decorators)


def fast_functions(path):
    return [n for n in ast.walk(tree(path)) if isinstance(n, ast.FunctionDef) and is_fast(n)]


@pytest.mark.parametrize("path", TICK, ids=lambda p: p.name)
def test_the_tick_imports_itself_and_three_modules(path):
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.ImportFrom):
            root = ".".join(node.module.split(".")[:2])
            assert root in MAY_IMPORT or node.module in MAY_IMPORT, node.module
        elif isinstance(node, ast.Import):
            assert all(alias.name in MAY_IMPORT for alias in node.names)


def test_no_other_file_of_the_firmware_has_machine_code_but_the_applications():
    """telemetry.put_mdeg and stream's frames make text and bytes; the applications' controllers
    are the hard outputs that the tick calls."""
    for path in OTHERS:
        if path.parent.name == "apps":
            continue
        names = {function.name for function in fast_functions(path)}
        if path.name == "stream.py":
            continue
        assert names <= {"put_mdeg"}, (path.name, names)


def own_nodes(function):
    """The nodes of a function without those of functions inside it, and without its defaults,
    which are made in the foreground."""
    waiting = list(function.body)
    while waiting:
        node = waiting.pop()
        if isinstance(node, ast.FunctionDef):
            continue
        yield node
        waiting.extend(ast.iter_child_nodes(node))


@pytest.mark.parametrize(
    "path, function",
    [(path, f) for path in TICK for f in fast_functions(path)],
    ids=lambda value: getattr(value, "name", ""),
)
def test_machine_code_of_the_tick_allocates_nothing_that_can_be_seen(path, function):
    assert function.args.vararg is None and function.args.kwarg is None
    swaps = set()  # `a, b = c, d` of two or three goes over the stack
    for node in own_nodes(function):
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Tuple):
            assert len(node.value.elts) <= 3 and isinstance(node.targets[0], ast.Tuple)
            swaps.add(node.value)
    for node in own_nodes(function):
        assert not isinstance(node, (ast.JoinedStr, ast.List, ast.Dict, ast.Set, ast.ListComp)), (
            ast.dump(node)[:80]
        )
        assert not isinstance(node, (ast.GeneratorExp, ast.Lambda, ast.Slice, ast.Yield))
        if isinstance(node, ast.Tuple):
            assert isinstance(node.ctx, ast.Store) or node in swaps
        if isinstance(node, ast.BinOp):
            assert not isinstance(node.op, (ast.Div, ast.Pow))
        if isinstance(node, ast.Constant):
            assert not isinstance(node.value, float)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            assert node.func.id not in SLOW


def test_a_closure_of_the_tick_never_allocates_when_called():
    """Closed-over names and arguments together beyond five do: native code closes over none,
    viper, which has no defaults, over few."""
    for path in TICK:
        for outer in ast.walk(tree(path)):
            if not isinstance(outer, ast.FunctionDef):
                continue
            bound = {a.arg for a in outer.args.args} | {
                n.id for n in own_nodes(outer)
                if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
            }  # fmt: skip
            for inner in outer.body:
                if isinstance(inner, ast.FunctionDef) and is_fast(inner):
                    own = {a.arg for a in inner.args.args}
                    used = {n.id for n in own_nodes(inner) if isinstance(n, ast.Name)}
                    closed = (used & bound) - own
                    viper = any(d.attr == "viper" for d in inner.decorator_list)
                    assert len(closed) + len(own) <= 5 if viper else not closed, (
                        path.name, inner.name, closed,
                    )  # fmt: skip


# ---- the words that both worlds share

ROW = re.compile(r"^(\d+) +([A-Z_]+) +([FT](?: T)?) ", re.M)


def table():
    text = ast.get_docstring(tree(ROOT / "firmware" / "tick" / "words.py"))
    return {name: int(place) for place, name, _ in ROW.findall(text)}


# other arrays' places have names of their own in these files
OTHER_ARRAYS = {
    "_RUNNING", "_TOOK", "_TICKS", "_ROLL", "_PITCH", "_YAW", "_AT_REST", "_UNCERTAIN",
    "_EST_UNCERTAIN", "_EST_YAW", "_EST_TURNS",
}  # fmt: skip


def test_every_file_agrees_on_the_places_of_the_words():
    names = table()
    assert len(set(names.values())) == len(names)
    aliases = {"_BUSY_TICKS": "BUSY", "_BUSY": "BUSY"}
    users = 0
    for path in TICK + OTHERS:
        if path.name in ("timing.py", "estimate.py", "judge.py", "policy.py"):
            continue
        text = path.read_text()
        if "firmware.tick.words" not in text:
            continue
        for name, value in re.findall(r"^(_[A-Z_]+) = const\((\d+)\)", text, re.M):
            word = aliases.get(name, name[1:])
            if name in OTHER_ARRAYS or word not in names:
                continue
            if path.parent.name == "tick" and name == "_BUSY":
                continue  # a cause there
            assert names[word] == int(value), (path.name, name)
            users += 1
    assert users > 60

# SPDX-License-Identifier: MIT
"""The integer attitude's array: every file means the same place by the same name.

The list is the table in the comment of attitude/fixed/attitude/__init__.py.
"""

import ast
import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).resolve().parents[2] / "lib" / "attitude" / "fixed" / "attitude"
FILES = {path.stem: path for path in sorted(FOLDER.glob("*.py"))}
WRITER = {"__init__": "set", "coefficients": "set"}
NO_PLACES = re.compile(
    "_(LEAST.*|MOST_[A-Z]{5,}|WALKED|WILD|STEPS|SEEN_US|UNSEEN|UNTAUGHT|CLAIMED|DOUBTED|"
    "(REST|START|SLOW)_(SIGMA|TILT))$"
)
ROW = re.compile(r"(\d+)(?:-(\d+))? +(-|[A-Z_0-9]+) +(\S.*?) {2,}([a-z]+(?:, [a-z]+)*)$")


def table():
    """[(first, last, name or "-", writers)] of the comment."""
    text = FILES["__init__"].read_text().split("written by\n")[1].split("\n\n")[0]
    rows = []
    for line in text.splitlines():
        found = ROW.match(line.removeprefix("# "))
        assert found, line
        first, last, name, _, writers = found.groups()
        rows.append((int(first), int(last or first), name, writers.split(", ")))
    return rows


def constants(path):
    """{name: value} of the file's const()s."""
    found = {}
    for node in ast.parse(path.read_text()).body:
        if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
            call = node.value
            if isinstance(call.func, ast.Name) and call.func.id == "const":
                found[node.targets[0].id] = ast.literal_eval(call.args[0])
    return found


def stores(path):
    """Places that the file stores to: a number, a const() or one of them plus something."""
    names = constants(path)
    for node in ast.walk(ast.parse(path.read_text())):
        if not (isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store)):
            continue
        if not (isinstance(node.value, ast.Name) and node.value.id in ("s", "far")):
            continue  # s is the array in every file, far the same from a place further on
        place = node.slice
        while isinstance(place, ast.BinOp):
            place = place.left
        if isinstance(place, ast.Constant):
            yield place.value
        elif isinstance(place, ast.Name) and place.id in names:
            yield names[place.id]


def test_the_table_has_every_place_once():
    rows = table()
    places = [place for first, last, _, _ in rows for place in range(first, last + 1)]
    assert places == list(range(constants(FILES["__init__"])["_STATE_END"]))
    names = [name for _, _, name, _ in rows if name != "-"]
    assert len(set(names)) == len(names)


@pytest.mark.parametrize("name", FILES)
def test_every_constant_is_that_of_the_table(name):
    starts = {"_" + row: first for first, _, row, _ in table()}
    borders = {border for first, last, *_ in table() for border in (first, last + 1)}
    for const, value in constants(FILES[name]).items():
        if const.endswith(("_STATE", "_END")):
            assert value in borders, const
        elif not NO_PLACES.match(const):
            assert starts.get(const) == value, const


@pytest.mark.parametrize("name", FILES)
def test_only_those_named_write_a_place(name):
    for place in stores(FILES[name]):
        row = next(row for row in table() if row[0] <= place <= row[1])
        assert WRITER.get(name, name) in row[3], row


def test_the_kalman_filters_two_files_agree():
    files = ("kalman_step.py", "kalman_tilt2.py")
    step, rest = (constants(FOLDER.parent / name) for name in files)
    shared = set(step) & set(rest)
    assert len(shared) > 10
    assert {name: step[name] for name in shared} == {name: rest[name] for name in shared}
    base = constants(FOLDER.parent / "base.py")
    for name in ("_GYRO_SHIFT", "_STEP", "_RATE", "_RATE_SHIFT"):
        assert step[name] == base[name] == constants(FILES["step"])[name]
    assert constants(FOLDER.parent / "gap.py")["_STEP"] == base["_STEP"]

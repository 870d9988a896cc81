# SPDX-License-Identifier: MIT
"""No viper function has an index where MicroPython 1.26 and 1.27 would change it.

Their compilers for Thumb and RV32 multiply the index of a ptr16 or ptr32 in place when it is a
local that lives in a register: one of the first two with mpy-cross, which tools.machine_code
runs, but one of the first three when the board itself compiles. Locals count from the arguments
on, in the order in which they are first assigned.
"""

import ast

from tools.machine_code import functions
from tools.machine_code.mpy import VIPER

REGISTERS = 3
CHECK = "attitude.fixed.compiler_check."  # made to be compiled wrongly, and to say so
POINTERS = ("ptr16", "ptr32")


def _locals(node):
    stored = [
        (n.lineno, n.col_offset, n.id)
        for n in ast.walk(node)
        if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)
    ]
    names = [argument.arg for argument in node.args.args] + [n for _, _, n in sorted(stored)]
    return list(dict.fromkeys(names))


def _pointers(node):
    typed = [a for a in node.args.args if a.annotation]
    found = {a.arg for a in typed if ast.unparse(a.annotation) in POINTERS}
    for n in ast.walk(node):
        if isinstance(n, ast.Assign) and ast.unparse(n.value).partition("(")[0] in POINTERS:
            found.update(target.id for target in n.targets)
    return found


def changed_indexes(path):
    """{function: its index locals that a register holds} of a file."""
    lines = {f.line: f.name for f in functions.find(path) if f.kind == VIPER}
    found = {}
    for node in ast.walk(ast.parse(path.read_text())):
        line = min((d.lineno for d in getattr(node, "decorator_list", ())), default=None)
        if line not in lines:
            continue
        held, pointers = _locals(node)[:REGISTERS], _pointers(node)
        used = {
            n.slice.id
            for n in ast.walk(node)
            if isinstance(n, ast.Subscript)
            and isinstance(n.slice, ast.Name)
            and ast.unparse(n.value) in pointers
        }
        found[lines[line]] = sorted(used & set(held))
    return found


def test_the_rule_finds_what_those_compilers_get_wrong():
    found = changed_indexes(functions.SNIPPETS)
    for name in ("index32_after_load", "index16_after_load", "in_place"):
        assert found["snippets." + name] == ["i"]
    assert found["snippets.constant_index32"] == found["snippets.index8_in_a_loop"] == []


def test_no_function_of_the_board_has_one():
    found = {}
    for path in functions.sources():
        if path != functions.SNIPPETS:
            found.update(changed_indexes(path))
    assert found.pop(CHECK + "words") and found.pop(CHECK + "halves")
    wrong = {name: indexes for name, indexes in found.items() if indexes}
    assert wrong == {}, "write p[i + 0], or assign the index after two other locals"
    assert len(found) > 20

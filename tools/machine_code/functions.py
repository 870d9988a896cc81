# SPDX-License-Identifier: MIT
"""Every viper and native function of a source file, by name, and where its machine code is.

A .mpy names no viper function. Its code is found by its place: functions, classes and
comprehensions have their code in the order in which the compiler meets them.
"""

import ast
import keyword
import re
from pathlib import Path
from typing import NamedTuple

from . import compilers
from .mpy import BYTECODE, NATIVE, VIPER, Mpy

ROOT = Path(__file__).resolve().parents[2]
SNIPPETS = Path(__file__).with_name("snippets.py")
_KINDS = {"native": NATIVE, "viper": VIPER}
_COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)


class Function(NamedTuple):
    """A decorated function.

    name: with its module, as in a table; path and line: of its first decorator, which is what
    CPython says of a function; place: child numbers from the module's code to its own; types: of
    its arguments, "" where there is none; inner: it is made anew by each call of another.
    """

    name: str
    path: str
    line: int
    kind: int
    place: tuple
    types: tuple
    inner: bool


class Scope(NamedTuple):
    """What has code of its own in a file: its name ("" for some), kind and children."""

    node: ast.AST
    name: str
    kind: int
    children: list


def sources():
    """The files that may hold such functions: lib/, firmware/ and the snippets."""
    found = [p for top in ("lib", "firmware") for p in sorted((ROOT / top).rglob("*.py"))]
    return [p for p in [*found, SNIPPETS] if re.search(r"@micropython\.(viper|native)", _text(p))]


def _text(path):
    return Path(path).read_text()


def _kind(node):
    for decorator in getattr(node, "decorator_list", ()):
        if isinstance(decorator, ast.Attribute) and decorator.attr in _KINDS:
            return _KINDS[decorator.attr]
    return BYTECODE


def _scopes(nodes):
    """The scopes that these nodes open, in the compiler's order."""
    found = []
    for node in nodes:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            body = node.body if isinstance(node.body, list) else [node.body]
            before = [*getattr(node, "decorator_list", ()), *node.args.defaults]
            before += [default for default in node.args.kw_defaults if default]
            found += _scopes(before)
            found.append(Scope(node, getattr(node, "name", ""), _kind(node), _scopes(body)))
        elif isinstance(node, ast.ClassDef):
            found += _scopes(node.decorator_list)
            found.append(Scope(node, node.name, BYTECODE, _scopes(node.body)))
            found += _scopes(node.bases)
        elif isinstance(node, _COMPREHENSIONS):
            first, *others = node.generators
            inner = [first.target, *first.ifs, *others, *_results(node)]
            found.append(Scope(node, "", BYTECODE, _scopes(inner)))
            found += _scopes([first.iter])
        elif isinstance(node, ast.AnnAssign):  # annotations have no code
            found += _scopes([n for n in (node.target, node.value) if n])
        else:
            found += _scopes(ast.iter_child_nodes(node))
    return found


def _results(node):
    return [node.key, node.value] if isinstance(node, ast.DictComp) else [node.elt]


def module_name(path):
    """A file's name as board code imports it."""
    parts = Path(path).relative_to(ROOT).with_suffix("").parts
    parts = parts[1:] if parts[0] == "lib" else parts[-1:] if parts[0] == "tools" else parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def find(path):
    """The Functions of a file, in its order."""
    found = []

    def walk(scopes, prefix, place, inner):
        for number, scope in enumerate(scopes):
            here, name = (*place, number), prefix + "." + scope.name
            if scope.kind != BYTECODE:
                notes = [a.annotation for a in scope.node.args.args]
                types = tuple([ast.unparse(note) if note else "" for note in notes])
                line = min(d.lineno for d in scope.node.decorator_list)
                found.append(Function(name, str(path), line, scope.kind, here, types, inner))
            deeper = inner or not isinstance(scope.node, ast.ClassDef)
            walk(scope.children, name, here, deeper)

    walk(_scopes(ast.parse(_text(path)).body), module_name(path), (), False)
    return found


def code_at(mpy, place):
    """The Code at a Function's place."""
    code = mpy.root
    for number in place:
        code = code.children[number]
    return code


def check_places(path, code, scopes=None):
    """ValueError unless the tree of code has the shape of the source: no place would be right."""
    scopes = _scopes(ast.parse(_text(path)).body) if scopes is None else scopes
    if [scope.kind for scope in scopes] != [child.kind for child in code.children]:
        names = [scope.name for scope in scopes]
        raise ValueError("%s: %s have other code than expected" % (path, names))
    for scope, child in zip(scopes, code.children):
        check_places(path, child, scope.children)


_static = {}


def static_names(version):
    """{number: name} of the names that a .mpy of this version gives as numbers.

    All words of all sources are compiled as names, in a known order, and come out as numbers
    where the compiler has one.
    """
    if version not in _static:
        words = {w for path in sources() for w in re.findall(r"\b[A-Za-z_]\w*", _text(path))}
        words |= {"__enter__", "__exit__"}  # of a `with`, which names them without a word
        words = sorted(words - set(keyword.kwlist))
        names = Mpy(compilers.compile_file(version, "armv6m", "\n".join(words), "?")).names[2:]
        if len(names) != len(words):
            raise ValueError("mpy-cross %s: %d names of %d" % (version, len(names), len(words)))
        _static[version] = {n: w for n, w in zip(names, words) if isinstance(n, int)}
    return _static[version]

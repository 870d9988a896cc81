# SPDX-License-Identifier: MIT
"""Imports of board code: it sees the board's modules, and nothing that only a PC has."""

import ast
import builtins
import importlib
import sys
from importlib.machinery import PathFinder, SourceFileLoader
from pathlib import Path

from tools.virtual import viper

ROOT = Path(__file__).resolve().parents[3]
_HOST = {
    "array", "binascii", "builtins", "cmath", "collections", "deflate", "hashlib", "heapq",
    "io", "json", "math", "random", "re", "struct", "uctypes",
}  # fmt: skip
_REPLACED = {
    "asyncio", "errno", "gc", "machine", "micropython", "os", "rp2", "esp32", "select", "sys",
    "time",
}  # fmt: skip


def board_names(paths):
    """Top-level names that board code may import from the given folders."""
    names = set()
    for folder in map(Path, paths):
        if folder.is_dir():
            names.update(
                entry.stem
                for entry in folder.iterdir()
                if entry.suffix == ".py" or _is_package(entry)
            )
    return names


def _is_package(entry):
    return entry.is_dir() and any(entry.glob("*.py"))


class _BoardErrors(ast.NodeTransformer):
    """`OSError(5)` has its errno on the board, on CPython only with a second argument."""

    def visit_Call(self, node):
        self.generic_visit(node)
        plain = len(node.args) == 1 and not node.keywords
        if plain and isinstance(node.func, ast.Name) and node.func.id == "OSError":
            node.func.id = "_board_oserror"
        return node


_codes = {}  # path: (modification time, code), so that a fresh import need not compile again


def board_code(path):
    """Compile a file of board code as the virtual board needs it."""
    path = str(path)
    changed = Path(path).stat().st_mtime_ns
    if _codes.get(path, (None,))[0] != changed:
        tree = _BoardErrors().visit(ast.parse(Path(path).read_text(), path))
        _codes[path] = (changed, compile(tree, path, "exec", dont_inherit=True))
    return _codes[path][1]


class _Loader(SourceFileLoader):
    """Runs a module with the Port's builtins."""

    def __init__(self, fullname, path, board_builtins):
        super().__init__(fullname, path)
        self._board_builtins = board_builtins

    def get_code(self, fullname):
        return board_code(self.path)

    def exec_module(self, module):
        module.__dict__["__builtins__"] = self._board_builtins
        super().exec_module(module)


class Importer:
    """A meta-path finder for the board's own modules, and the `__import__` that they use."""

    def __init__(self, port, replaced, extra_paths=()):
        self.port, self.replaced = port, replaced
        self.paths = [*map(str, extra_paths), str(ROOT / "lib"), str(ROOT)]
        self.names = board_names([*extra_paths, ROOT / "lib"]) | {"firmware", "main", "boot"}
        viper.install_types()  # before the copy that board code sees
        self.builtins = {
            **vars(builtins),
            "__import__": self.board_import,
            "open": self.board_open,
            "print": self.board_print,
            "_board_oserror": viper.oserror,
        }

    def board_open(self, name, mode="r", *arguments, **settings):
        return open(self.port.path(name), mode, *arguments, **settings)

    def board_print(self, *values, **settings):
        self.port.hard.refuse("print")
        if settings.get("file") is None:
            self.port.console.write(len(" ".join(map(str, values))) + 2)
        print(*values, **settings)
        self.port.clock.breathe()  # the next bytecodes: what waits runs between two prints

    def find_spec(self, fullname, path=None, target=None):
        top = fullname.partition(".")[0]
        if top not in self.names:
            return None
        spec = PathFinder.find_spec(fullname, self.paths if path is None else path)
        if spec is not None and isinstance(spec.loader, SourceFileLoader):
            spec.loader = _Loader(fullname, spec.loader.path, self.builtins)
        return spec

    def board_import(self, name, variables=None, local=None, fromlist=(), level=0):
        """`import` inside board code; ImportError for what a board does not have."""
        self.port.hard.refuse("import")
        if level == 0:
            top = name.partition(".")[0]
            plain = top[1:] if top[:1] == "u" and top[1:] in _HOST | _REPLACED else top
            if plain in self.replaced:
                return self.replaced[plain]
            if plain not in _HOST and top not in self.names:
                raise ImportError("no module named %r on this board" % name)
            if plain != top:
                return importlib.import_module(plain)
        return builtins.__import__(name, variables, local, fromlist, level)

    def install(self):
        """Forget the board modules imported so far and take over; returns what `remove` needs."""
        saved = {
            n: sys.modules.pop(n) for n in list(sys.modules) if n.partition(".")[0] in self.names
        }
        sys.meta_path.insert(0, self)
        importlib.invalidate_caches()
        return saved

    def remove(self, saved):
        sys.meta_path.remove(self)
        for n in list(sys.modules):
            if n.partition(".")[0] in self.names:
                del sys.modules[n]
        sys.modules.update(saved)

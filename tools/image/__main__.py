# SPDX-License-Identifier: MIT
"""`python -m tools.image --json FILE`: builds the images, measures them, says what they cost."""

import argparse
import json
import shutil
import sys
import tomllib
from pathlib import Path

from tools.image import measure
from tools.image.build import Sources, build, flash_bytes
from tools.image.frozen import write_manifest
from tools.virtual.images import VERSIONS, FirmwareError
from tools.virtual.rp2040.flash import ROOT

BOARDS = ("RPI_PICO", "RPI_PICO_W")
EMULATED = "RPI_PICO"
ROWS = (  # name in the JSON, what it is, unit
    ("bytes_added", "added to the image", "bytes"),
    ("heap_used", "heap of the running app", "bytes"),
    ("heap_free", "heap that is left", "bytes"),
    ("collect_ms", "one garbage collection", "ms"),
    ("import_ms", "importing the app", "ms"),
    ("start_ms", "power-on to the first angle", "ms"),
)


def main():
    options = _parse()
    try:
        sources = Sources(options.micropython, options.source)
        if options.manifest:
            return _manifest(options, sources)
        results = {board: _image(board, sources, options) for board in options.board or BOARDS}
    except FirmwareError as error:
        print(f"image: {error}", file=sys.stderr)
        return 1
    measured = results.get(EMULATED, {})
    if options.json and measured:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps({"micropython": sources.name, **measured}, indent=1))
    return 0


def _image(board, sources, options):
    """Build one board's image, copy it to where it was wanted, and say what it costs."""
    cached = build(board, sources)
    plain = build(board, sources, ours=False)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    name = f"plumb-{project['version']}-{board}-micropython-{sources.name}.uf2"
    options.out.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(cached, options.out / name)
    added = flash_bytes(cached) - flash_bytes(plain)
    print(f"{options.out / name}: {added} bytes more than MicroPython {sources.name} alone")
    if board.endswith("_W") and not sources.radio(board):
        print("  without Wi-Fi and Bluetooth, whose drivers only a checkout has: --source")
    if board != EMULATED or options.no_measure:
        return {"bytes_added": added}
    frozen = {"bytes_added": added, **measure.frozen(cached)}
    copied = {"bytes_added": 0, **measure.copied(plain)}
    _show(frozen, copied)
    return {**frozen, "copied": copied}


def _show(frozen, copied):
    print(f"  {'on the emulated RP2040':<30}{'frozen':>10}{'copied':>10}")
    for key, text, unit in ROWS:
        print(f"  {text:<30}{frozen[key]:>10}{copied[key]:>10} {unit}")


def _manifest(options, sources):
    for board in options.board or BOARDS[:1]:
        board_dir = sources.tree / "ports" / options.port / "boards" / board
        print(write_manifest(options.manifest, sources.tree, options.port, board_dir))
    return 0


def _parse():
    parser = argparse.ArgumentParser(prog="python -m tools.image", description=__doc__)
    parser.add_argument("--board", action="append", help=f"default: {' and '.join(BOARDS)}")
    parser.add_argument(
        "--micropython", default=VERSIONS[-1], choices=VERSIONS, help="default: %(default)s"
    )
    parser.add_argument("--source", metavar="DIR", help="a checkout of MicroPython to build")
    parser.add_argument("--out", type=Path, default=Path("out/image"), help="default: %(default)s")
    parser.add_argument("--json", type=Path, metavar="FILE", help="what was measured")
    parser.add_argument("--no-measure", action="store_true", help="build only")
    parser.add_argument("--manifest", metavar="DIR", help="write what another build freezes there")
    parser.add_argument("--port", default="rp2", help="of the manifest; default: %(default)s")
    return parser.parse_args()


if __name__ == "__main__":
    sys.exit(main())

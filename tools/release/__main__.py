# SPDX-License-Identifier: MIT
"""`python -m tools.release`: checks, then makes all that a release offers into one folder."""

import argparse
import hashlib
import shutil
import sys
from pathlib import Path

from tools.image.build import Sources, build, flash_bytes
from tools.release.bundles import write_bundles
from tools.release.checks import (
    BUNDLE_BYTES,
    IMAGE_BYTES,
    NotReady,
    check_size,
    check_texts,
    notes,
    version,
)
from tools.release.index import write_index
from tools.virtual.images import VERSIONS, FirmwareError

BOARDS = ("RPI_PICO", "RPI_PICO_W")


def main():
    """The command; exit code 1 with what is not ready on stderr."""
    parser = argparse.ArgumentParser(prog="python -m tools.release", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("out/release"))
    parser.add_argument("--draft", action="store_true", help='the changelog says "unreleased"')
    parser.add_argument("--no-images", action="store_true", help="leave out the frozen images")
    options = parser.parse_args()
    try:
        check_texts(options.draft)
        make(options.out, [] if options.no_images else BOARDS)
    except (NotReady, FirmwareError) as error:
        print(f"not ready:\n{error}", file=sys.stderr)
        return 1
    return 0


def make(out, boards):
    """Make it all anew into the folder `out`; NotReady when something is too large."""
    number = version()
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    for name, files, size in write_index(out / "index", number):
        print(f"mip  {name:<12}{files:4} files {size:8} bytes")
    for path, files, size in write_bundles(out, number):
        check_size(path.name, size, BUNDLE_BYTES)
        print(f"{path.name}: {files} files, {size} bytes unpacked")
    for board in boards:
        _image(out, number, board)
    (out / "NOTES.md").write_text("# Plumb %s\n\n%s\n" % notes())
    made = sorted(path for path in out.rglob("*") if path.is_file())
    lines = [f"{_digest(path)}  {path.relative_to(out).as_posix()}\n" for path in made]
    (out / "SHA256SUMS").write_text("".join(lines))
    print(f"{out}: {len(made)} files")


def _image(out, number, board):
    sources = Sources(VERSIONS[-1])
    image, plain = build(board, sources), build(board, sources, ours=False)
    added = flash_bytes(image) - flash_bytes(plain)
    name = f"plumb-{number}-{board}-micropython-{sources.name}.uf2"
    check_size(f"{name}, added to MicroPython", added, IMAGE_BYTES)
    shutil.copyfile(image, out / name)
    print(f"{name}: {added} bytes added")


def _digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


if __name__ == "__main__":
    sys.exit(main())

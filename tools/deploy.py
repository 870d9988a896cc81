# SPDX-License-Identifier: MIT
"""Copies boot.py, main.py, lib/ and firmware/ to a board with mpremote, and starts it.

`python -m tools.deploy --port /dev/ttyACM0`. Modules go as .mpy, compiled for the board's
processor when its MicroPython can load what mpy-cross makes, else as they are. A file that the
board has already is left alone.
"""

import argparse
import ast
import base64
import hashlib
import sys
import time
from pathlib import Path

from mpremote.transport import TransportError
from mpremote.transport_serial import SerialTransport

from tools.virtual.rp2040.flash import cross_compile, project_files

# sys.implementation._mpy >> 10: MicroPython's codes of native architectures, mpy-cross's names
ARCHITECTURES = {4: "armv6m", 5: "armv7m", 6: "armv7em", 7: "armv7emsp", 8: "armv7emdp",
                 9: "xtensa", 10: "xtensawin", 11: "rv32imc"}  # fmt: skip
MPY_VERSION = 6  # the low byte of _mpy: what mpy-cross of this version writes
FOLDERS = (  # what is ours alone
    "lib/mpu6050",
    "lib/calibration",
    "lib/attitude",
    "lib/control",
    "firmware",
)
CHUNK = 3072  # bytes of a file in one command: a fortieth of the smallest board's heap

_IDENTITY = "import sys; i=sys.implementation; print((sys.platform,i._machine,i.version,i._mpy))"
_LIST = """
import os, hashlib, binascii
def walk(p):
    for e in os.ilistdir(p):
        q = p + '/' + e[0]
        if e[1] == 0x4000:
            yield from walk(q)
        else:
            h = hashlib.sha256()
            with open(q, 'rb') as f:
                while True:
                    b = f.read(512)
                    if not b:
                        break
                    h.update(b)
            yield q, binascii.hexlify(h.digest()).decode()
for top in %r:
    try:
        for item in walk(top):
            print(item)
    except OSError:
        pass
"""


class DeployError(Exception):
    """What went wrong and what to check, in one text."""


def open_board(port):
    """mpremote's transport to the board at a serial port, its program stopped. DeployError."""
    try:
        board = SerialTransport(port)
    except (TransportError, OSError) as error:
        there = ", ".join(map(str, sorted(Path("/dev").glob("tty[AU][CS][MB]*")))) or "none"
        raise DeployError(
            f"no board at {port} ({error}; serial ports here: {there}). Check: the cable carries "
            "data, you may use the port (group dialout), its name (PORT=)"
        ) from error
    try:
        board.enter_raw_repl(soft_reset=True)
    except TransportError as error:
        raise DeployError(
            f"{port} is there but no MicroPython answers ({error}). Check: no other program "
            "(Thonny, a terminal) uses the port; press RESET; flash MicroPython"
        ) from error
    return board


def project(architecture):
    """{path on the board: bytes}; modules as .mpy for this architecture, None: as source."""
    files = {}
    found = project_files()
    found["main.py"] = found.pop("main.py")  # last: a copy cut short starts nothing
    for path, source in found.items():
        data = source.read_bytes()
        if architecture is None or path in ("boot.py", "main.py"):
            files[path] = data
        else:
            files[path[:-3] + ".mpy"] = cross_compile(data, path, architecture)
    return files


def write(board, path, data):
    """Write one file by the raw REPL. TransportError when the board refuses."""
    board.exec(f"f=open({path!r},'wb')")
    for start in range(0, len(data), CHUNK):
        text = base64.b64encode(data[start : start + CHUNK])
        board.exec(b"f.write(a2b(b'" + text + b"'))")
    board.exec("f.close()")


def make_folders(board, paths):
    """Make the folders of these files, those that are missing."""
    folders = sorted({str(p) for path in paths for p in Path(path).parents if str(p) != "."})
    board.exec(f"import os\nfor p in {folders!r}:\n try:\n  os.mkdir(p)\n except OSError:\n  pass")


def deploy(port, source=False, say=print):
    """Copy what differs, remove what is ours and gone, reset. DeployError says what to check."""
    board = open_board(port)
    try:
        answer = board.exec(_IDENTITY).decode()
        platform, name, version, mpy = ast.literal_eval(answer.strip())
        say(f"{name} ({platform}), MicroPython {'.'.join(map(str, version[:3]))}")
        fits = not source and mpy & 0xFF == MPY_VERSION
        files = project(ARCHITECTURES.get(mpy >> 10) if fits else None)
        there = dict(map(ast.literal_eval, board.exec(_LIST % (FOLDERS,)).decode().splitlines()))
        for path in sorted(set(there) - set(files)):  # a .py left over would hide the new .mpy
            board.exec(f"import os; os.remove({path!r})")
        new = {p: d for p, d in files.items() if there.get(p) != hashlib.sha256(d).hexdigest()}
        say(f"{len(files)} files, {len(new)} to copy")
        make_folders(board, new)
        board.exec("from binascii import a2b_base64 as a2b")
        began, done, total = time.monotonic(), 0, sum(map(len, new.values()))
        for path, data in new.items():
            write(board, path, data)
            done += len(data)
            say(f"{100 * done // total:3d} %  {time.monotonic() - began:5.1f} s  {path}")
        board.exec_raw_no_follow("import machine; machine.reset()")
    except TransportError as error:
        raise DeployError(f"{port}: the board stopped answering or refused: {error}") from error
    finally:
        board.close()
    say(f"started; see its angles with: mpremote connect {port} resume exec 'app.watch()'")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--port", help="serial port of the board, as /dev/ttyACM0")
    parser.add_argument("--source", action="store_true", help="copy .py files, not .mpy")
    args = parser.parse_args()
    if not args.port:
        parser.error("name the board's serial port: make deploy PORT=/dev/ttyACM0")
    try:
        deploy(args.port, args.source)
    except DeployError as error:
        print(f"deploy: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Copies boot.py, main.py, lib/ and firmware/ to a board with mpremote, and starts it.

`python -m tools.deploy --port /dev/ttyACM0`. Modules go as .mpy, compiled for the board's
processor when its MicroPython can load what mpy-cross makes, else as they are.
"""

import argparse
import ast
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tools.virtual.rp2040.flash import cross_compile, project_files

# sys.implementation._mpy >> 10: MicroPython's codes of native architectures, mpy-cross's names
ARCHITECTURES = {3: "armv6m", 4: "armv7m", 5: "armv7em", 6: "armv7emsp", 7: "armv7emdp",
                 9: "xtensa", 10: "xtensawin", 11: "rv32imc"}  # fmt: skip
MPY_VERSION = 6

_ASK = "import sys; i = sys.implementation; print((sys.platform, i._machine, i.version, i._mpy))"
_EMPTY = (
    "import os\n"
    "def r(p):\n"
    " for e in os.ilistdir(p):\n"
    "  q = p + '/' + e[0]\n"
    "  if e[1] == 0x4000:\n"
    "   r(q)\n"
    "   os.rmdir(q)\n"
    "  else:\n"
    "   os.remove(q)\n"
    "for p in ('lib/mpu6050', 'lib/attitude', 'lib/control', 'firmware'):\n"
    " try:\n"
    "  r(p)\n"
    " except OSError:\n"
    "  pass\n"
)


class DeployError(Exception):
    """What went wrong and what to check, in one text."""


def mpremote(port, *arguments, timeout_s=60):
    """What mpremote printed. DeployError with its words when it fails."""
    command = [sys.executable, "-m", "mpremote", "connect", port, *arguments]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=timeout_s)
    except subprocess.TimeoutExpired:
        raise DeployError(
            f"{port} does not answer within {timeout_s} s. Check: is another program (Thonny, a "
            "terminal) using the port; unplug the board and plug it in again"
        ) from None
    if done.returncode:
        raise DeployError(_explain(port, done.stdout + done.stderr))
    return done.stdout


def _explain(port, text):
    text = text.strip()
    if "no device found" in text or "failed to access" in text or "could not open" in text:
        there = ", ".join(map(str, sorted(Path("/dev").glob("tty[AU][CS][MB]*")))) or "none"
        return (
            f"no board at {port} (serial ports here: {there}). Check: the cable carries data, "
            f"MicroPython is on the board, you may use the port (group dialout), PORT= names it"
        )
    if "could not enter raw repl" in text:
        return f"{port} is there but no MicroPython answers: press RESET, or flash MicroPython\n{text}"
    return f"{port}: {text}"


def compiled_files(architecture):
    """{path on the board: bytes}; modules as .mpy for this architecture, None: as source."""
    files = {}
    for path, source in project_files().items():
        data = source.read_bytes()
        if architecture is None or path in ("boot.py", "main.py"):
            files[path] = data
        else:
            files[path[:-3] + ".mpy"] = cross_compile(data, path, architecture)
    return files


def deploy(port, source=False, timeout_s=60, say=print):
    """Copy everything and reset the board. `source`: .py files even where .mpy would load."""
    answer = mpremote(port, "exec", _ASK, timeout_s=timeout_s)
    platform, name, version, mpy = ast.literal_eval(answer.strip().splitlines()[-1])
    say(f"{name} ({platform}), MicroPython {'.'.join(map(str, version[:3]))}")
    architecture = ARCHITECTURES.get(mpy >> 10)
    if source or mpy & 0xFF != MPY_VERSION:
        architecture = None
    files = compiled_files(architecture)
    kind = f".mpy for {architecture}" if architecture else "source"
    say(f"{len(files)} files, {sum(map(len, files.values())) // 1024} KiB as {kind}")
    # old modules go first: a .py left over would be imported in place of the new .mpy
    mpremote(port, "resume", "exec", _EMPTY, timeout_s=timeout_s)
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for path, data in files.items():
            local = Path(folder, path)
            local.parent.mkdir(parents=True, exist_ok=True)
            local.write_bytes(data)
            names.append(path)
        parts = [["lib"], ["firmware"], ["boot.py"], ["main.py"]]  # main.py last: all or nothing
        for number, part in enumerate(parts, 1):
            local = Path(folder, *part)
            command = ["cp", "-r"] if local.is_dir() else ["cp"]
            mpremote(port, "resume", "fs", *command, str(local), ":", timeout_s=10 * timeout_s)
            say(f"[{number}/{len(parts)}] {part[0]:<10} {time.monotonic() - began:5.1f} s")
    mpremote(port, "resume", "reset", timeout_s=timeout_s)
    say("the board starts; see its angles with: mpremote connect " + port + " resume repl")


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--port", default="auto", help="serial port, default: the first board")
    parser.add_argument("--source", action="store_true", help="copy .py files, not .mpy")
    parser.add_argument("--timeout", type=float, default=60, help="seconds for one step")
    args = parser.parse_args()
    try:
        deploy(args.port, args.source, args.timeout)
    except DeployError as error:
        print(f"deploy: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())

# SPDX-License-Identifier: MIT
"""Looks a real board over, once: wires, sensor, bus, self-test, noise, loop; a report to paste.

    python -m tools.board_check --port /dev/ttyACM0 [--out FILE]
    python -m tools.board_check --virtual           the same on the emulated Pico

The board must hold the project (make deploy) and lie still; it takes half a minute and leaves the
board reset. Lines that begin with "!" are what to look at.
"""

import argparse
import datetime
import platform
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parent / "board_scripts" / "board_check.py"
_END = "end of the check"
_PATIENCE_S = 120


class CheckError(Exception):
    """Why there is no report, in words."""


def run_on(port):
    """What the script prints on the board at a serial port; CheckError."""
    command = [sys.executable, "-m", "mpremote", "connect", port, "run", str(SCRIPT)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=_PATIENCE_S)
    except subprocess.TimeoutExpired as error:
        text = (error.stdout or b"").decode(errors="replace")
        raise CheckError(f"{port}: no end after {_PATIENCE_S} s; so far:\n{text}") from None
    if done.returncode and not done.stdout.strip():
        raise CheckError(f"{port}: {done.stderr.strip()}")
    subprocess.run([*command[:5], "reset"], capture_output=True, timeout=20, check=False)
    return done.stdout


def run_emulated(motion=None, seconds=2.0, micropython="1.26.1"):
    """What the script prints on the emulated Pico, its sensor at rest."""
    from tools.virtual import Bus, MPU6050Chip, VirtualPico

    bus = Bus(MPU6050Chip(motion, seed=3, gyro_bias_dps=(1.0, -2.0, 0.5)))
    with VirtualPico(bus=bus, root=True, main=False, micropython=micropython) as pico:
        text = f"seconds = {seconds}\n" + SCRIPT.read_text()
        return pico.exec(text, timeout_s=_PATIENCE_S)


def report(printed, today=None):
    """(text to paste, whether all is well) of what the script printed."""
    lines = [line.rstrip() for line in printed.splitlines() if line.strip()]
    whole = _END in lines
    body = [line for line in lines if line != _END]
    odd = [line for line in body if line.startswith("!") or "Traceback" in line]
    if not whole:
        odd.append("! the check broke off: is the project on the board? make deploy")
        body.append(odd[-1])
    today = today or datetime.date.today().isoformat()
    head = f"Plumb board check, {today}, Python {platform.python_version()} {sys.platform}"
    verdict = f"{len(odd)} things to look at" if odd else "nothing to complain of"
    return "\n".join(["```", head, *body, verdict, "```"]), not odd


def main(arguments=None):
    """The command."""
    parser = argparse.ArgumentParser(
        prog="python -m tools.board_check", description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )  # fmt: skip
    target = parser.add_mutually_exclusive_group(required=True)
    target.add_argument("--port", metavar="DEV", help="the board's serial port")
    target.add_argument("--virtual", action="store_true", help="the emulated Pico")
    parser.add_argument("--out", type=Path, metavar="FILE", help="write the report there too")
    options = parser.parse_args(arguments)
    try:
        printed = run_emulated() if options.virtual else run_on(options.port)
    except CheckError as error:
        print(f"board_check: {error}", file=sys.stderr)
        return 1
    text, good = report(printed)
    print(text)
    if options.out:
        options.out.write_text(text + "\n")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())

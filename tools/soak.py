# SPDX-License-Identifier: MIT
"""A day of the integer path on MicroPython itself, as fast as it goes.

    python -m tools.soak [--hours 24]

The unix port runs what every tick runs in integers (accounts of the loop on ticks_us that wrap,
guard, Attitude) on a periodic motion of known attitude, with noise. All must stay: the error, the
heap, the tick count.
"""

import argparse
import math
import random
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from tools.virtual import images
from tools.virtual.motion import quaternions as quat

ROOT = Path(__file__).resolve().parents[1]
SCRIPT = Path(__file__).parent / "board_scripts" / "soak.py"
RATE_HZ = 250
PERIOD_S = 20
BIAS_DPS = (0.05, -0.03, 0.0)  # what a calibration leaves


def _euler(t_s):
    turn = 2 * math.pi * t_s
    return 40 * math.sin(turn / 4), 15 * math.sin(turn / 2.5), 30 * math.sin(turn / 5)


def _rates(t_s, h=1e-4):
    """Body rates, deg/s, by the quaternion's central difference."""
    a, b = quat.from_euler(*_euler(t_s - h)), quat.from_euler(*_euler(t_s + h))
    turn = quat.product((a[0], -a[1], -a[2], -a[3]), b)
    return [math.degrees(2 * v) / (2 * h) for v in turn[1:]]


def tables(seed=1):
    """(bursts, level): words as the sensor gives them, and roll and pitch in mdeg, of a period."""
    noise = random.Random(seed)
    bursts, level = [], []
    for n in range(PERIOD_S * RATE_HZ):
        t_s = n / RATE_HZ
        roll, pitch, yaw = _euler(t_s)
        force = quat.gravity(quat.from_euler(roll, pitch, yaw))
        words = [round(4096 * f + noise.gauss(0, 10)) for f in force]
        words.append(-3900 + noise.randrange(3))
        for rate, bias in zip(_rates(t_s), BIAS_DPS):
            words.append(round(65.5 * (rate + bias) + noise.gauss(0, 2)))
        bursts += words
        level += [round(1000 * roll), round(1000 * pitch)]
    return bursts, level


def run(hours, say=print):
    """The script's figures as a dict; `say` gets a line for each hour."""
    bursts, level = tables()
    head = (
        f"import sys\nsys.path[:] = [{str(ROOT)!r}, {str(ROOT / 'lib')!r}]\n"
        "from array import array\n"
        f"HOURS = {hours}\nRATE_HZ = {RATE_HZ}\nPERIOD = {PERIOD_S * RATE_HZ}\n"
        f"BURSTS = array('h', {bursts})\nLEVEL = array('i', {level})\n"
    )
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder, "soak.py")
        script.write_text(head + SCRIPT.read_text())
        command = [str(images.unix_micropython()), "-X", "heapsize=16M", str(script)]
        pipe = subprocess.PIPE
        process = subprocess.Popen(command, stdout=pipe, stderr=subprocess.STDOUT, text=True)
        printed = []
        for line in process.stdout:
            printed.append(line)
            kind, *words = line.split()
            if kind == "hour":
                rows.append([int(word) for word in words])
                say(
                    "hour {:2}: error mean {:4} max {:5} mdeg, yaw {:+5} mdeg, {} bytes, "
                    "{} wraps, {} rejected".format(*rows[-1])
                )
            elif kind == "end":
                end = [int(word) for word in words]
        if process.wait():
            raise RuntimeError("".join(printed))
    return {"hours": rows, "samples": end[0], "ticks": end[1], "lost": end[2], "skipped": end[3]}


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.soak", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument("--hours", type=int, default=24, help="virtual hours; default: 24")
    options = parser.parse_args(arguments)
    began = time.monotonic()
    result = run(options.hours)
    rows = result["hours"][1:]
    print(
        f"{result['samples']} samples, {result['ticks']} ticks, {result['lost']} lost, "
        f"{result['skipped']} skipped, ticks_us wrapped {rows[-1][5]} times, "
        f"{sum(row[4] for row in rows)} bytes; error of the last hour: mean {rows[-1][1]}, max "
        f"{rows[-1][2]} mdeg   ({time.monotonic() - began:.0f} s)"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())

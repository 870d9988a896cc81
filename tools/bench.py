# SPDX-License-Identifier: MIT
"""Time and heap of each stage on the emulated RP2040, or on a real board with --port.

    python -m tools.bench [--json FILE] [--port DEV]

The board runs tools/board_scripts/bench.py. Times are net of an empty call; `bytes` is what the
heap grew by a call with the collector off, and `locked` tells that the stage ran with the heap
locked. A real board must hold the project (make deploy) and the sensor.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parent / "board_scripts" / "bench.py"
PARTS = ("main", "main_app")  # of the script, each after a new start
RATES_HZ = (250, 500, 1000)
# what the stages are meant to take at most on an RP2040 at 125 MHz, us
BARS_US = {
    "fixed.kalman2.update": 40,
    "fixed.attitude.update": 150,
    "step.kalman2": 520,
    "step.attitude": 650,
    "split.kalman2": 110,
    "split.attitude": 230,
    "app.blocking": 650,
    "app.split": 140,
    "read.angles": 12,
}


def run_emulated():
    """What the script prints on the emulated Pico, its sensor in free motion; and of another one,
    where nothing else was loaded, the heap of the running app."""
    from tools.image import measure
    from tools.virtual import images
    from tools.virtual.bus import Bus
    from tools.virtual.chip import MPU6050Chip
    from tools.virtual.motion.free_motion import FreeMotion
    from tools.virtual.pico import VirtualPico

    printed = ""
    for part in PARTS:
        bus = Bus(MPU6050Chip(motion=FreeMotion(seed=1)))
        with VirtualPico(bus=bus, root=True, main=False) as pico:
            printed += pico.exec(f"{SCRIPT.read_text()}\n{part}()\n", timeout_s=60)
    cost = measure.heap(images.rp2040_image())
    return "%sheap %d %d\n" % (printed, cost["heap_used"], cost["heap_free"])


def run_on(port):
    """What the script prints on the board at a serial port."""
    printed = ""
    for part in PARTS:
        code = f"{SCRIPT.read_text()}\n{part}()\n"
        command = [sys.executable, "-m", "mpremote", "connect", port, "exec", code]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        if done.returncode or "Traceback" in done.stdout:
            raise SystemExit(
                f"{port}: {done.stdout}{done.stderr}\nIs the project on it? make deploy"
            )
        printed += done.stdout
    return printed


def parse(text):
    """The script's lines as {"board", "mhz", "rows": [...], "modules": [...]}."""
    result = {"rows": [], "modules": [], "left": {}}
    for line in text.splitlines():
        kind, *words = line.split()
        if kind == "board":
            result["board"] = words[0].replace("_", " ")
            result["mhz"] = int(words[1])
        elif kind == "empty":
            result["empty_us"] = round(float(words[0]), 1)
        elif kind == "module":
            result["modules"].append(
                {"name": words[0], "import_ms": int(words[1]) / 1000, "ram_bytes": int(words[2])}
            )
        elif kind == "heap":
            result["heap"] = {"used": int(words[0]), "free": int(words[1])}
        elif kind == "left":
            result["left"][words[0]] = round(float(words[1]), 3)
        elif kind == "row":
            us, worst, size = (round(float(word), 1) for word in words[1:4])
            result["rows"].append(
                {
                    "name": words[0],
                    "us": us,
                    "worst_us": worst,
                    "bytes": size,
                    "locked": words[4] == "1",
                }
            )
    return result


def checks(result):
    """{burst: (us, per cent)}: what judging each burst adds to a step of the app."""
    us = {row["name"]: row["us"] for row in result["rows"]}
    found = {}
    for burst in ("blocking", "split"):
        bare = us[f"app.{burst}.unchecked"]
        extra = us[f"app.{burst}"] - bare
        found[burst] = (extra, 100 * extra / bare)
    return found


def table(result):
    """The result as text: stages, margins, modules."""
    lines = [
        f"{result['board']}, {result['mhz']} MHz; net of an empty call of {result['empty_us']} us",
        "",
        f"{'stage':24}{'us':>9}{'worst':>9}{'bar':>7}{'bytes':>8}  heap",
    ]
    for row in result["rows"]:
        lines.append(
            f"{row['name']:24}{row['us']:9.1f}{row['worst_us']:9.1f}"
            f"{BARS_US.get(row['name'], ''):>7}{row['bytes']:8g}"
            f"  {'may be locked' if row['locked'] else 'is used'}"
        )
    lines += ["", f"{'share of the period at':24}" + "".join(f"{hz:>7} Hz" for hz in RATES_HZ)]
    for row in result["rows"]:
        if row["name"].split(".")[0] in ("step", "split"):
            shares = "".join(f"{row['us'] * hz / 1e4:8.1f} %" for hz in RATES_HZ)
            lines.append(f"{row['name']:24}{shares}")
    lines += ["", "judging each burst: us a step of the app, share of the same step without it"]
    for burst, (us, share) in checks(result).items():
        lines.append(f"{burst:24}{us:9.1f}{share:8.1f} %")
    left = "".join(f"{100 * part:6.0f} % at {hz} Hz" for hz, part in result["left"].items())
    lines += ["", f"processor left beside the app:{left}"]
    if "heap" in result:  # a real board has more on it than the app
        used, free = result["heap"]["used"], result["heap"]["free"]
        lines += ["", f"heap of the running app, copied: {used} bytes; free: {free}"]
    lines += ["", f"{'import, in this order':28}{'ms':>7}{'RAM bytes':>12}"]
    for module in result["modules"]:
        lines.append(f"{module['name']:28}{module['import_ms']:7.0f}{module['ram_bytes']:12}")
    return "\n".join(lines)


def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the figures there")
    parser.add_argument("--port", metavar="DEV", help="a real board's serial port")
    options = parser.parse_args(arguments)
    result = parse(run_on(options.port) if options.port else run_emulated())
    print(table(result))
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    main()

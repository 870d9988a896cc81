# SPDX-License-Identifier: MIT
"""The main job without hardware: main.py's own code on a virtual board, fed with a real motion.

`python -m tools.demo` runs main.py on the virtual port (CPython, virtual time), its MPU6050 moved
as a recorded sensor was, prints roll and pitch against the recording's optical truth while it
runs, and ends with a table and a picture. `--board emulated` adds a run of the same main.py on
the emulated RP2040 with the real MicroPython firmware, for the timing of the loop.
"""

import argparse
import ast
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from tools.demo.estimates import FILTERS, error_deg, rms
from tools.demo.run import LEAD_S, MOTION, run
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion.replay import Replay


def report(recorded, path):
    """The table as text."""
    lines = [f"\n{path.stem}, {recorded['t_s'][-1] - recorded['t_s'][0]:.0f} s", ""]
    lines.append(f"{'filter':<22}{'tilt error, deg RMS':>20}{'largest':>10}")
    for name, up in recorded["estimates"].items():
        error = error_deg(up, recorded["up"])
        mark = "  <- main.py's own" if FILTERS[name] == recorded["knob"] else ""
        lines.append(f"{name:<22}{rms(error):>20.2f}{np.nanmax(error):>10.2f}{mark}")
    return "\n".join(lines)


def timing(stats, where):
    """A line about the loop."""
    period = stats["period_us"]
    return (
        f"loop on {where}: period {stats['period_mean_us']:.1f} us, jitter p50 "
        f"{stats['jitter_p50_us']} p99 {stats['jitter_p99_us']} max {stats['jitter_max_us']} us, "
        f"step p99 {stats['step_p99_us']} of {period} us, {stats['ticks']} ticks, "
        f"{stats['overruns']} overruns, {stats['lost']} lost"
    )


def settings_file(**knobs):
    """The bytes of a config.txt that sets these knobs, made by the board's own code."""
    from firmware import store

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "config.txt")
        store.save(str(path), "config", 1, knobs)
        return path.read_bytes()


def emulated(path, seconds):
    """stats() of main.py, started from flash, after `seconds` on the emulated RP2040."""
    from tools.virtual.pico import VirtualPico

    bus = Bus(MPU6050Chip(motion=Replay(path, lead_s=LEAD_S)))
    files = {"config.txt": settings_file(rest_s=0.1)}
    with VirtualPico(bus=bus, root=True, files=files) as pico:
        source = f"import time\napp.stop()\napp.start()\ntime.sleep_ms({round(seconds * 1000)})\n"
        pico.exec(source + "s = app.stats()", timeout_s=seconds + 20)
        return ast.literal_eval(pico.exec("app.stop()\nprint(s)"))


def main():
    parser = argparse.ArgumentParser(
        prog="python -m tools.demo", description=__doc__.partition("\n")[0]
    )
    parser.add_argument("--motion", type=Path, default=MOTION, help=".npz or .csv to be replayed")
    parser.add_argument("--seconds", type=float, default=30.0, help="of the recording")
    parser.add_argument("--port", choices=("rp2", "esp32"), default="rp2", help="personality")
    parser.add_argument("--board", choices=("virtual", "emulated"), default="virtual")
    parser.add_argument("--out", type=Path, default=Path("out/demo.png"), help="the picture")
    args = parser.parse_args()
    began = time.monotonic()
    recorded = run(args.port, args.motion, args.seconds, sys.stdout)
    print(report(recorded, args.motion), "\n")
    print(timing(recorded["stats"], f"the virtual {args.port}"))
    if args.board == "emulated":
        print("booting the emulated RP2040 ...", flush=True)
        print(timing(emulated(args.motion, 1.0), "the emulated RP2040"))
    from tools.demo.picture import draw

    draw(recorded, args.out)
    print(f"picture: {args.out.resolve()}   ({time.monotonic() - began:.0f} s)")


if __name__ == "__main__":
    main()

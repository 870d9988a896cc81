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
from array import array
from pathlib import Path

import numpy as np

from tools.recordings import EXCERPTS, roll_pitch_deg, up_from_quaternion, up_from_roll_pitch
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.port import Port
from tools.virtual.replay import Replay

MOTION = EXCERPTS / "02_undisturbed_slow_rotation_B.npz"
LEAD_S = 1.2  # rest before the recording, in which the app measures the gyro's bias
# What the table calls the estimates, in its order; those with a knob are made by the app's code.
FILTERS = {
    "accelerometer alone": None,
    "gyro integral": None,
    "complementary": "float.complementary",
    "kalman_tilt": "float.kalman",
    "fixed.kalman2": "kalman2",
    "attitude": "float.attitude",
    "fixed.attitude": "attitude",
}


class Screen:
    """Standard output while main.py runs: its telemetry becomes one live line with a bar."""

    def __init__(self, real, end_s):
        self.real, self.end_s = real, end_s
        self.buffer = self
        self.lines = 0
        self.on_line = lambda: None  # called at each line of telemetry; returns (t_s, truth)
        self._live = real.isatty()

    def write(self, data):
        text = data.decode() if isinstance(data, (bytes, bytearray)) else data
        if not text.startswith("roll_deg:"):
            self.real.write(text.replace("\r\n", "\n"))
            return len(data)
        self.lines += 1
        t_s, roll, pitch = self.on_line()
        every = 5 if self._live else 250
        if self.lines % every == 1:
            done = min(1.0, t_s / self.end_s)
            bar = "#" * round(20 * done) + "." * (20 - round(20 * done))
            tail = "\r" if self._live else "\n"
            shown = " ".join(text.split()[:4])
            truth = f"truth {roll:8.2f} {pitch:8.2f}"
            self.real.write(f"{t_s:5.1f} s [{bar}] {shown:<42} {truth}{tail}")
            self.real.flush()
        return len(data)

    def flush(self):
        self.real.flush()

    def __getattr__(self, name):
        return getattr(self.real, name)


def run(platform, path, seconds, stdout):
    """main.py on a virtual board over `seconds` of the recording. Returns a dict of arrays.

    Keys: t_s, counts (n x 7), dt_us, up (n x 3, truth), live (n x 2, deg), stats, knob, and
    estimates {name: (n x 3) up}.
    """
    motion = Replay(path, lead_s=LEAD_S, length_s=seconds)
    chip = MPU6050Chip(motion=motion, gyro_bias_dps=(2.0, -1.5, 1.0), seed=1)
    rows = []
    with tempfile.TemporaryDirectory() as root, Port(platform, {0: Bus(chip)}, root=root) as port:
        variables = {}
        end_s = LEAD_S + seconds
        screen = Screen(stdout, end_s)

        def record(app):
            rows.append((port.now_ns / 1e9, app.filter.roll_mdeg, app.filter.pitch_mdeg,
                         *app.imu.counts))  # fmt: skip
            if port.now_ns / 1e9 >= end_s:
                port.stdin = "q"  # a key: main.py gives the line back

        def on_line():
            if not variables["app"].outputs.active:
                variables["app"].outputs.add(record)
            t_s = port.now_ns / 1e9
            return (t_s, *(float(a[0]) for a in roll_pitch_deg(_up([chip.truth(t_s)]))))

        screen.on_line = on_line
        sys.stdout = screen
        try:
            port.run_file("main.py", variables)
        finally:
            sys.stdout = stdout
        app = variables["app"]
        app.stop()
        table = np.array(rows)
        out = {
            "t_s": table[:, 0],
            "up": _up([chip.truth(t) for t in table[:, 0]]),
            "counts": table[:, 3:].astype(np.int16),
            "live": table[:, 1:3] / 1000,
            "stats": app.stats(),
            "knob": app.config.filter,
        }
        out["estimates"] = estimates(app, out, stdout)
        return out


def _up(quats):
    return up_from_quaternion(np.array([q if q is not None else (np.nan,) * 4 for q in quats]))


def estimates(app, recorded, stdout):
    """{name: (n x 3) up vectors}: the other filters on the counts that the app had."""
    from attitude import GyroIntegral, accel_tilt_deg

    from firmware import filters

    out = {}
    t_us = np.round(recorded["t_s"] * 1e6).astype(int)
    dt_us = np.diff(t_us, prepend=t_us[0] - 4000).tolist()
    rows = recorded["counts"].tolist()
    gyro = recorded["counts"][:, 4:] / app.imu.gyro_lsb_per_dps - app.calibration.gyro_bias_dps
    tilt = np.array([accel_tilt_deg(*row[:3]) for row in rows])
    counts = array("h", [0] * 7)
    for name, knob in FILTERS.items():
        if stdout.isatty():
            stdout.write(f"\rfilters on the same samples: {name:<24}")
            stdout.flush()
        if name == "accelerometer alone":
            angles = tilt
        elif knob is None:
            axes = [GyroIntegral(), GyroIntegral()]
            for axis, start in zip(axes, tilt[0]):
                axis.reset(start)
            angles = np.array(
                [[a.update(g, d * 1e-6) for a, g in zip(axes, row)]
                 for row, d in zip(gyro[:, :2].tolist(), dt_us)]
            )  # fmt: skip
        elif knob == recorded["knob"]:
            angles = recorded["live"]
        else:
            app.config.set("filter", knob)
            f = filters.make(app.config, app.calibration, app.imu)
            timed = f.timed
            angles = np.empty((len(rows), 2))
            for i, row in enumerate(rows):
                for k in range(7):
                    counts[k] = row[k]
                if timed:
                    f.update(counts, dt_us[i])
                else:
                    f.update(counts)
                angles[i] = f.roll_mdeg / 1000, f.pitch_mdeg / 1000
        out[name] = up_from_roll_pitch(angles[:, 0], angles[:, 1])
    if stdout.isatty():
        stdout.write("\r" + " " * 60 + "\r")
    return out


def error_deg(up, truth):
    """Angle (n) between estimated and true up vectors."""
    cross = np.linalg.norm(np.cross(up, truth), axis=1)
    return np.degrees(np.arctan2(cross, np.sum(up * truth, axis=1)))


def rms(values):
    """Root mean square of what is known."""
    return float(np.sqrt(np.nanmean(values**2)))


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
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
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
    from tools.demo_picture import draw

    draw(recorded, args.out)
    print(f"picture: {args.out.resolve()}   ({time.monotonic() - began:.0f} s)")


if __name__ == "__main__":
    main()

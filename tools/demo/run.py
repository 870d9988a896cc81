# SPDX-License-Identifier: MIT
"""main.py as it is on a virtual board, its sensor moved as a recorded one was."""

import sys
import tempfile

import numpy as np

from tools.demo.estimates import estimates, up_vectors
from tools.recordings import EXCERPTS, roll_pitch_deg
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion.replay import Replay
from tools.virtual.port import Port

MOTION = EXCERPTS / "02_undisturbed_slow_rotation_B.npz"
LEAD_S = 1.2  # rest before the recording, in which the app measures the gyro's bias


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
            return (t_s, *(float(a[0]) for a in roll_pitch_deg(up_vectors([chip.truth(t_s)]))))

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
            "up": up_vectors([chip.truth(t) for t in table[:, 0]]),
            "counts": table[:, 3:].astype(np.int16),
            "live": table[:, 1:3] / 1000,
            "stats": app.stats(),
            "knob": app.config.filter,
        }
        out["estimates"] = estimates(app, out, stdout)
        return out

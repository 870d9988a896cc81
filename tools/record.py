# SPDX-License-Identifier: MIT
"""Records what a board streams, through unpluggings, with all that is needed to replay it.

    python -m tools.record --port DEV --seconds S --out FILE(.npz|.csv)
    python -m tools.record --virtual --seconds S --out FILE

FILE has units, board, firmware's release, settings, calibration, marks where a setting changed,
and the numbers of the samples, so that every loss shows. Ctrl-C ends it, and keeps what there is.
"""

import argparse
import contextlib
import json
import sys
import threading
import time
from pathlib import Path

import numpy as np

from tools.link import desk
from tools.link.join import Joiner
from tools.link.link import Link
from tools.track import marks

SHOW_S = 1.0
PATIENCE_S = 60.0  # for the first sample


class Recorder:
    """Gathers batches: headers [(sample, header)], and columns; add() is for a Link."""

    def __init__(self):
        self.headers, self.breaks = [], []
        self._parts = []
        self._length = 0
        self._join = Joiner()
        self._lock = threading.Lock()

    def __len__(self):
        return self._length

    def add(self, batch):
        """More samples; a batch with other channels or ranges than the first is left out."""
        with self._lock:
            if self.headers and batch.header["channels"] != self.headers[0][1]["channels"]:
                return
            if not self.headers or batch.header is not self.headers[-1][1]:
                self.headers.append((self._length, batch.header))
            number, t_us, anew = self._join.join(batch)
            if anew:
                self.breaks.append(self._length)
            self._parts.append((number, t_us, batch.flags, batch.raw))
            self._length += len(number)

    def arrays(self):
        """{name: array} of all so far."""
        with self._lock:
            columns = [np.concatenate(part) for part in zip(*self._parts)]
        return dict(zip(("number", "t_us", "flags", "raw"), columns))

    def losses(self):
        """[(sample after which they are missing, how many, seconds)]."""
        got = self.arrays()
        steps = np.diff(got["number"])
        return [
            (int(at), int(steps[at]) - 1, round(float(np.diff(got["t_us"])[at]) * 1e-6, 4))
            for at in np.flatnonzero(steps > 1)
        ]

    def save(self, path):
        """As .npz or .csv. ValueError for another kind, or when nothing came."""
        path = Path(path)
        if not self._length:
            raise ValueError("nothing came")
        if path.suffix not in (".npz", ".csv"):
            raise ValueError(f"{path}: .npz or .csv")
        path.parent.mkdir(parents=True, exist_ok=True)
        got = self.arrays()
        if path.suffix == ".npz":
            np.savez_compressed(
                path, headers=json.dumps(self.headers), losses=json.dumps(self.losses()),
                marks=json.dumps(marks(self.headers)), **got,
            )  # fmt: skip
        else:
            self._save_csv(path, got)

    def _save_csv(self, path, got):
        channels = self.headers[0][1]["channels"]
        with path.open("w") as file:
            file.write(f"# {json.dumps(self.headers)}\n")
            file.write(f"# losses (row, samples, seconds): {json.dumps(self.losses())}\n")
            file.write(f"# changes (row, knobs): {json.dumps(marks(self.headers))}\n")
            named = ",".join(f"{name} [{unit}]" for name, unit, _ in channels)
            file.write(f"number,t [s],flags,{named}\n")
            scales = np.array([scale for _, _, scale in channels])
            for number, t_us, flags, raw in zip(*got.values()):
                values = ",".join("%.9g" % value for value in raw * scales)
                file.write(f"{number},{t_us * 1e-6:.6f},{flags},{values}\n")


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tools.record", description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    desk.options(parser)
    parser.add_argument("--seconds", type=float, required=True, metavar="S")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help=".npz or .csv")
    parser.add_argument("--channels", nargs="+", metavar="NAME", help="beside counts and angles")
    options = parser.parse_args(arguments)
    recorder = Recorder()
    with desk.board(options) as port:
        link = Link(port, recorder.add, options.channels).start()
        with contextlib.suppress(KeyboardInterrupt):
            _wait(link, recorder, options.seconds)
        link.stop()
    try:
        recorder.save(options.out)
    except (OSError, ValueError) as error:
        sys.exit(f"record: {error}; {link.state or 'connected'}")
    missing = sum(count for _, count, _ in recorder.losses())
    print(f"{len(recorder)} samples in {options.out}, {missing} missing, {link.away} times away")


def _wait(link, recorder, seconds):
    patience = time.monotonic() + PATIENCE_S
    while not len(recorder) and time.monotonic() < patience:
        time.sleep(0.05)
        if link.state and link.state != "connecting":
            print(f"\r{link.state[:70]:70}", end="", file=sys.stderr)
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        time.sleep(min(SHOW_S, max(0.0, end - time.monotonic())))
        state = link.state or f"{len(recorder)} samples, {link.reader.lost} lost"
        print(f"\r{state[:70]:70}", end="", file=sys.stderr)
    print(file=sys.stderr)


if __name__ == "__main__":
    main()

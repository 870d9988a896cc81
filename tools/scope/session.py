# SPDX-License-Identifier: MIT
"""What the page shows, and outlives it: samples, the board behind them, its knobs."""

import threading
import time

import numpy as np

from firmware.config import KNOBS
from tools.link.history import History
from tools.link.link import Away, Link
from tools.link.reader import Batch
from tools.record import Recorder
from tools.scope.past import Past

CHANNELS = ("late_us", "step_us", "rate_x", "rate_y", "rate_z")  # beside counts and angles
RESTARTS = ("rate_hz", "drive", "burst", "address")  # at whose change the ticks pause
BLOCK_S = 0.04


class Session:
    """One source of samples: a board at `port`, or a Track that is played. virtual: the
    tools.link.desk.VirtualBoard, whose cable the page can pull."""

    def __init__(self, port=None, track=None, virtual=None, channels=CHANNELS):
        self.history = History()
        self.past = Past()
        self.virtual = virtual
        self.recorder = None
        self._rate = [(time.monotonic(), 0)]
        self._player = self.link = None
        if track is None:
            self.link = Link(port, self._take, channels).start()
        else:
            self._ends = threading.Event()
            self._player = threading.Thread(target=self._play, args=(track,), daemon=True)
            self._player.start()

    def _take(self, batch):
        self.history.add(batch)
        if self.recorder is not None:
            self.recorder.add(batch)

    def close(self):
        """Leave the board."""
        if self.link:
            self.link.stop()
        else:
            self._ends.set()
        self.past.close()

    # ---- what it knows

    @property
    def settings(self):
        """{knob: value} of the board, or of the recording; {} before anything came."""
        header = self.history.header
        return header["settings"] if header else {}

    @property
    def state(self):
        """'' while samples come, else why not."""
        return self.link.state if self.link else ""

    def line(self):
        """The link's honesty, in one line."""
        if not self.link:
            return f"a recording, played: {self.history.end} samples"
        now = time.monotonic()
        self._rate = [*self._rate[-40:], (now, self.history.end)]
        (then, had), (now, have) = self._rate[0], self._rate[-1]
        counts, (received, bad) = self.link.reader.counts, self.link.received
        hz = (have - had) / (now - then) if now > then else 0.0
        return (
            f"{self.state or 'connected'}: {hz:.0f} samples/s, {self.link.reader.lost} lost on "
            f"the way or on the board ({counts.ring_lost} there), {bad} frames damaged, "
            f"{counts.backlog} waiting, {counts.ticks_lost} ticks lost, {received / 1000:.0f} kB, "
            f"{self.link.away} times away"
        )

    def rows(self):
        """[(knob, value, default?, restarts?)] of the table."""
        own = self.settings
        return [
            (knob, own.get(knob.name, knob.default), own.get(knob.name) == knob.default,
             knob.name in RESTARTS)
            for knob in KNOBS
        ]  # fmt: skip

    # ---- what it does

    def call(self, code):
        """Run lines on the board; what they print. Away, BoardError."""
        if not self.link:
            raise Away("a recording has no board")
        return self.link.call(code)

    def set(self, changes):
        """Change knobs together: all, or none. BoardError, Away."""
        before = dict(self.settings)
        done = []
        try:
            for name, value in changes.items():
                self.call(f"app.set({name!r}, {value!r})")
                done.append(name)
        except Exception:
            for name in reversed(done):
                self.call(f"app.set({name!r}, {before[name]!r})")
            raise

    def record(self, on):
        """Begin to record, or end: the Recorder."""
        if on:
            self.recorder = Recorder()
            return self.recorder
        done, self.recorder = self.recorder, None
        return done

    # ---- a recording, played

    def _play(self, track):
        while not self._ends.is_set():
            block = max(1, round(BLOCK_S * track.rate_hz))
            due = time.monotonic()
            for at in range(0, len(track) - block, block):
                self.history.add(_batch(track, at, at + block))
                due += block / track.rate_hz
                if self._ends.wait(max(0.0, due - time.monotonic())):
                    return


def _batch(track, begin, end):
    """Samples of a Track in the form of a stream's."""
    if not hasattr(track, "header"):
        from tools.recordings import ACCEL_LSB_PER_G, GYRO_LSB_PER_DPS
        from tools.track import COUNTS

        accel, gyro = (1 / ACCEL_LSB_PER_G[track.settings["accel_g"]],
                       1 / GYRO_LSB_PER_DPS[track.settings["gyro_dps"]])  # fmt: skip
        units = [("g", accel)] * 3 + [("degC", 1 / 340)] + [("deg/s", gyro)] * 3
        track.header = {
            "channels": [(name, *unit) for name, unit in zip(COUNTS, units)]
            + [(name, "deg", 0.008) for name in ("roll", "pitch", "yaw")],
            "period_us": round(track.period_us), "every": 1, "settings": track.settings,
            "lag_s": track.lag_s, "calibration": track.calibration,
        }  # fmt: skip
        if track.angles_deg is None:
            from tools.replay import engine

            track.angles_deg = engine.run(track, track.settings)
    angles = np.round(track.angles_deg[begin:end] / 0.008)
    return Batch(
        track.header, np.arange(begin, end, dtype=np.int64),
        np.round(track.t_s[begin:end] * 1e6).astype(np.int64), np.zeros(end - begin, np.uint8),
        np.column_stack([track.counts[begin:end], angles]).astype(np.int16),
    )  # fmt: skip

# SPDX-License-Identifier: MIT
"""The last minutes of samples, in memory that does not grow."""

import threading

import numpy as np

from tools.link.join import Joiner
from tools.track import of_stream

CAPACITY = 150_000  # samples: ten minutes at 250 Hz
COLUMNS = 24
ANGLES = ("roll", "pitch", "yaw")


class History:
    """add() is for a Link's thread, all else for anybody. end: how many samples ever came; marks:
    [(seconds, {knob: (before, after)})]; header: the newest."""

    def __init__(self, capacity=CAPACITY):
        self.names, self.units = [], {}
        self.header = None
        self.marks = []
        self.end = 0
        self._alike_since = 0  # same channels and scales from this sample on
        self._capacity = capacity
        self._t = np.zeros(capacity)
        self._number = np.zeros(capacity, np.int64)
        self._flags = np.zeros(capacity, np.uint8)
        self._values = np.zeros((capacity, COLUMNS), np.float32)
        self._gap = np.zeros(capacity, bool)  # some are missing before it
        self._join = Joiner()
        self._lock = threading.Lock()
        self._start_us = None

    def add(self, batch):
        """More samples."""
        with self._lock:
            number, t_us, _ = self._join.join(batch)
            if self._start_us is None:
                self._start_us = int(t_us[0])
            self._note(batch.header, (int(t_us[0]) - self._start_us) * 1e-6)
            last = self._number[(self.end - 1) % self._capacity] if self.end else number[0] - 1
            at = (self.end + np.arange(len(batch))) % self._capacity
            self._t[at] = (t_us - self._start_us) * 1e-6
            self._number[at] = number
            self._flags[at] = batch.flags
            scales = np.array([scale for _, _, scale in batch.header["channels"]], np.float32)
            self._values[at, : len(scales)] = batch.raw * scales
            self._gap[at] = np.diff(number, prepend=last) != 1
            self.end += len(batch)

    def _note(self, header, t_s):
        if header is self.header:
            return
        old, self.header = self.header, header
        if old is None or old["channels"] != header["channels"]:
            self._alike_since = self.end
            self.names = [name for name, _, _ in header["channels"]]
            self.units = {name: unit for name, unit, _ in header["channels"]}
        if old is not None:
            was, now = old["settings"], header["settings"]
            changed = {k: (was.get(k), now[k]) for k in now if was.get(k) != now[k]}
            if changed:
                self.marks = [*self.marks[-199:], (t_s, changed)]

    def since(self, begin, names):
        """(end, t, values (n x names), gap): samples from number `begin` on that are kept."""
        with self._lock:
            begin = max(begin, self.end - self._capacity, 0)
            at = np.arange(begin, self.end) % self._capacity
            known = [self.names.index(name) for name in names if name in self.names]
            return self.end, self._t[at], self._values[np.ix_(at, known)], self._gap[at]

    def last(self, name):
        """The newest value, 0.0 before the first."""
        if not self.end or name not in self.names:
            return 0.0
        return float(self._values[(self.end - 1) % self._capacity, self.names.index(name)])

    def newest(self, seconds, names):
        """(t, values) of the last seconds."""
        if not self.header:
            return np.zeros(0), np.zeros((0, len(names)))
        period_s = self.header["period_us"] * self.header["every"] * 1e-6
        _, t, values, _ = self.since(self.end - round(seconds / period_s), names)
        return t, values

    def flags(self):
        """Of the newest sample."""
        return int(self._flags[(self.end - 1) % self._capacity]) if self.end else 0

    def track(self, seconds):
        """(Track of the last seconds as far as they are of one kind, when it begins).

        ValueError when there is nothing.
        """
        with self._lock:
            if self.header is None:
                raise ValueError("nothing has come so far")
            period_s = self.header["period_us"] * self.header["every"] * 1e-6
            begin = max(
                self.end - round(seconds / period_s), self._alike_since, self.end - self._capacity,
            )  # fmt: skip
            at = np.arange(begin, self.end) % self._capacity
            if len(at) < 2:
                raise ValueError("nothing has come so far")
            scales = np.array([scale for _, _, scale in self.header["channels"]])
            raw = np.round(self._values[at, : len(scales)] / scales)
            start_s = self._t[at[0]]
            made = of_stream(
                "the last minutes", [(0, self.header)], self._number[at],
                np.round(self._t[at] * 1e6).astype(np.int64), raw,
            )  # fmt: skip
        return made, float(start_s)


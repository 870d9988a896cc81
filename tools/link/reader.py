# SPDX-License-Identifier: MIT
"""Contents of frames into samples: numbered, timed, in units, and what is missing said.

The header that a board sends in pieces names the channels (firmware/channels.py); samples that
come before theirs wait for it.
"""

import json
import struct
from dataclasses import dataclass, field

import numpy as np

HEADER, COUNTS, SAMPLE = 1, 2, 16
PREDICTED, AT_REST, TILT_UNCERTAIN, YAW_UNCERTAIN = 1, 2, 4, 8
WRAP_US = 1 << 30  # of ticks_us
_WAITING_MAX = 4000  # samples that wait for their header
_FIRST = 10  # channels in a sample's first part, and in each other
_OTHER = 12


@dataclass
class Batch:
    """Samples of one header. number: of each since the stream's start; t_us: the board's time,
    never wrapping; flags; raw: (n x channels) 16-bit numbers, which times header's scales are
    values."""

    header: dict
    number: np.ndarray
    t_us: np.ndarray
    flags: np.ndarray
    raw: np.ndarray

    def __len__(self):
        return len(self.number)

    def value(self, name):
        """(n) of a channel in its unit."""
        names = [channel[0] for channel in self.header["channels"]]
        at = names.index(name)
        return self.raw[:, at] * self.header["channels"][at][2]


@dataclass
class Counts:
    """What the board says of itself once a second."""

    mode: int = 0
    ring_lost: int = 0
    waits: int = 0
    ticks_lost: int = 0
    cause: int = 0
    backlog: int = 0
    trigger_at: int = 0


@dataclass
class _Format:
    """One start of the stream."""

    header: dict
    parts: int = 1
    next_number: int = -1
    t_us: int = 0
    rows: list = field(default_factory=list)


class Reader:
    """feed() contents, take() batches. header: the newest; headers: how many came.

    lost: samples that are missing between those that came.
    """

    def __init__(self):
        self.header = None
        self.headers = 0
        self.counts = Counts()
        self.lost = self.samples = 0
        self.begin()

    def begin(self):
        """A new connection: what follows has nothing to do with what came before."""
        self._formats = {}
        self._pieces = {}
        self._waiting = []
        self._open = {}  # format: the parts of a sample that is not complete
        self._done = []

    def feed(self, contents):
        """More contents of frames."""
        for content in contents:
            kind = content[0]
            if kind >= SAMPLE:
                self._sample(content)
            elif kind == HEADER:
                self._piece(content)
            elif kind == COUNTS:
                self.counts = Counts(content[1], *struct.unpack_from("<6i", content, 4))

    def take(self):
        """The batches of all samples that came since the last call."""
        for form in self._formats.values():
            self._flush(form)
        done, self._done = self._done, []
        return done

    def _piece(self, content):
        _, number, at, count = content[:4]
        if number not in self._pieces:
            self._pieces = {number: {}}
        pieces = self._pieces[number]
        pieces[at] = content[4:]
        if len(pieces) != count:
            return
        self._pieces = {}
        try:
            header = json.loads(b"".join(pieces[i] for i in range(count)))
        except (ValueError, KeyError):
            return
        self._adopt(header)

    def _adopt(self, header):
        own = header["start"] & 3
        known = self._formats.get(own)
        if "channels" not in header:  # one setting's change
            if known is None:
                return
            settings = {**known.header["settings"], **header["settings"]}
            header = {**known.header, **header, "settings": settings}
        self.header = header
        self.headers += 1
        channels = len(header["channels"])
        if known is not None and known.header["start"] == header["start"]:  # a setting changed
            self._flush(known)
            known.header = header
        else:
            parts = 1 + (channels - _FIRST + _OTHER - 1) // _OTHER
            self._formats[own] = _Format(header, parts)
        waiting, self._waiting = self._waiting, []
        for content in waiting:
            self._sample(content)

    def _sample(self, content):
        own, part = (content[0] - SAMPLE) >> 2, content[0] & 3
        form = self._formats.get(own)
        if form is None:
            self._waiting = [*self._waiting[1 - _WAITING_MAX :], content]
            return
        if part == 0:
            self._open[own] = content
        elif own in self._open and self._open[own][2:4] == content[2:4]:
            self._open[own] += content
        else:
            return
        if part == form.parts - 1:
            form.rows.append(self._open.pop(own))

    def _flush(self, form):
        if not form.rows:
            return
        rows = np.frombuffer(b"".join(form.rows), np.uint8).reshape(len(form.rows), -1)
        form.rows = []
        words = np.ascontiguousarray(rows).view("<i2")
        number = words[:, 1].astype(np.uint16).astype(np.int64)
        t_us = np.ascontiguousarray(words[:, 2:4]).view("<i4")[:, 0].astype(np.int64)
        keep = [4 + i for i in range(_FIRST)]
        for part in range(1, form.parts):
            keep += [14 * part + 2 + i for i in range(_OTHER)]
        raw = words[:, keep[: len(form.header["channels"])]].astype(np.int16)
        last_number = form.next_number - 1 if form.next_number >= 0 else int(number[0]) - 1
        last_us = form.t_us if form.next_number >= 0 else int(t_us[0])
        number = last_number + np.cumsum(np.diff(number, prepend=last_number) & 0xFFFF)
        t_us = last_us + np.cumsum(np.diff(t_us, prepend=last_us) & WRAP_US - 1)
        if "trigger" not in form.header:
            self.lost += int(number[-1] - last_number - len(number))
        form.next_number, form.t_us = int(number[-1]) + 1, int(t_us[-1])
        self.samples += len(number)
        self._done.append(Batch(form.header, number, t_us, rows[:, 1].copy(), raw))

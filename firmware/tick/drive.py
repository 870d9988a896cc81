# SPDX-License-Identifier: MIT
"""Outputs in the tick: those that are fit for it, and everybody's safe values.

Each is isolated: an exception is counted, and after some in a row its own safe() is called; from
a stale estimate on all safe() are. One that fails here, for instance because it allocates in a
hard interrupt, is called again by the foreground.
"""

from array import array

import micropython
from micropython import const

# places: firmware.tick.words
_AGE_US = const(3)
_STALE_US = const(5)
_DUE = const(12)
_IS_SAFE = const(18)
_FAILED = const(21)
_LIMIT = const(22)
_AGAIN = const(25)
_SOFT = const(26)
_PATIENCE = const(27)
# bits of an output's flags
_UNSAFE = const(1)  # its safe() failed
_RAISED = const(2)  # its update raised, and nobody was told yet
_GIVEN_UP = const(4)  # its update raised too often, and it has its safe value


class Drive:
    """Made by firmware.outputs, replaced whole. rows: (update, safe or None, hard, tune or None).
    """

    def __init__(self, words, app, rows=(), feed=None):
        self.words = words
        self.flags = array("i", [0] * len(rows))
        self.in_row = array("i", [0] * len(rows))
        self.kinds = [None] * len(rows)  # the class of each one's first exception
        self.rows = rows
        self.tick = self._make(app, rows, feed)

    def take_state(self, old):
        """What the drive before this one knows of the same outputs, whose failures count on."""
        for i, row in enumerate(old.rows):
            if row in self.rows:
                k = self.rows.index(row)
                self.flags[k] |= old.flags[i]
                self.in_row[k] = max(self.in_row[k], old.in_row[i])
                self.kinds[k] = self.kinds[k] or old.kinds[i]
                if self.flags[k] & (_UNSAFE | _RAISED):
                    self.words[_AGAIN] = 1

    def _make(self, app, rows, feed):
        updates = tuple([row[0] if row[2] else None for row in rows])

        @micropython.native
        def drive(fresh, self=self, app=app, rows=updates, feed=feed, words=self.words,
                  in_row=self.in_row):  # fmt: skip
            if words[_AGE_US] >= words[_STALE_US]:
                if not words[_IS_SAFE]:
                    self.safe()
                return
            words[_IS_SAFE] = 0
            good = fresh
            i = words[_SOFT] + 1
            words[_SOFT] = i
            if i == words[_PATIENCE]:  # the foreground is stuck: what it steers is not steered
                self.safe_soft()
            i = 0
            for update in rows:
                if update:
                    try:
                        update(app)
                        in_row[i] = 0
                    except BaseException as error:
                        good = 0
                        self.failed(i, error.__class__)
                elif in_row[i] or words[_SOFT] >= words[_PATIENCE]:
                    good = 0
                i += 1
            if good and feed:
                feed()

        return drive

    @micropython.native
    def failed(self, i, kind):
        """Output number i raised an exception of this class."""
        words, in_row, flags = self.words, self.in_row, self.flags
        words[_FAILED] += 1
        if not self.kinds[i]:
            self.kinds[i] = kind
        flags[i] |= _RAISED
        words[_DUE] = 0
        if not in_row[i]:
            flags[i] &= ~_GIVEN_UP
        if in_row[i] < 1000000:
            in_row[i] += 1
        if in_row[i] >= words[_LIMIT] and not flags[i] & _GIVEN_UP:
            flags[i] |= _GIVEN_UP
            self._safe_one(i)

    @micropython.native
    def safe(self):
        """Every output to its safe value, once until the next good tick."""
        self.words[_IS_SAFE] = 1
        i = 0
        n = len(self.rows)
        while i < n:
            self._safe_one(i)
            i += 1

    @micropython.native
    def safe_soft(self):
        """Those that the foreground calls, to their safe values."""
        i = 0
        n = len(self.rows)
        while i < n:
            if not self.rows[i][2]:
                self._safe_one(i)
            i += 1

    @micropython.native
    def _safe_one(self, i):
        safe = self.rows[i][1]
        if safe:
            try:
                safe()
            except BaseException:
                self.flags[i] |= _UNSAFE
                self.words[_AGAIN] = 1
                self.words[_DUE] = 0

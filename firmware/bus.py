# SPDX-License-Identifier: MIT
"""The sensor's bus, shared with the tick, which may come at any instant.

    with app.bus:
        display.show()          # any device of yours on the same two wires

While it is held the tick begins no burst and takes none: it predicts, and counts those ticks
("busy" in app.stats()). One that was turned away goes first the next time, until it has had a
sample: neither a loop that reads all the time nor one in step with the ticks can starve it.
"""

import time
from array import array

from micropython import const

# places; the tick reads the first and sets the second
_HELD = const(0)  # how many hold it, one within the other
_TURNED_AWAY = const(1)  # a bit for each App

_PATIENCE_MS = const(30)  # two periods at the lowest rate, and a little
_LOOK_US = const(50)


class Bus:
    """A lock that is taken before anything is looked at. words: for the tick.

    hard, soft: those of the Apps with such ticks, by their bits. patient: whose waiting tick
    take() lets go first; a callback of the scheduler waits for the hard ones, since a soft one
    waits for it.
    """

    def __init__(self):
        self.words = array("i", (0, 0))
        self.hard, self.soft, self.patient = 0, 0, -1
        self.finish = _nothing  # the driver's: waits for a burst under way

    @property
    def held(self):
        """Whether somebody holds it."""
        return self.words[_HELD] > 0

    def take(self):
        """From now on the tick leaves the bus alone."""
        words = self.words
        whose = self.patient
        if not words[_HELD] and words[_TURNED_AWAY] & whose:
            began = time.ticks_ms()
            while words[_TURNED_AWAY] & whose:
                if time.ticks_diff(time.ticks_ms(), began) >= _PATIENCE_MS:
                    break
                time.sleep_us(_LOOK_US)
            words[_TURNED_AWAY] &= ~whose
        # A Ctrl-C is raised at jumps: from here on there is none outside the try, nor in leaving.
        words[_HELD] += 1
        kept = 0
        try:
            self.finish()
            kept = 1
        finally:
            words[_HELD] += kept - 1

    def release(self):
        """The tick may have it again."""
        self.words[_HELD] -= 1

    def forget(self, mask):
        """This one does not wait: its loop has ended."""
        self.soft &= ~mask
        self.words[_TURNED_AWAY] &= ~mask

    def __enter__(self):
        self.take()
        return self

    def __exit__(self, _kind, _error, _traceback):  # *rest would be a tuple: memory may be full
        self.words[_HELD] -= 1
        return False


def _nothing():
    """finish() without a driver."""


_next = [0]


def mask():
    """A bit for one more App, by which it is turned away."""
    _next[0] += 1
    return 1 << _next[0] % 30


_all = {}  # type: dict  # I2C block: Bus


def of(i2c_id):
    """The one Bus of an I2C block, whoever asks: two Apps with a sensor each on it share it."""
    if i2c_id not in _all:
        _all[i2c_id] = Bus()
    return _all[i2c_id]

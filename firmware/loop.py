# SPDX-License-Identifier: MIT
"""The fixed-period loop: a step on an absolute grid of deadlines, with its timing as an output.

A tick source (a timer of the port, or the sensor's data-ready edge) calls the loop in the
background while the REPL stays alive. A late tick is counted and the periods it missed are
skipped: the loop never bursts to catch up. The tick allocates nothing.
"""

import time

import micropython
from micropython import const

from firmware.tick.timing import Timing, account

# places in the accounts of firmware.tick.timing
_RUNNING = const(0)
_TICKS = const(5)
_TOOK = const(9)

_FAR_US = const(1 << 29)  # half of the ticks' wrap


class Loop:
    """Calls `step(dt_us)` with a fixed period; dt_us is the measured time since the last call.

    step: the work of a tick, a function of one int; an attribute, so it may be set later.
    source: `source(period_us, callback)` starts ticking and returns an object with deinit():
        board.timer or board.data_ready.
    rate_hz: 80 to 1000; the period is whole microseconds.
    grid: True for a source with a grid of its own (a timer), False for the sensor's edges.
    ahead, lead_us: with a timer, called this long before each step; for starting a transfer that
        the step collects. Its exceptions are counted like those of the step.
    guard: for edges, a second source, a timer: it ticks in their place when they stay away.
    failed: called after a step that raised.
    """

    def __init__(self, step, source, rate_hz=250, grid=True, ahead=None, lead_us=0, guard=None,
                 failed=None):  # fmt: skip
        if not 80 <= rate_hz <= 1000:
            raise ValueError("rate_hz %s: 80 to 1000" % rate_hz)
        self.period_us = round(1000000 / rate_hz)
        self.errors = 0
        self.error = None
        self.edges_missing = 0
        self._grid = grid
        self.step = step
        self._source = source
        self._ahead = ahead
        self._lead_us = lead_us
        self._guard = guard
        self._failed = failed
        self._failed_tick = -1  # the number of the last tick that raised
        self._worked_us = 0  # when the last step before those began
        # bound methods are heap blocks: made once, here
        self._on_tick = self._tick
        self._on_lead = self._lead
        self._on_guard = self._watch_edges
        self._ticks_us = time.ticks_us
        self._ticks_diff = time.ticks_diff
        self._sources = []
        self._flag = None
        self._timing = Timing()
        self._words = self._timing.words
        self._bins = self._timing.bins

    @property
    def running(self):
        return self._timing.running

    def start(self):
        """Begin to tick, in the background; statistics begin anew."""
        self.stop()
        self.errors = 0
        self.error = None
        self.edges_missing = 0
        self._failed_tick = -1
        self._timing.clear()
        if self._ahead is not None:
            self._sources.append(self._source(self.period_us, self._on_lead))
            time.sleep_us(self._lead_us)
        self._sources.append(self._source(self.period_us, self._on_tick))
        self._timing.start(self.period_us, self._grid, self._ticks_us())
        if self._guard is not None:
            self._sources.append(self._guard(2 * self.period_us, self._on_guard))

    def stop(self):
        """End ticking; a call still queued does nothing."""
        self._timing.stop()
        while self._sources:
            self._sources.pop().deinit()

    def samples(self, item=None):
        """`async for item in loop.samples(item)`: wakes after each step; one reader at a time.

        A reader slower than the loop misses samples; it never delays the loop.
        """
        import asyncio

        self._flag = asyncio.ThreadSafeFlag()
        return _Samples(self._flag, item)

    def stats(self):
        """Timing so far as a dict: counts, and microseconds in the entries that say so."""
        out = self._timing.stats()
        out["errors"] = self.errors
        out["edges_missing"] = self.edges_missing
        return out

    def since_us(self):
        """Microseconds since the last step that did not raise; beyond 9 minutes a large number."""
        worked = self._timing.last_us()
        if self._failed_tick == self._words[_TICKS]:
            worked = self._worked_us
        passed = self._ticks_diff(self._ticks_us(), worked)
        return passed if passed >= 0 else _FAR_US

    def recent_period_us(self):
        """Mean period since the last call, lost ticks included, rounded; 0 when unknown."""
        return self._timing.recent_period_us()

    # native: the larger frames of bytecode are looked for on the heap

    @micropython.native
    def _lead(self, _source):
        if self._words[_RUNNING]:
            try:
                self._ahead()
            except Exception as error:
                self.errors += 1
                self.error = error

    def _watch_edges(self, source):
        quiet_us = self._ticks_diff(self._ticks_us(), self._timing.last_us())
        if quiet_us > self.period_us + (self.period_us >> 1):
            self.edges_missing += 1
            self._tick(source)

    @micropython.native
    def _tick(self, _source):
        now = self._ticks_us()
        dt_us = account(self._words, self._bins, now)
        if not dt_us:
            return
        try:
            self.step(dt_us)
        except Exception as error:  # nothing may leave the timer: it would print at every tick
            self.errors += 1
            self.error = error
            self._step_failed(now, dt_us)
        if self._flag is not None:
            self._flag.set()
        self._words[_TOOK] = self._ticks_diff(self._ticks_us(), now)

    def _step_failed(self, now, dt_us):
        tick = self._words[_TICKS]
        if tick != self._failed_tick + 1:  # the first in a row
            self._worked_us = now - dt_us & 2 * _FAR_US - 1
        self._failed_tick = tick
        if self._failed is not None:
            try:
                self._failed()
            except Exception:  # a full heap; the next tick tries again
                self.errors += 1


class _Samples:
    def __init__(self, flag, item):
        self._flag = flag
        self._item = item

    def __aiter__(self):
        return self

    async def __anext__(self):
        await self._flag.wait()
        return self._item

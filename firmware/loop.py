# SPDX-License-Identifier: MIT
"""The fixed-period loop: what ticks, from when to when, and how well.

A source (a timer of the port, or the sensor's data-ready edge) calls firmware.tick's functions on
an absolute grid of deadlines while the REPL stays alive. A late tick is counted and the periods
it missed are skipped: the loop never bursts to catch up.
"""

import sys
import time

import machine
from micropython import const

_FAR_US = const(1 << 29)  # half of the ticks' wrap
_AGE_US = const(3)  # places of firmware.tick.words
_DUE = const(12)
_TRIES = const(5)
_TICKS = const(5)  # of firmware.tick.timing


class Loop:
    """Calls tick.run with a fixed period.

    tick: firmware.tick.Tick, wired. source: `source(period_us, callback)` starts ticking and
    returns an object with deinit(): board.timer or board.data_ready.
    rate_hz: 80 to 1000; the period is whole microseconds.
    grid: True for a source with a grid of its own (a timer), False for the sensor's edges.
    lead_us: with a timer, tick.begin is called this long before each step; 0: not at all; a whole
    period: by the steps themselves.
    guard: a second source, a timer: it ticks in the first one's place when that stays away;
    guard_us: how often it looks.
    guards: firmware.stack.Guards of what a hard interrupt calls: begin, run, the guard.
    masked: edges come in a hard interrupt and the guard in a soft one: they wait while it ticks.
    """

    def __init__(self, tick, source, rate_hz=250, grid=True, lead_us=0, guard=None, guard_us=0,
                 guards=None, masked=False):  # fmt: skip
        if not 80 <= rate_hz <= 1000:
            raise ValueError("rate_hz %s: 80 to 1000" % rate_hz)
        self.period_us = round(1000000 / rate_hz)
        self.edges_missing = 0
        self._tick = tick
        self._timing = tick.timing
        self._ticks = tick.timing.words
        self._ticked = -1
        self.dead = False  # the timer of the ticks has died, and the guard alone goes on
        self._grid = grid
        self._source = source
        self._lead_us = lead_us
        self._guard = guard
        # whole periods: it stays where it begins, out of the ticks' way
        self._guard_us = max(2, guard_us // self.period_us) * self.period_us
        self._on_guard = self._watch_edges
        self._guards = guards
        self._masked = masked
        self._sources = []
        self.readers = []  # those who wait for samples

    @property
    def running(self):
        """Whether it ticks."""
        return self._timing.running

    def start(self):
        """Begin to tick, in the background; statistics begin anew, and the first tick brings the
        time since the last one there was."""
        self.stop()
        self.edges_missing = 0
        self._timing.clear()
        guard = self._call(2, self._on_guard)  # before there are ticks, which would wait for it
        self._begin()
        if self._lead_us == self.period_us:
            self._tick.begin(None)  # the first; from then on each tick begins the next one's
        if self._guard is not None:
            if self._grid:  # nobody knows when edges come, and a soft one cannot come in here
                time.sleep_us(self.period_us * 3 // 4)  # between a step and the next lead
            self._sources.append(self._guard(self._guard_us, guard))

    def revive(self):
        """Other timers for those that have died. MemoryError: not yet, the guard ticks alone."""
        guard = self._sources.pop()
        try:
            self._begin()
        finally:
            self._sources.append(guard)

    def _begin(self):
        """The timers of the ticks, or their edges."""
        leads, runs = self._call(0, self._tick.begin), self._call(1, self._tick.run)
        for _ in range(_TRIES):
            self._deinit()
            if 0 < self._lead_us < self.period_us:
                self._sources.append(self._source(self.period_us, leads))
            began = time.ticks_us()
            if self._sources:
                time.sleep_us(self._lead_us)
            self._sources.append(self._source(self.period_us, runs))
            late_us = time.ticks_diff(time.ticks_us(), began) - self._lead_us
            if len(self._sources) == 1 or late_us < self.period_us >> 2:
                break  # else the heap was searched in between, and each burst would be too old
        self._timing.start(self.period_us, self._grid, time.ticks_us())
        self.dead = False

    def _call(self, place, callback):
        if self._guards:
            return self._guards[place].over(callback)
        if sys.platform != "rp2":  # an ESP32 has 16 KB of stack
            return callback
        from firmware.tick import soft

        return soft.over(callback)

    def stop(self):
        """End ticking; a call still queued does nothing."""
        self._timing.stop()
        self._deinit()

    def _deinit(self):
        while self._sources:
            self._sources[-1].deinit()  # first: a Ctrl-C in between leaves it to the next stop()
            self._sources.pop()

    def samples(self, item=None):
        """`async for item in loop.samples(item)`: wakes after each step; any number of readers.

        A reader slower than the loop misses samples; it never delays the loop.
        """
        return _Samples(self.readers, self._tick.words, item)

    def wake(self):
        """After a step: let those go on who wait for it."""
        for reader in self.readers:
            reader.wake()

    def stats(self):
        """Timing so far as a dict: counts, and microseconds in the entries that say so."""
        out = self._timing.stats()
        out["edges_missing"] = self.edges_missing
        return out

    def since_us(self):
        """Microseconds since the last tick; beyond 9 minutes a large number."""
        last = self._timing.last_us()  # first: a tick may come in before the clock is read
        passed = time.ticks_diff(time.ticks_us(), last)
        return passed if passed >= 0 else _FAR_US

    def age_us(self):
        """Microseconds since the last good sample, those without a tick included."""
        timing, words = self._timing, self._tick.words
        while True:
            last = timing.last_us()
            age_us = words[_AGE_US] + self.since_us()
            if last == timing.last_us():  # else a tick came in between
                return age_us

    def recent_period_us(self):
        """Mean period since the last call, lost ticks included, rounded; 0 when unknown."""
        return self._timing.recent_period_us()

    def _watch_edges(self, source):
        try:
            self._watch(source)
        except KeyboardInterrupt as error:
            self._tick.raised(error)

    def _watch(self, source):
        if self.since_us() > self.period_us + (self.period_us >> 1):
            self.edges_missing += 1
            ticks = self._ticks
            if self._grid and ticks[_TICKS] == self._ticked:  # nobody else has ticked since
                self.dead = True
                self._tick.words[_DUE] = 0
            if self._masked:
                irqs = machine.disable_irq()
                try:
                    self._tick.run(source)
                finally:
                    machine.enable_irq(irqs)
            else:
                self._tick.run(source)
            self._ticked = ticks[_TICKS]


class _Samples:
    """One reader; it is among `readers` while it waits or has waited lately."""

    _MOST = 2000  # steps that nobody asked for, until it is taken off

    def __init__(self, readers, words, item):
        import asyncio

        self._flag = asyncio.ThreadSafeFlag()
        self._readers = readers
        self._words = words
        self._item = item
        self._unasked = 0

    def wake(self):
        """A step has been made."""
        self._unasked += 1
        if self._unasked > self._MOST:
            self._readers.remove(self)
        else:
            self._flag.set()

    def __aiter__(self):
        return self

    async def __anext__(self):
        self._unasked = 0
        if self not in self._readers:
            self._readers.append(self)
            self._words[_DUE] = 0  # the foreground wakes it after each tick from now on
        await self._flag.wait()
        return self._item

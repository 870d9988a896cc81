# SPDX-License-Identifier: MIT
"""Virtual time in nanoseconds: an event queue, interrupts, and the points at which soft callbacks
run.

Time passes in two ways. `busy()` is a blocking C function (a bus transfer): interrupts fire inside
it, soft callbacks wait until it is over. `sleep()` lets soft callbacks run while it waits, and
their time counts as slept.
"""

import heapq
import time as wall

from .scheduler import Scheduler

_NEVER = 1 << 62


class Event:
    """A call at an instant; `cancel()` takes it back."""

    __slots__ = ("action", "t_ns")

    def __init__(self, t_ns, action):
        self.t_ns = t_ns
        self.action = action

    def cancel(self):
        self.action = None


class Clock:
    """`now_ns` runs as fast as the code allows, or `pace` times real time when that is set."""

    def __init__(self, scheduler=None, pace=None):
        self.now_ns = 0
        self.scheduler = scheduler or Scheduler()
        self.interrupts = True
        self._heap = []
        self._next_ns = _NEVER
        self._count = 0
        self._in_interrupt = False
        self.pace = pace
        self._wall_start = wall.monotonic()

    def at(self, t_ns, action):
        """Call `action()` at `t_ns` as an interrupt; returns the Event."""
        event = Event(t_ns, action)
        self._count += 1
        heapq.heappush(self._heap, (t_ns, self._count, event))
        self._next_ns = self._heap[0][0]
        return event

    def next_event_ns(self):
        """Instant of the next event, or None."""
        while self._heap and self._heap[0][2].action is None:
            heapq.heappop(self._heap)
        self._next_ns = self._heap[0][0] if self._heap else _NEVER
        return self._heap[0][0] if self._heap else None

    def busy(self, ns):
        """Spend `ns` in code that is not Python: interrupts fire, soft callbacks wait until the
        end.
        """
        target = self.now_ns + ns
        if target >= self._next_ns:
            self._fire_until(target)
        self.now_ns = max(self.now_ns, target)
        self.breathe()

    def hold(self, ns):
        """Like `busy`, in the middle of a C function: soft callbacks go on waiting."""
        target = self.now_ns + ns
        if target >= self._next_ns:
            self._fire_until(target)
        self.now_ns = max(self.now_ns, target)

    def breathe(self):
        """Between two bytecodes: let the soft callbacks run that wait."""
        if self.interrupts and not self._in_interrupt:
            if self.now_ns >= self._next_ns:
                self._fire_until(self.now_ns)
            if self.scheduler.queue:
                self.scheduler.run()
        if self.pace:
            self._keep_pace()

    def sleep(self, ns):
        """Wait until `ns` from now; interrupts and soft callbacks run meanwhile and may make it
        longer.
        """
        self.sleep_until(self.now_ns + ns)

    def sleep_until(self, deadline_ns):
        """Wait until `deadline_ns`, event by event."""
        self.breathe()
        while self.now_ns < deadline_ns:
            step = self._next_ns if self.interrupts and not self._in_interrupt else _NEVER
            if step < self.now_ns:
                step = self.now_ns
            if step > deadline_ns:
                self.now_ns = deadline_ns
                if self.pace:
                    self._keep_pace()
                break
            if step > self.now_ns:
                self.now_ns = step
            self._fire_until(step)
            self.breathe()

    def _fire_until(self, target_ns):
        """Run the events due until `target_ns`, each at its instant; one interrupt never
        interrupts another.
        """
        if self._in_interrupt or not self.interrupts:
            return
        self._in_interrupt = True
        try:
            heap = self._heap
            while heap and heap[0][0] <= target_ns:
                t_ns, _, event = heapq.heappop(heap)
                action = event.action
                if action is not None:
                    event.action = None
                    if t_ns > self.now_ns:
                        self.now_ns = t_ns
                    action()
        finally:
            self._in_interrupt = False
            self._next_ns = self._heap[0][0] if self._heap else _NEVER

    def _keep_pace(self):
        ahead_s = self.now_ns / 1e9 / self.pace - (wall.monotonic() - self._wall_start)
        if ahead_s > 0.002:
            wall.sleep(ahead_s)

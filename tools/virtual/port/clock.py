# SPDX-License-Identifier: MIT
"""Virtual time in nanoseconds: an event queue, interrupts, and the points at which soft callbacks
run.

Three things happen while time passes. Hardware (a byte on the bus, an INT line, the watchdog) goes
on always. Interrupts come between, at their instants, one after the other: not inside each other,
and not while they are masked; what was missed is caught up back to back. Soft callbacks wait until
the program is between two bytecodes.
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


class _Events:
    """Events in the order of their instants; `next_ns` is that of the first."""

    def __init__(self):
        self.heap, self.next_ns, self._count = [], _NEVER, 0

    def push(self, t_ns, action):
        event = Event(t_ns, action)
        self._count += 1
        heapq.heappush(self.heap, (t_ns, self._count, event))
        if t_ns < self.next_ns:
            self.next_ns = t_ns
        return event

    def pop(self):
        """(instant, action or None) of the first one."""
        t_ns, _, event = heapq.heappop(self.heap)
        self.next_ns = self.heap[0][0] if self.heap else _NEVER
        action, event.action = event.action, None
        return t_ns, action

    def first_ns(self):
        """Instant of the first that was not taken back."""
        while self.heap and self.heap[0][2].action is None:
            self.pop()
        return self.next_ns


class Clock:
    """`now_ns` runs as fast as the code allows, or `pace` times real time when that is set."""

    def __init__(self, scheduler=None, pace=None):
        self.now_ns = 0
        self.scheduler = scheduler or Scheduler()
        self.interrupts = True  # False while they are masked
        self._hardware, self._interrupts = _Events(), _Events()
        self._in_interrupt = self._in_hardware = False
        self.pace = pace
        self._wall_start = wall.monotonic()

    @property
    def in_foreground(self):
        """False while an interrupt or the hardware acts, in the middle of the program's work."""
        return not (self._in_interrupt or self._in_hardware)

    def at(self, t_ns, action):
        """Call `action()` at `t_ns` as an interrupt; returns the Event."""
        return self._interrupts.push(t_ns, action)

    def hardware_at(self, t_ns, action):
        """Call `action()` at `t_ns`, whatever the processor does; it must not let time pass."""
        return self._hardware.push(t_ns, action)

    def interrupt(self, action):
        """Call `action()` as an interrupt as soon as that is possible: at once, as a rule."""
        self._interrupts.push(self.now_ns, action)
        if not self._in_hardware:
            self._advance(self.now_ns)

    def next_event_ns(self):
        """Instant of the next event, or None."""
        first = min(self._hardware.first_ns(), self._interrupts.first_ns())
        return first if first < _NEVER else None

    def busy(self, ns):
        """Spend `ns` in code that is not Python: interrupts fire, soft callbacks wait until the
        end.
        """
        self.hold(ns)
        self.breathe()

    def hold(self, ns):
        """Like `busy`, in the middle of a C function: soft callbacks go on waiting."""
        target = self.now_ns + ns
        if target >= self._interrupts.next_ns or target >= self._hardware.next_ns:
            self._advance(target)
        if target > self.now_ns:
            self.now_ns = target

    def masked(self, ns):
        """Spend `ns` with interrupts masked, as a write to flash does: hard ones wait as well."""
        before, self.interrupts = self.interrupts, False
        self.hold(ns)
        self.interrupts = before
        self.hold(0)

    def breathe(self):
        """Between two bytecodes: let the soft callbacks run that wait."""
        if not self._in_interrupt:
            self.hold(0)
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
            if self.scheduler.queue and not self.scheduler.running and self.in_foreground:
                self.breathe()  # a wait checks again and again
                continue
            step = min(self._next_ns(), deadline_ns)
            self._advance(step)
            if step > self.now_ns:
                self.now_ns = step
            self.breathe()

    def _next_ns(self):
        """Instant of the next event that can happen as things are."""
        if self.interrupts and not self._in_interrupt:
            return min(self._hardware.next_ns, self._interrupts.next_ns)
        return self._hardware.next_ns

    def _advance(self, target_ns):
        """Run the events due until `target_ns`, each at its instant or as soon as it can."""
        hardware, interrupts = self._hardware, self._interrupts
        while True:
            first = interrupts.next_ns < hardware.next_ns
            if first and self.interrupts and not self._in_interrupt:
                events, flag = interrupts, "_in_interrupt"
            else:
                events, flag = hardware, "_in_hardware"
            if events.next_ns > target_ns:
                return
            self._run(events, flag)

    def _run(self, events, flag):
        t_ns, action = events.pop()
        if action is None:
            return
        if t_ns > self.now_ns:
            self.now_ns = t_ns
        setattr(self, flag, True)
        try:
            action()
        finally:
            setattr(self, flag, False)

    def _keep_pace(self):
        ahead_s = self.now_ns / 1e9 / self.pace - (wall.monotonic() - self._wall_start)
        if ahead_s > 0.002:
            wall.sleep(ahead_s)

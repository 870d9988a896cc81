# SPDX-License-Identifier: MIT
"""The base of all faults: when it begins and ends, and the hooks that the bus calls."""

import random


class Fault:
    """Base: nothing happens. The bus calls `step` at both ends and the hooks in between."""

    holds_sda = False
    holds_scl = False

    def __init__(self, at_s=0.0, for_s=None, seed=0, address=None):
        if for_s is not None and for_s < 0:
            raise ValueError(f"for_s {for_s} is negative")
        self.start_ns = round(at_s * 1e9)
        self.end_ns = None if for_s is None else self.start_ns + round(for_s * 1e9)
        self.address = address
        self.random = random.Random(seed)
        self.pending, self.active, self.done = True, False, False
        self.hits = 0  # how often it changed something

    def due(self, now_ns):
        """Instants (ns), up to now, at which `step` has to be called."""
        times = []
        if self.pending and self.start_ns <= now_ns:
            times.append(self.start_ns)
        begun = self.active or times
        if begun and self.end_ns is not None and self.end_ns <= now_ns:
            times.append(self.end_ns)
        return times

    def next_event_ns(self):
        """When it begins or ends, ns, or None."""
        if self.pending:
            return self.start_ns
        return self.end_ns if self.active else None

    def step(self, bus):
        """Begin, or end."""
        if self.pending:
            self.pending, self.active = False, True
            self.begin(bus)
        elif self.active:
            self.active, self.done = False, True
            self.end(bus)

    def device(self, bus):
        """The device it is about; LookupError when there is none."""
        for device in bus.devices:
            if self.address in (None, device.address):
                return device
        raise LookupError(f"{type(self).__name__}: no device at address {self.address}")

    def begin(self, bus):
        """Hook: the fault begins."""

    def end(self, bus):
        """Hook: the fault ends."""

    def on_start(self, bus, device, read, ack):
        """Hook: an address byte was sent; returns the acknowledge, or raises."""
        return ack

    def on_write(self, bus, value, ack):
        """Hook: a byte was written; returns the acknowledge, or raises."""
        return ack

    def on_read(self, bus, value, last):
        """Hook: a byte was read; returns it, or another, or raises."""
        return value

    def on_pulse(self, bus):
        """Hook: a bit-banging master gave one clock."""

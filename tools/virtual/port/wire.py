# SPDX-License-Identifier: MIT
"""Bytes on a virtual Bus with their time: one START or STOP is a bit, one byte with its
acknowledge nine.
"""

from tools.virtual.bus import ArbitrationLost, Bus


class BusInUse(RuntimeError):
    """Two masters' transfers overlap on one bus: on the board both would be corrupted."""


class Collision(Exception):
    """An interrupt took the bus in the middle of this transfer; `reading` when it was a read."""

    def __init__(self, reading):
        super().__init__("the bus was taken by an interrupt")
        self.reading = reading


class Wire:
    """One bus of a Port: its pins, the clock it spends, and who is using it."""

    def __init__(self, clock, bus, after=None, complain=None):
        self.clock = clock
        self.bus = bus if bus is not None else Bus()
        self.user = None  # who is in the middle of a transaction
        self.after = after or (lambda wire: None)  # the devices' next events may have changed
        self.complain = complain or (lambda error: None)  # takes a BusInUse that nobody can catch

    def claim(self, user, again=False):
        """Start using the wires, or go on when `again`.

        BusInUse for a program that finds somebody in the middle of a transaction. An interrupt
        does not look: it disables the block, and whoever used it finds a Collision.
        """
        if self.user is not None and not (again and self.user is user):
            error = BusInUse("%s started while %s was using the bus" % (user, self.user))
            if self.clock.in_foreground:
                raise error
            self.complain(error)
            self._cut_off()
        self.user = user

    def _cut_off(self):
        if hasattr(self.user, "disable"):  # a burst in the background: flushed
            self.user.disable()
        else:
            self.bus.advance(self.clock.now_ns)
            self.bus.stop()

    def release(self, user):
        """Stop using the wires, unless they were taken by somebody else meanwhile."""
        if self.user is user:
            self.user = None
            self.after(self)

    def spend(self, ns, reading=False):
        """Let a transfer's time pass; Collision when an interrupt has taken the bus in it."""
        user = self.user
        self.clock.hold(ns)
        if self.user is not user:
            raise Collision(reading)

    def start(self, address, read, bit_ns):
        """START, address and direction; True for ACK."""
        self.bus.advance(self.clock.now_ns)
        try:
            return self.bus.start(address, read)
        finally:
            self.spend(10 * bit_ns, read)

    def write(self, value, bit_ns):
        self.bus.advance(self.clock.now_ns)
        try:
            return self.bus.write(value)
        finally:
            self.spend(9 * bit_ns)

    def read(self, last, bit_ns):
        self.bus.advance(self.clock.now_ns)
        value = self.bus.read(last)
        self.spend(9 * bit_ns, True)
        return value

    def stop(self, bit_ns):
        self.bus.advance(self.clock.now_ns)
        self.bus.stop()
        self.spend(bit_ns)

    def bit_bang_probe(self, address, bit_ns):
        """START, address for writing and STOP by hand, as a zero-length write does it; True when
        SDA reads low at the ninth clock, which is an ACK or a slave that holds the line. None when
        SCL is held low.

        The nine clocks free a slave that was stuck in a byte.
        """
        self.bus.advance(self.clock.now_ns)
        if not self.bus.scl:
            return None
        if not self.bus.sda:
            for _ in range(9):
                self.bus.scl_pulse()
            ack = not self.bus.sda
        else:
            try:
                ack = self.bus.start(address, False)
            except ArbitrationLost:  # bit-banging does not notice; it sees no acknowledge
                ack = False
        self.spend(10 * bit_ns)
        if self.bus.scl:
            self.stop(bit_ns)
        return ack

# SPDX-License-Identifier: MIT
"""Bytes on a virtual Bus with their time: one START or STOP is a bit, one byte with its
acknowledge nine.
"""

from tools.virtual.bus import ArbitrationLost, Bus


class BusInUse(RuntimeError):
    """Two masters' transfers overlap on one bus: on the board both would be corrupted."""


class Wire:
    """One bus of a Port: its pins, the clock it spends, and who is using it."""

    def __init__(self, clock, bus, after=None):
        self.clock = clock
        self.bus = bus if bus is not None else Bus()
        self.user = None  # who is in the middle of a transaction
        self.after = after or (lambda wire: None)  # the devices' next events may have changed

    def claim(self, user):
        """Start using the wires; BusInUse when somebody else is in the middle of a transaction."""
        if self.user is not None and self.user is not user:
            raise BusInUse("%s started while %s was using the bus" % (user, self.user))
        self.user = user

    def release(self):
        self.user = None
        self.after(self)

    def start(self, address, read, bit_ns):
        """START, address and direction; True for ACK."""
        self.bus.advance(self.clock.now_ns)
        try:
            return self.bus.start(address, read)
        finally:
            self.clock.hold(10 * bit_ns)

    def write(self, value, bit_ns):
        self.bus.advance(self.clock.now_ns)
        try:
            return self.bus.write(value)
        finally:
            self.clock.hold(9 * bit_ns)

    def read(self, last, bit_ns):
        self.bus.advance(self.clock.now_ns)
        value = self.bus.read(last)
        self.clock.hold(9 * bit_ns)
        return value

    def stop(self, bit_ns):
        self.bus.advance(self.clock.now_ns)
        self.bus.stop()
        self.clock.hold(bit_ns)

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
        self.clock.hold(10 * bit_ns)
        if self.bus.scl:
            self.stop(bit_ns)
        return ack

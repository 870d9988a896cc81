# SPDX-License-Identifier: MIT
"""A bare I2C master on a Bus, for tests and tools that want registers and no driver."""

BIT_NS = 2500  # 400 kHz


class Master:
    """Reads and writes registers of one device and charges the bus time to the clock.

    With `bit_ns` 0 a transaction takes no time. OSError(5) when something is not acknowledged.
    """

    def __init__(self, bus, address=0x68, bit_ns=BIT_NS):
        self.bus = bus
        self.address = address
        self._bit_ns = bit_ns

    def run_s(self, seconds):
        """Let time pass, from event to event."""
        self.run_until(self.bus.now_ns + round(seconds * 1e9))

    def run_until(self, t_ns):
        """Let time pass up to an instant, from event to event."""
        bus = self.bus
        while True:
            event = bus.next_event_ns()
            if event is None or event > t_ns:
                break
            bus.advance(event)
        bus.advance(t_ns)

    def write(self, register, *values):
        """Write values to consecutive registers."""
        self._start(False)
        for value in (register, *values):
            self._pass(9)
            if not self.bus.write(value):
                self.bus.stop()
                raise OSError(5, "byte not acknowledged")
        self._stop()

    def read(self, register, count=1):
        """Read consecutive registers in one transaction, as bytes."""
        self._start(False)
        self._pass(9)
        self.bus.write(register)
        self._start(True)
        data = bytearray()
        for n in range(count):
            self._pass(9)
            data.append(self.bus.read(n == count - 1))
        self._stop()
        return bytes(data)

    def word(self, register):
        """Two registers as a signed 16-bit number."""
        return int.from_bytes(self.read(register, 2), "big", signed=True)

    def counts(self):
        """The 14-byte burst from 0x3B: ax ay az temp gx gy gz."""
        data = self.read(0x3B, 14)
        return [int.from_bytes(data[n : n + 2], "big", signed=True) for n in range(0, 14, 2)]

    def _start(self, read):
        self._pass(10)
        if not self.bus.start(self.address, read):
            self.bus.stop()
            raise OSError(5, "address not acknowledged")

    def _stop(self):
        self._pass(1)
        self.bus.stop()

    def _pass(self, bits):
        self.bus.advance(self.bus.now_ns + bits * self._bit_ns)

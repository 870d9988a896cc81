# SPDX-License-Identifier: MIT
"""What goes wrong on the wires."""

from tools.virtual.bus import ArbitrationLost
from tools.virtual.faults.fault import Fault


class Nack(Fault):
    """Addresses, or with `data` written bytes, are not acknowledged, with probability `p`."""

    def __init__(self, p=1.0, data=False, **times):
        super().__init__(**times)
        self._p, self._data = p, data

    def on_start(self, bus, device, read, ack):
        return ack if self._data else self._maybe(ack)

    def on_write(self, bus, value, ack):
        return self._maybe(ack) if self._data else ack

    def _maybe(self, ack):
        if self.random.random() >= self._p:
            return ack
        self.hits += 1
        return False


class Timeout(Fault):
    """A device stretches the clock: SCL is low for the whole time."""

    holds_scl = True


class LostArbitration(Fault):
    """Somebody else starts at the same moment and wins, with probability `p`."""

    def __init__(self, p=1.0, **times):
        super().__init__(**times)
        self._p = p

    def on_start(self, bus, device, read, ack):
        if self.random.random() < self._p:
            self.hits += 1
            raise ArbitrationLost
        return ack


class SdaHeld(Fault):
    """A device holds SDA low until it has seen `clocks` clocks (a byte is nine)."""

    holds_sda = True

    def __init__(self, clocks=9, **times):
        super().__init__(**times)
        self._left = clocks

    def on_pulse(self, bus):
        self.hits += 1
        self._left -= 1
        if self._left <= 0:
            self.active, self.done = False, True


class Filled(Fault):
    """Every byte read is `value` (0xFE, 0xFF, 0x00 are seen in practice)."""

    def __init__(self, value=0xFE, **times):
        super().__init__(**times)
        if not 0 <= value <= 255:
            raise ValueError(f"value {value} is not a byte")
        self._value = value

    def on_read(self, bus, value, last):
        self.hits += 1
        return self._value


class BitFlip(Fault):
    """With probability `p`, one bit of a read transaction's first `length` bytes is wrong."""

    def __init__(self, p=0.01, length=14, **times):
        super().__init__(**times)
        self._p, self._length = p, length
        self._where, self._count = None, 0

    def on_start(self, bus, device, read, ack):
        self._count = 0
        flips = read and self.random.random() < self._p
        self._where = self.random.randrange(8 * self._length) if flips else None
        return ack

    def on_read(self, bus, value, last):
        if self._where is not None and self._where // 8 == self._count:
            value ^= 1 << self._where % 8
            self.hits += 1
        self._count += 1
        return value

# SPDX-License-Identifier: MIT
"""`machine.SoftI2C`: bit-banged on any two pins, with the primitive operations."""

from .i2c import Transfers
from .wire import Collision

_ENODEV = 19


class SoftI2C(Transfers):
    """Bit-banged on any two pins; has the primitive operations. ENODEV for an address not
    acknowledged.
    """

    def __init__(self, scl, sda, *, freq=400_000, timeout=50_000):
        pins = self._port.pins
        self.scl, self.sda = pins.number(scl), pins.number(sda)
        self._freq, self._timeout = freq, timeout
        self._id = pins.take_for_soft_i2c(self.sda, self.scl)

    def __repr__(self):
        return "SoftI2C(scl=%d, sda=%d, freq=%d)" % (self.scl, self.sda, self._freq)

    def init(self, scl, sda, *, freq=400_000, timeout=50_000):
        self.__init__(scl, sda, freq=freq, timeout=timeout)

    def _wire(self):
        return self._port.wire(self._id)

    def _connected(self):
        return True

    def _arbitration_errno(self):
        return _ENODEV

    def _data_nack(self, index):
        return index

    def _bit_ns(self):
        return 2000 * max(1, 500_000 // self._freq)

    def _probe(self, addr):
        wire = self._wire()
        wire.claim(self)
        try:
            ack = wire.bit_bang_probe(addr, self._bit_ns())
            return -self._port.traits.etimedout if ack is None else (0 if ack else -_ENODEV)
        except Collision as collision:
            return self._collided(wire, collision)
        finally:
            wire.release(self)

    def _write_bytes(self, wire, bit_ns, addr, data, stop):
        count = super()._write_bytes(wire, self._bit_ns(), addr, data, stop)
        return -_ENODEV if count == -self._port.traits.enodev else count

    def _read_bytes(self, wire, bit_ns, addr, view, stop):
        count = super()._read_bytes(wire, self._bit_ns(), addr, view, stop)
        return -_ENODEV if count == -self._port.traits.enodev else count

    def start(self):
        """START; the address follows as the first byte of `write`."""
        self._wire().claim(self, again=True)
        self._address_next = True

    def stop(self):
        self._wire().stop(self._bit_ns())
        self._wire().release(self)

    def write(self, buf, /):
        """Returns the number of ACKs."""
        wire, acks = self._wire(), 0
        for value in bytes(buf):
            if self._address_next:
                ack = wire.start(value >> 1, bool(value & 1), self._bit_ns())
                self._address_next = False
            else:
                ack = wire.write(value, self._bit_ns())
            if not ack:
                break
            acks += 1
        return acks

    def readinto(self, buf, nack=True, /):
        view = memoryview(buf).cast("B")
        for index in range(len(view)):
            last = bool(nack) and index == len(view) - 1
            view[index] = self._wire().read(last, self._bit_ns())

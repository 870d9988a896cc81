# SPDX-License-Identifier: MIT
"""`machine.I2C` of each port: arguments, text, errors, patience of ports/rp2 and ports/esp32."""

from .i2c import Transfers
from .traits import EIO
from .wire import Collision

_SOFT_NACK = 19  # of the bit-banged probe, on every port


class HardwareI2C(Transfers):
    """State of one block; the port's classes below differ in arguments, text and errors."""

    _blocks = None  # per Port: id -> block

    def __repr__(self):
        return self._text % vars(self)

    def _wire(self):
        return self._port.wire_at(self.sda, self.scl)

    def _connected(self):
        return self._port.pins.selected(self.sda, "I2C") and self._port.pins.selected(
            self.scl, "I2C"
        )

    def _set_pins(self, sda, scl):
        self.sda, self.scl = sda, scl
        self._port.pins.give_to_i2c(self.id, sda, scl)

    @classmethod
    def _block(cls, number):
        if type(number) is not int:
            raise TypeError("can't convert %s to int" % type(number).__name__)
        if not 0 <= number < len(cls._port.traits.i2c_pins):
            raise ValueError("I2C(%d) doesn't exist" % number)
        block = cls._blocks.get(number)
        if block is None:
            block = cls._blocks[number] = object.__new__(cls)
            block.id, block._freq = number, 0
            block.sda, block.scl = cls._port.traits.i2c_pins[number]
        return block


class Rp2I2C(HardwareI2C):
    """Every failure but a time-out is EIO; a data byte not acknowledged is no failure: the count
    is shorter.
    """

    _text = "I2C(%(id)d, freq=%(_freq)d, scl=%(scl)d, sda=%(sda)d, timeout=%(_timeout)d)"

    def __new__(cls, id=0, freq=None, *, scl=None, sda=None, timeout=None):
        self = cls._block(id)
        pins = cls._port.pins
        new_scl = self.scl if scl is None else pins.number(scl)
        new_sda = self.sda if sda is None else pins.number(sda)
        if new_scl & 1 != 1 or (new_scl & 2) >> 1 != id:
            raise ValueError("bad SCL pin")
        if new_sda & 1 != 0 or (new_sda & 2) >> 1 != id:
            raise ValueError("bad SDA pin")
        given = any(argument is not None for argument in (freq, scl, sda, timeout))
        self.scl, self.sda = new_scl, new_sda
        if given or self._freq == 0:
            clock = cls._port.traits.cpu_hz
            wanted = 400_000 if freq is None else freq
            self._freq = clock // ((clock + wanted // 2) // wanted)
            self._timeout = cls._port.traits.i2c_timeout_us if timeout is None else timeout
            self._set_pins(new_sda, new_scl)
            cls._port.peripherals.reset(id)
        return self

    def _arbitration_errno(self):
        return EIO

    def _data_nack(self, index):
        return index

    def _probe(self, addr):
        """A zero-length write is bit-banged on the pins, and gives them back to the I2C block."""
        wire, traits = self._wire(), self._port.traits
        wire.claim(self)
        try:
            ack = wire.bit_bang_probe(addr, 2000 * (500_000 // self._freq + 1))
            self._port.pins.give_to_i2c(self.id, self.sda, self.scl)
            if ack is None:
                wire.clock.hold(self._timeout * 1000)
                return -traits.etimedout
            return 0 if ack else -_SOFT_NACK
        except Collision as collision:
            return self._collided(wire, collision)
        finally:
            wire.release(self)


_NEW_DRIVER = (1, 29)  # with ESP-IDF 5.5.2
_RTOS_MS = 10  # a tick of FreeRTOS, in which that one waits
_DEAF_NS = 1_000_000_000  # at most


class Esp32I2C(HardwareI2C):
    """A byte not acknowledged is ENODEV, a held line or lost arbitration ETIMEDOUT (116).

    How long it waits depends on chip and version: the block's own limit; 100 ms for each byte
    where the time-out is not heeded; whole ticks of FreeRTOS with the new driver, for which a
    time-out of less than one is over before it begins, and every failure ENODEV.
    """

    _text = "I2C(%(id)d, scl=%(scl)d, sda=%(sda)d, freq=%(_freq)d)"

    def __new__(cls, id=0, *, scl=None, sda=None, freq=400_000, timeout=None):
        self = cls._block(id)
        pins = cls._port.pins
        self._freq = freq
        self._timeout = cls._port.traits.i2c_timeout_us if timeout is None else timeout
        new_sda = self.sda if sda is None else pins.number(sda)
        self._set_pins(new_sda, self.scl if scl is None else pins.number(scl))
        return self

    def _arbitration_errno(self):
        return self._port.traits.etimedout

    @property
    def _new(self):
        return self._port.version >= _NEW_DRIVER

    def _stuck_ns(self):
        traits = self._port.traits
        if self._new:
            return self._timeout // 1000 // _RTOS_MS * _RTOS_MS * 1_000_000
        if self._port.version < traits.i2c_deaf_before:
            return min(_DEAF_NS, 100_000_000 * (1 + self._length))
        return min(self._timeout, traits.i2c_longest_us) * 1000

    def _run(self, transfer):
        if self._new and not self._stuck_ns():
            self._wire().clock.hold(self._port.traits.i2c_overhead_ns)
            return -self._port.traits.enodev
        result = super()._run(transfer)
        return -self._port.traits.enodev if self._new and result < 0 else result

    def _data_nack(self, index):
        return -self._port.traits.enodev

    def _probe(self, addr):
        return self._run(lambda wire, bit_ns: self._write_bytes(wire, bit_ns, addr, b"", True))

    def _read_memory(self, addr, register, view):
        """One transfer with a repeated START."""
        self._length = len(register) + len(view)
        return self._run(lambda wire, bit_ns: self._combined(wire, bit_ns, addr, register, view))

    def _combined(self, wire, bit_ns, addr, register, view):
        count = self._write_bytes(wire, bit_ns, addr, register, False)
        return count if count < 0 else self._read_bytes(wire, bit_ns, addr, view, True)

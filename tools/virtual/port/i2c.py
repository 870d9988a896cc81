# SPDX-License-Identifier: MIT
"""`machine.I2C` and `machine.SoftI2C`: MicroPython's methods (extmod/machine_i2c.c) over a virtual bus."""

from tools.virtual.bus import ArbitrationLost, BusStuck

_NAMES = {5: "EIO", 19: "ENODEV", 110: "ETIMEDOUT", 116: "ETIMEDOUT"}
_UNSUPPORTED = "I2C operation not supported"


class Methods:
    """What hardware and bit-banged I2C share. Subclasses give `_write`, `_read` (both return a count or a negative errno)
    and `_probe`."""

    _port = None

    def init(self, *args, **kwargs):
        raise OSError(_UNSUPPORTED)

    def scan(self):
        """Addresses 0x08 to 0x77 that acknowledge."""
        return [address for address in range(0x08, 0x78) if self._probe(address) == 0]

    def start(self):
        raise OSError(_UNSUPPORTED)

    def stop(self):
        raise OSError(_UNSUPPORTED)

    def readinto(self, buf, nack=True, /):
        raise OSError(_UNSUPPORTED)

    def write(self, buf, /):
        raise OSError(_UNSUPPORTED)

    def readfrom(self, addr, nbytes, stop=True, /):
        data = bytearray(nbytes)
        self._done(self._read(addr, data, bool(stop)))
        return bytes(data)

    def readfrom_into(self, addr, buf, stop=True, /):
        self._done(self._read(addr, memoryview(buf).cast("B"), bool(stop)))

    def writeto(self, addr, buf, stop=True, /):
        """Returns the number of bytes acknowledged."""
        return self._done(self._write(addr, bytes(buf), bool(stop)))

    def writevto(self, addr, vector, stop=True, /):
        return self._done(self._write(addr, b"".join(bytes(part) for part in vector), bool(stop)))

    def readfrom_mem(self, addr, memaddr, nbytes, /, *, addrsize=8):
        data = bytearray(nbytes)
        self._done(self._read_memory(addr, _memory_address(memaddr, addrsize), data))
        return bytes(data)

    def readfrom_mem_into(self, addr, memaddr, buf, /, *, addrsize=8):
        view = memoryview(buf).cast("B")
        self._done(self._read_memory(addr, _memory_address(memaddr, addrsize), view))

    def writeto_mem(self, addr, memaddr, buf, /, *, addrsize=8):
        self._done(self._write(addr, _memory_address(memaddr, addrsize) + bytes(buf), True))

    def _read_memory(self, addr, register, view):
        """Register number and read as two transfers, as the port does without a combined one."""
        count = self._write(addr, register, False)
        if count != len(register):
            self._probe(addr)  # generates the STOP
            return count
        return self._read(addr, view, True)

    def _done(self, result):
        self._port.clock.breathe()
        if result < 0:
            raise OSError(-result, _NAMES.get(-result, ""))
        return result


def _memory_address(memaddr, addrsize):
    if addrsize & 7 or not 0 <= addrsize <= 32:
        raise ValueError("invalid addrsize")
    return (memaddr & ((1 << addrsize) - 1)).to_bytes(addrsize // 8, "big")


class Transfers(Methods):
    """Byte transfers on a Wire with this port's errors; `_freq` in Hz, `_timeout` in microseconds."""

    def _run(self, transfer):
        """Do one transfer: claims the wire, charges the software's time, turns bus errors into a negative errno."""
        traits, wire = self._port.traits, self._wire()
        wire.claim(self)
        wire.clock.hold(traits.i2c_overhead_ns)
        try:
            if not self._connected():
                raise BusStuck("scl")
            return transfer(wire, 1_000_000_000 // self._freq)
        except BusStuck:
            wire.clock.hold(self._timeout * 1000)
            return -traits.etimedout
        except ArbitrationLost:
            return -self._arbitration_errno()
        finally:
            wire.release()

    def _write(self, addr, data, stop):
        if not data:
            return self._probe(addr)
        return self._run(lambda wire, bit_ns: self._write_bytes(wire, bit_ns, addr, data, stop))

    def _read(self, addr, view, stop):
        return self._run(lambda wire, bit_ns: self._read_bytes(wire, bit_ns, addr, view, stop))

    def _write_bytes(self, wire, bit_ns, addr, data, stop):
        if not wire.start(addr, False, bit_ns):
            wire.stop(bit_ns)
            return -self._port.traits.enodev
        for index, value in enumerate(data):
            if not wire.write(value, bit_ns):
                wire.stop(bit_ns)
                return self._data_nack(index)
        if stop:
            wire.stop(bit_ns)
        return len(data)

    def _read_bytes(self, wire, bit_ns, addr, view, stop):
        if not wire.start(addr, True, bit_ns):
            wire.stop(bit_ns)
            return -self._port.traits.enodev
        last = len(view) - 1
        for index in range(len(view)):
            view[index] = wire.read(index == last, bit_ns)
        if stop:
            wire.stop(bit_ns)
        return len(view)


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
    """Every failure but a time-out is EIO; a data byte not acknowledged is no failure: the count is shorter."""

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
            cls._port.reset_block(id)
        return self

    def _arbitration_errno(self):
        return 5

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
            return 0 if ack else -19
        finally:
            wire.release()


class Esp32I2C(HardwareI2C):
    """A byte not acknowledged is ENODEV, a held line or lost arbitration ETIMEDOUT (116)."""

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

    def _data_nack(self, index):
        return -self._port.traits.enodev

    def _probe(self, addr):
        return self._run(lambda wire, bit_ns: self._write_bytes(wire, bit_ns, addr, b"", True))

    def _read_memory(self, addr, register, view):
        """One transfer with a repeated START."""
        return self._run(lambda wire, bit_ns: self._combined(wire, bit_ns, addr, register, view))

    def _combined(self, wire, bit_ns, addr, register, view):
        count = self._write_bytes(wire, bit_ns, addr, register, False)
        return count if count < 0 else self._read_bytes(wire, bit_ns, addr, view, True)


class SoftI2C(Transfers):
    """Bit-banged on any two pins; has the primitive operations. ENODEV for an address not acknowledged."""

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
        return 19

    def _data_nack(self, index):
        return index

    def _bit_ns(self):
        return 2000 * max(1, 500_000 // self._freq)

    def _probe(self, addr):
        wire = self._wire()
        wire.claim(self)
        try:
            ack = wire.bit_bang_probe(addr, self._bit_ns())
            return -self._port.traits.etimedout if ack is None else (0 if ack else -19)
        finally:
            wire.release()

    def _write_bytes(self, wire, bit_ns, addr, data, stop):
        count = super()._write_bytes(wire, self._bit_ns(), addr, data, stop)
        return -19 if count == -self._port.traits.enodev else count

    def _read_bytes(self, wire, bit_ns, addr, view, stop):
        count = super()._read_bytes(wire, self._bit_ns(), addr, view, stop)
        return -19 if count == -self._port.traits.enodev else count

    def start(self):
        """START; the address follows as the first byte of `write`."""
        self._wire().claim(self)
        self._address_next = True

    def stop(self):
        self._wire().stop(self._bit_ns())
        self._wire().release()

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

# SPDX-License-Identifier: MIT
"""`machine.I2C` and `machine.SoftI2C`: MicroPython's methods (extmod/machine_i2c.c) over a virtual
bus.
"""

from tools.virtual.bus import ArbitrationLost, BusStuck

from .wire import Collision

_NAMES = {5: "EIO", 19: "ENODEV", 110: "ETIMEDOUT", 116: "ETIMEDOUT"}
_UNSUPPORTED = "I2C operation not supported"


class Methods:
    """What hardware and bit-banged I2C share. Subclasses give `_write`, `_read` (both return a
    count or a negative errno) and `_probe`.
    """

    _port = None

    def init(self, *args, **kwargs):
        raise OSError(_UNSUPPORTED)

    def scan(self):
        """Addresses 0x08 to 0x77 that acknowledge."""
        self._allocates("scan")
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
        self._allocates("readfrom")
        data = bytearray(nbytes)
        self._done(self._read(addr, data, bool(stop)))
        return bytes(data)

    def readfrom_into(self, addr, buf, stop=True, /):
        self._done(self._read(addr, memoryview(buf).cast("B"), bool(stop)))

    def writeto(self, addr, buf, stop=True, /):
        """Returns the number of bytes acknowledged."""
        return self._done(self._write(addr, bytes(buf), bool(stop)))

    def writevto(self, addr, vector, stop=True, /):
        self._allocates("writevto")
        return self._done(self._write(addr, b"".join(bytes(part) for part in vector), bool(stop)))

    def readfrom_mem(self, addr, memaddr, nbytes, /, *, addrsize=8):
        self._allocates("readfrom_mem")
        data = bytearray(nbytes)
        self._done(self._read_memory(addr, _memory_address(memaddr, addrsize), data))
        return bytes(data)

    def readfrom_mem_into(self, addr, memaddr, buf, /, *, addrsize=8):
        view = memoryview(buf).cast("B")
        self._done(self._read_memory(addr, _memory_address(memaddr, addrsize), view))

    def writeto_mem(self, addr, memaddr, buf, /, *, addrsize=8):
        self._allocates("writeto_mem")
        self._done(self._write(addr, _memory_address(memaddr, addrsize) + bytes(buf), True))

    def _read_memory(self, addr, register, view):
        """Register number and read as two transfers, as the port does without a combined one."""
        count = self._write(addr, register, False)
        if count != len(register):
            self._probe(addr)  # generates the STOP
            return count
        return self._read(addr, view, True)

    def _allocates(self, name):
        self._port.hard.refuse("I2C.%s()" % name, MemoryError)

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
    """Byte transfers on a Wire with the port's errors; `_freq` in Hz, `_timeout` in us."""

    _length = 0  # bytes of the transfer under way

    def _stuck_ns(self):
        """How long it waits for a line that is held low."""
        return self._timeout * 1000

    def _run(self, transfer):
        """Do one transfer: claims the wire, charges the software's time, turns bus errors into a
        negative errno.
        """
        traits, wire = self._port.traits, self._wire()
        wire.claim(self)
        try:
            wire.spend(traits.i2c_overhead_ns)
            if not self._connected():
                raise BusStuck("scl")
            return transfer(wire, 1_000_000_000 // self._freq)
        except BusStuck:
            wire.clock.hold(self._stuck_ns())
            return -traits.etimedout
        except ArbitrationLost:
            return -self._arbitration_errno()
        except Collision as collision:
            return self._collided(wire, collision)
        finally:
            wire.release(self)

    def _collided(self, wire, collision):
        """The block was taken by an interrupt: what was asked for is flushed, and never comes."""
        if not collision.reading:
            return -self._arbitration_errno()
        wire.clock.hold(self._stuck_ns())
        return -self._port.traits.etimedout

    def _write(self, addr, data, stop):
        self._length = len(data)
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
            if not self._put(wire, bit_ns, addr, value):
                wire.stop(bit_ns)
                return self._data_nack(index)
        if stop:
            wire.stop(bit_ns)
        return len(data)

    def _put(self, wire, bit_ns, addr, value):
        """One byte; True for ACK. The firmware does not notice that an interrupt flushed its
        block: what is left goes out as a transfer of its own, its first byte as the register.
        """
        try:
            return wire.write(value, bit_ns)
        except Collision:
            wire.claim(self)
            return wire.start(addr, False, bit_ns)

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

# SPDX-License-Identifier: MIT
"""Peripheral registers by address, for viper's ptr32 and for `machine.mem32`."""

from .rp2_i2c import ACCESS_NS, I2CBlock


class BlockPointer:
    """`ptr32(address)` into a block, in viper's terms: index in words, values signed. Knows the
    alias regions.
    """

    def __init__(self, block, offset, alias):
        self.block, self.offset, self.alias = block, offset, alias

    def __getitem__(self, index):
        value = self.block.read(self.offset + 4 * index)
        return (value ^ 0x80000000) - 0x80000000

    def __setitem__(self, index, value):
        offset, value = self.offset + 4 * index, value & 0xFFFFFFFF
        if self.alias:
            before = self.block.read(offset)
            value = (None, before ^ value, before | value, before & ~value)[self.alias]
        self.block.write(offset, value)


class TimerPointer:
    """The microsecond counter (TIMERAWL) for viper code that measures without allocating."""

    _LOW_WORDS = (0x0C, 0x28)
    _HIGH_WORDS = (0x08, 0x24)

    def __init__(self, port, offset):
        self.port, self.offset = port, offset

    def __getitem__(self, index):
        offset = self.offset + 4 * index
        self.port.clock.hold(ACCESS_NS)
        if offset in self._LOW_WORDS:
            return ((self.port.timer_us() & 0xFFFFFFFF) ^ 0x80000000) - 0x80000000
        if offset in self._HIGH_WORDS:
            return self.port.timer_us() >> 32
        raise IndexError("timer register 0x%02X is not modelled" % offset)


class WakePointer:
    """DORMANT_WAKE_INTE of IO_BANK0, four bits a pin: what ends machine.deepsleep()."""

    def __init__(self, words, index):
        self.words, self.index = words, index

    def __getitem__(self, index):
        return self.words[self.index + index]

    def __setitem__(self, index, value):
        self.words[self.index + index] = value & 0xFFFFFFFF

    @staticmethod
    def awake(words, level_of):
        """Whether a pin is at a level that it is to wake at."""
        for pin in range(8 * len(words)):
            bits = words[pin // 8] >> 4 * (pin % 8) & 3  # LEVEL_LOW, LEVEL_HIGH
            if bits and bits & (2 if level_of(pin) else 1):
                return True
        return False


class Peripherals:
    """The I2C blocks and the timer of an RP2040 or RP2350; other ports have none here."""

    def __init__(self, port):
        self.port = port
        self.blocks = [I2CBlock(port, n) for n in range(len(port.traits.block_bases))]
        self.wake = [0] * ((port.traits.pin_count + 7) // 8)
        self._found = {}  # address: what is there

    def find(self, address, kind):
        """Return what a pointer of `kind` to `address` reaches, or None."""
        if kind != "ptr32":
            return None
        if address not in self._found:
            self._found[address] = self._look(address)
        return self._found[address]

    def _look(self, address):
        base, alias, offset = address & ~0x3FFF, address >> 12 & 3, address & 0xFFF
        bases = self.port.traits.block_bases
        if base in bases:
            return BlockPointer(self.blocks[bases.index(base)], offset, alias)
        wake = address - self.port.traits.wake_registers >> 2
        if self.port.traits.wake_registers and 0 <= wake < len(self.wake):
            return WakePointer(self.wake, wake)
        if base == self.port.traits.timer_base:
            return TimerPointer(self.port, offset)
        return None

    def settings(self, number):
        """(frequency in Hz, Wire) of an I2C block; it is in reset until `machine.I2C` was made."""
        i2c = self.port.machine.I2C._blocks.get(number)
        if i2c is None:
            raise RuntimeError("I2C%d is held in reset: make a machine.I2C first" % number)
        sda, scl = (i2c.sda, i2c.scl) if i2c._connected() else (None, None)
        return i2c._freq, self.port.wire_at(sda, scl)

    def reset(self, number):
        """What `machine.I2C(number, ...)` does to the block."""
        self.blocks[number].disable()

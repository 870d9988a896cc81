# SPDX-License-Identifier: MIT
"""A chip on I2C whose configuration is a table: applied, read back, re-checked row by row."""

import time

import micropython
from micropython import const

_EIO = const(5)
_TRIES = const(3)  # of a transfer that fails at once, and of a row that reads back wrong
_QUICK_US = const(2000)  # a stuck bus takes longer: it is not asked again
_ASK_MS = const(2)
_STEADY = const(30)  # an answer that nobody expects is one after so many in a row


class Registers:
    """Verified registers of the device `NAME` at `address` on any bus with MicroPython's methods.

    The table holds rows of three bytes: register, value, mask of the bits that are ours. It is
    what the chip should hold; set_bits() changes both, check() compares them, repair() mends.
    One transfer in a hundred fails on a poor wire: it is made again, twice at most.
    """

    NAME = "device"

    def __init__(self, i2c, address):
        # a context manager to be held during each transfer, where a tick shares the bus
        self.lock = None
        self.bus = i2c
        self.address = address
        self._table = bytearray()
        self._next = 0
        self._byte = bytearray(1)

    # native: as bytecode their frames would be heap blocks
    @micropython.native
    def load(self, register, buffer):
        """Fill the buffer from consecutive registers. OSError when the bus fails."""
        self._transfer(False, register, buffer)

    @micropython.native
    def store(self, register, value):
        """Write one register, unverified; settings go through set_bits(). OSError."""
        self._transfer(True, register, value)

    @micropython.native
    def _transfer(self, write, register, what):
        if self.lock:
            with self.lock:
                self._patiently(write, register, what)
        else:
            self._patiently(write, register, what)

    @micropython.native
    def _patiently(self, write, register, what):
        left = _TRIES
        while left:
            left -= 1
            began = time.ticks_us()
            try:
                self._once(write, register, what)
                left = 0
            except OSError as error:
                if not left or time.ticks_diff(time.ticks_us(), began) > _QUICK_US:
                    raise error  # without a name native code cannot

    @micropython.native
    def _once(self, write, register, what):
        if write:
            self._store(register, what)
        else:
            self._load(register, what)

    def ask(self, register, expected, wait_ms, seen):
        """What the register holds, for a device that may still be starting: asked for wait_ms.

        An expected value counts when it comes twice in a row, any other when it is always the
        same. None: no answer that counts. seen: a dict in which each value, and the errno of each
        failure negated, is counted.
        """
        byte = self._byte
        began = time.ticks_ms()
        last, same = None, 0
        while True:
            try:
                if self.lock:
                    with self.lock:
                        self._load(register, byte)
                else:
                    self._load(register, byte)
                got = byte[0]
            except OSError as error:
                got = -(error.args[0] if error.args else _EIO)
            seen[got] = seen.get(got, 0) + 1
            same = same + 1 if got == last else 1
            last = got
            if 0 < got < 255 and same >= (2 if got in expected else _STEADY):
                return got
            if time.ticks_diff(time.ticks_ms(), began) >= wait_ms:
                return None
            if got not in expected:
                time.sleep_ms(_ASK_MS)

    def _load(self, register, buffer):
        self.bus.readfrom_mem_into(self.address, register, buffer)

    def _store(self, register, value):
        self._byte[0] = value
        self.bus.writeto_mem(self.address, register, self._byte)

    def set_bits(self, register, value, mask):
        """Set the bits of `mask`, verify them, and only then keep them in the table. OSError."""
        self._apply(register, value, mask)
        table = self._table
        for row in range(0, len(table), 3):
            if table[row] == register:
                table[row + 1] = table[row + 1] & ~mask | value
                table[row + 2] |= mask
                return
        table.extend(bytes((register, value, mask)))

    def wanted(self, register):
        """What the table says that the register shall hold; 0 where it says nothing."""
        table = self._table
        for row in range(0, len(table), 3):
            if table[row] == register:
                return table[row + 1]
        return 0

    @micropython.native
    def check(self):
        """Compare the next row with the chip: False when it differs. One short transaction."""
        row = self._step()
        table, byte = self._table, self._byte
        self.load(table[row], byte)
        return not (byte[0] ^ table[row + 1]) & table[row + 2]

    def recheck(self):
        """Compare the row of the last check() once more: one bit of the answer may be wrong."""
        self._step(-3)
        return self.check()

    def repair(self):
        """Write and verify the next row; True when that was the last one of the table. OSError.

        For a running loop: one call each tick brings back a chip that lost its settings.
        """
        row = self._step()
        self._apply(self._table[row], self._table[row + 1], self._table[row + 2])
        return self._next == 0

    @property
    def rows(self):
        """How many rows the table has: after so many check() has seen all."""
        return len(self._table) // 3

    def rewind(self):
        """Let the next check() or repair() begin with the first row, the one that wakes."""
        self._next = 0

    def apply_all(self):
        """Write and verify every row, the first one first. OSError names the first bad row."""
        self.rewind()
        while not self.repair():
            pass

    def _step(self, by=3):
        row = self._next
        self._next = (row + by) % len(self._table)
        return row

    def _apply(self, register, value, mask):
        byte = self._byte
        for _ in range(_TRIES):
            wanted = value
            if mask != 0xFF:
                self.load(register, byte)
                wanted |= byte[0] & ~mask
            self.store(register, wanted)
            self.load(register, byte)
            if not (byte[0] ^ value) & mask:
                return
        text = "%s at 0x%02X: register 0x%02X reads 0x%02X, expected 0x%02X in bits 0x%02X"
        seen = (self.NAME, self.address, register, byte[0], wanted, mask)
        raise OSError(_EIO, text % seen)

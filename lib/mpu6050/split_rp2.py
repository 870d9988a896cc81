# SPDX-License-Identifier: MIT
"""The 14-byte burst in two phases on the I2C blocks of RP2040 and RP2350.

A block's FIFOs hold 16 entries: register number and 14 read commands are 15, the answer is 14
bytes. So `start()` queues all of it and the processor is free while the bus works. machine.I2C
has set up pins and speed; each of its calls disables the block first, so it must not be used
while a burst runs: the driver's own calls wait for it, also those of two sensors on one bus, and
other users call `imu.finish()` first. One who does not breaks the burst: poll() reports
ETIMEDOUT.
Registers: RP2040 datasheet section 4.3.17, the same block (DW_apb_i2c) in the RP2350's 12.2.17.
"""

import sys
from array import array

import micropython
from micropython import const

# word offsets in the block
_IC_TAR = const(0x04 >> 2)
_IC_DATA_CMD = const(0x10 >> 2)  # RESTART [10], STOP [9], read CMD [8], DAT [7:0]
_IC_CLR_TX_ABRT = const(0x54 >> 2)
_IC_ENABLE = const(0x6C >> 2)  # ABORT [1], ENABLE [0]
_IC_STATUS = const(0x70 >> 2)  # MST_ACTIVITY [5]
_IC_RXFLR = const(0x78 >> 2)
_IC_TX_ABRT_SOURCE = const(0x80 >> 2)

_ACCEL_XOUT_H = const(0x3B)
_EIO = const(5)
_ETIMEDOUT = const(110)
_WRAP = const(0x3FFFFFFF)  # differences of the free-running timer, as ticks_diff() has them

# shared words of a block: address whose burst is under way (0: none), block, timer, start, limit
_BUSY = const(0)
_BLOCK = const(1)
_TIMER = const(2)
_STARTED_US = const(3)
_LIMIT_US = const(4)
# words of one sensor: address; what finish() left: 0 nothing, 1 a sample, -errno a failure; when
# its last burst began; how old a burst may be when it is taken; not 0: another's was ahead, or
# its own last one came too late
_ADDRESS = const(0)
_LEFT = const(1)
_BEGAN_US = const(2)
_EXPIRE_US = const(3)
_HELD_UP = const(4)
_NEVER_US = const(1 << 29)

_blocks = {}  # type: dict  # block address: (shared words, {sensor address: Split})


def _shared(i2c):
    """The words and users of the block behind a machine.I2C, found by the text it prints."""
    text = str(i2c)
    second = text.startswith("I2C(1")
    hz = int(text.split("freq=")[1].split(",")[0].strip(")"))
    if "RP2350" in sys.implementation._machine:
        block, timer = 0x40098000 if second else 0x40090000, 0x400B0028
    else:
        block, timer = 0x40048000 if second else 0x40044000, 0x40054028
    # 17 bytes of 9 clocks; twice that, and half a millisecond for a stretched clock
    limit = 2 * 17 * 9 * 1_000_000 // hz + 500
    if block not in _blocks:
        _blocks[block] = (array("i", (0, 0, 0, 0, 0)), {})
    words, users = _blocks[block]
    words[_BUSY], words[_BLOCK], words[_TIMER], words[_LIMIT_US] = 0, block, timer, limit
    return words, users


@micropython.viper
def take(own, busy, counts) -> int:
    """1: the burst is in counts; 0: it is under way, was not begun, or is too old to be of
    now; else -errno: EIO when the sensor did not acknowledge or lost arbitration, ETIMEDOUT
    when the bus is stuck or someone else used it meanwhile. Never raises, never waits.
    """
    words = ptr32(own)
    shared = ptr32(busy)
    timer = ptr32(shared[_TIMER])
    old = ((timer[0] & _WRAP) - words[_BEGAN_US] & _WRAP) > words[_EXPIRE_US]
    if shared[_BUSY] != words[_ADDRESS]:
        left = words[_LEFT]
        words[_LEFT] = 0
        if left > 0:
            words[_HELD_UP] = int(old)
            if old:
                return 0
        return left
    bus = ptr32(shared[_BLOCK])
    if bus[_IC_RXFLR] != 14:
        left = int(_unready(own, busy))
        if left <= 0:
            return left
    c = ptr8(counts)
    c[1] = bus[_IC_DATA_CMD] & 0xFF  # FIRST_DATA_BYTE [11] comes with this one
    c[0] = bus[_IC_DATA_CMD]
    c[3] = bus[_IC_DATA_CMD]
    c[2] = bus[_IC_DATA_CMD]
    c[5] = bus[_IC_DATA_CMD]
    c[4] = bus[_IC_DATA_CMD]
    c[7] = bus[_IC_DATA_CMD]
    c[6] = bus[_IC_DATA_CMD]
    c[9] = bus[_IC_DATA_CMD]
    c[8] = bus[_IC_DATA_CMD]
    c[11] = bus[_IC_DATA_CMD]
    c[10] = bus[_IC_DATA_CMD]
    c[13] = bus[_IC_DATA_CMD]
    c[12] = bus[_IC_DATA_CMD]
    shared[_BUSY] = 0
    words[_HELD_UP] = int(old)
    if old:
        return 0
    return 1


@micropython.viper
def _unready(own, busy) -> int:
    """take() of a burst that has not arrived. Two Apps tick at the same distance for ever: where
    one's begins a little ahead of the other's, that one is late each time, and is waited for. So
    is one after one that came too late: a program in step with the ticks may hold up each.
    """
    words = ptr32(own)
    shared = ptr32(busy)
    bus = ptr32(shared[_BLOCK])
    timer = ptr32(shared[_TIMER])
    limit = shared[_LIMIT_US]
    if words[_HELD_UP]:
        limit >>= 1  # what a burst takes, and 250 us
        while ((timer[0] & _WRAP) - shared[_STARTED_US]) & _WRAP < limit:
            if bus[_IC_RXFLR] == 14:
                return 1
            if bus[_IC_TX_ABRT_SOURCE]:
                limit = 0
    error = 0
    if bus[_IC_TX_ABRT_SOURCE]:
        error = _EIO
    else:
        if ((timer[0] & _WRAP) - shared[_STARTED_US]) & _WRAP > shared[_LIMIT_US]:
            error = _ETIMEDOUT
            bus[_IC_ENABLE] = 3  # abort: STOP after the byte in hand, if the wires allow
            wait = 1000
            while bus[_IC_ENABLE] & 2 and wait:
                wait -= 1
    if error:
        bus[_IC_CLR_TX_ABRT]
        bus[_IC_ENABLE] = 0  # empties both FIFOs
        shared[_BUSY] = 0
    return 0 - error


class Split:
    """One sensor's burst; `busy[0]` is not 0 while any sensor's burst runs on this block.

    burst: take() and its arguments, which cost a tick less than a method that looks them up.
    """

    def __init__(self, i2c, address, counts):
        self._own = array("i", (address, 0, 0, _NEVER_US, 0))
        self._counts = counts
        self.use_bus(i2c)

    def use_bus(self, i2c):
        """Work on the block behind this machine.I2C, which may be made anew after a recovery."""
        self.busy, self._users = _shared(i2c)
        self.burst = take, self._own, self.busy, self._counts
        self._users[self._own[_ADDRESS]] = self
        for user in self._users.values():
            user._own[_LEFT] = 0  # how it failed on the wires that were freed

    def expire(self, age_us):
        """A burst begun longer ago than this is not of now: poll() drops it."""
        self._own[_EXPIRE_US] = age_us

    @micropython.viper
    def start(self):
        """Queue the burst and return. While one is under way the call does nothing, nor while
        poll() has still to tell how the last one failed; one that has arrived and is too old to be
        taken is dropped for it.
        """
        own = ptr32(self._own)
        shared = ptr32(self.busy)
        bus = ptr32(shared[_BLOCK])
        timer = ptr32(shared[_TIMER])
        if own[_LEFT] < 0:
            return
        held = shared[_BUSY]
        if held == own[_ADDRESS]:
            if (
                bus[_IC_RXFLR] != 14
                or ((timer[0] & _WRAP) - own[_BEGAN_US] & _WRAP) <= own[_EXPIRE_US]
            ):
                return
        elif held:
            self.finish()
        own[_HELD_UP] |= held | own[_LEFT]  # what is left there was never taken
        own[_LEFT] = 0
        shared[_BUSY] = own[_ADDRESS]
        shared[_STARTED_US] = timer[0] & _WRAP
        own[_BEGAN_US] = shared[_STARTED_US]
        wait = 100  # the STOP of the transfer before may still be on the wires
        while bus[_IC_STATUS] & 0x20 and wait:
            wait -= 1
        bus[_IC_ENABLE] = 0
        bus[_IC_TAR] = own[_ADDRESS]
        bus[_IC_ENABLE] = 1
        bus[_IC_DATA_CMD] = _ACCEL_XOUT_H
        bus[_IC_DATA_CMD] = 0x500
        i = 12
        while i:
            bus[_IC_DATA_CMD] = 0x100
            i -= 1
        bus[_IC_DATA_CMD] = 0x300

    @micropython.native
    def poll(self):
        """See take()."""
        return take(self._own, self.busy, self._counts)

    @micropython.native
    def collect(self):
        """True when the burst is in counts, False while it runs; without start() it starts one.
        OSError with what poll() tells.
        """
        got = take(self._own, self.busy, self._counts)
        if got < 0:
            raise OSError(-got)
        if not got and not self.busy[_BUSY]:
            self.start()
        return got == 1

    def finish(self):
        """Wait for the burst under way, whoever's it is, and keep it for that one's poll()."""
        owner = self._users[self.busy[_BUSY]]
        left = 0
        while not left and self.busy[_BUSY]:
            left = owner.poll()
        owner._own[_LEFT] = left

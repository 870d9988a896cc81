# SPDX-License-Identifier: MIT
"""The way out of faults, a step a call, in the foreground: it allocates, waits and may raise.

The tick goes on meanwhile and predicts. What an action needs is spread over calls, so that none
holds the bus for long; each transfer takes the lock by itself (the driver's `lock`).
"""

import time

from micropython import const

from firmware.faults import policy
from firmware.tick import cause_of

# what is under way
_WELL = const(0)
_VERIFY = const(1)
_REPAIR = const(2)
_RESET = const(3)
_RESET_PATHS = const(4)  # the chip was reset, its signal paths are next
_RESET_DONE = const(5)

# places: firmware.tick.words
_ODD = const(0)
_CAUSE = const(1)
_IN_ROW = const(2)
_PREDICTED = const(4)
_UNUSED_US = const(6)
_RING_US = const(7)
_SURE = const(8)
_FORGET = const(9)
_COUNT = const(30)

_RESET_MS = const(100)  # after each step of a reset (RM p. 41)
_START_US = const(30000)  # the gyro's, from sleep (PS p. 12); then its low-pass forgets that
_NOT_YET_US = const(1000000000)
_PER_CALL = const(4)  # registers looked at or written in a call


class Mend:
    """Watches the tick's words and brings the sensor back.

    imu: the driver; board: frees the bus; bus: firmware.bus; adopted: called when another part
    was taken on.
    """

    def __init__(self, imu, board, bus, words, adopted):
        self._imu, self._board, self._bus, self._words = imu, board, bus, words
        self._adopted = adopted
        self._doing = _WELL
        self._acted = 0  # IN_ROW when something was done last, in this outage
        self._outage = 0
        self._row = 0
        self._wait_ms = None
        self._lost = False  # a register's value, and that is counted

    @property
    def well(self):
        """Whether there is nothing to do."""
        return self._doing == _WELL and not self._words[_IN_ROW]

    @property
    def idle(self):
        """Whether a step has nothing to do: all is well, or it is mended and still settles."""
        return self._doing == _WELL and bool(self._words[_SURE] or not self._words[_IN_ROW])

    def run(self):
        """A step, where one is due; nothing while somebody else holds the bus."""
        words = self._words
        if self._bus.held or self.idle:
            return
        predicted = in_row = -1
        while predicted != words[_PREDICTED]:  # a tick may come between
            predicted, in_row = words[_PREDICTED], words[_IN_ROW]
        if predicted - in_row != self._outage:  # there was a good sample, or another cause
            self._outage, self._acted = predicted - in_row, 0
        try:
            if self._doing == _WELL or words[_CAUSE] == policy.TIMEOUT:
                self._decide(words[_CAUSE], in_row)
            if self._doing:
                self.release()
            if self._doing == _VERIFY:
                self._verify()
            elif self._doing == _REPAIR:
                self._repair()
            elif self._doing >= _RESET:
                self._reset()
        except OSError as error:
            self._failed(error)

    def repair(self):
        """A register has lost its value while all else is well."""
        self._count(policy.REGISTER)
        self._go(_REPAIR)

    def count(self, error):
        """Count what a transfer of the foreground raised."""
        self._count(_cause(error))

    def _decide(self, cause, in_row):
        if cause == policy.UNVERIFIED:
            if in_row and not self._words[_SURE]:
                self._go(_VERIFY)
            return
        action = policy.action(cause, in_row, self._acted, self._board.one_error)
        if action == policy.HOLD:
            return
        self._acted = in_row
        if action == policy.RECOVER:
            self._recover()
        elif action == policy.VERIFY:
            self._go(_VERIFY)
        elif action == policy.RESET:
            self._go(_RESET)

    def release(self):
        """A bus that is held is freed first: each transfer on it would wait for its time-out."""
        with self._bus:
            if self._board.held:
                self._count(policy.TIMEOUT)
                self._recover()

    def _recover(self):
        with self._bus:
            i2c = self._board.recover()
            if i2c is not self._imu.bus:  # else it would be read anew where it is, allocating
                self._imu.use_bus(i2c)

    def _go(self, doing):
        words = self._words
        self._doing = doing
        self._imu.rewind()
        self._row = 0
        self._wait_ms = None
        if doing >= _REPAIR:  # its bursts mean nothing until it has settled
            words[_UNUSED_US] = _NOT_YET_US
            words[_ODD] = 1

    def _done(self, settle_us):
        words = self._words
        self._doing = _WELL
        self._lost = False
        words[_SURE] = words[_FORGET] = 1
        words[_UNUSED_US] = settle_us
        words[_ODD] = 1

    def _failed(self, error):
        """The bus failed meanwhile: the tick will see it too, and what was done is not sure."""
        words = self._words
        self._count(_cause(error))
        self._doing = _WELL
        words[_SURE] = words[_UNUSED_US] = 0
        words[_ODD] = 1

    def _count(self, cause):
        if cause == policy.REGISTER:
            if self._lost:
                return  # once, however often it is written and read until it holds
            self._lost = True
        self._words[_COUNT + cause] += 1

    def _verify(self):
        imu = self._imu
        for _ in range(_PER_CALL):
            if not (imu.check() or imu.recheck()):
                self.repair()
                return
            self._row += 1
            if self._row == imu.rows:
                if self._same_part():
                    self._done(0)
                return

    def _repair(self):
        for _ in range(_PER_CALL):
            if self._imu.repair():
                if self._same_part():
                    self._done(_START_US + self._words[_RING_US])
                return

    def _same_part(self):
        """True unless another part sits there; one that is known is taken on."""
        imu = self._imu
        if imu.same_part():
            return True
        self._count(policy.ANOTHER)
        if imu.adopt():
            self._adopted()
            self._go(_REPAIR)
        else:
            self._doing = _WELL
        return False

    def _reset(self):
        now = time.ticks_ms()
        if self._wait_ms is not None and time.ticks_diff(now, self._wait_ms) < 0:
            return
        self._wait_ms = time.ticks_add(now, _RESET_MS)  # type: ignore[assignment]
        if self._doing == _RESET:
            self._imu.reset_chip()
        elif self._doing == _RESET_PATHS:
            self._imu.reset_paths()
        else:
            self._go(_REPAIR)
            return
        self._doing += 1


def _cause(error):
    if "register" in str(error):  # the driver's verification
        return policy.REGISTER
    return cause_of(-(error.errno or 5))

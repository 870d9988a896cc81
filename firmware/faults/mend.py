# SPDX-License-Identifier: MIT
"""One good burst per tick into imu.counts, or the last good one again; and the way out of faults.

The policy is health.POLICY. What an action needs is spread over ticks, so that none is long.
"""

import errno

import micropython
from micropython import const

from firmware.faults import policy as h
from firmware.tick import judge as guard
from firmware.tick.judge import judge

# What a tick does; from _VERIFY on it reads no burst.
_RUN = const(0)
_SETTLE = const(1)  # reads, but does not use it yet
_VERIFY = const(2)
_REPAIR = const(3)
_RESET = const(4)
_RESET_PATHS = const(5)  # the chip was reset, its signal paths are next
_RESET_DONE = const(6)

_RESET_US = const(100000)  # after each step of a reset (RM p. 41)
_SETTLE_US = const(35000)  # gyro start-up to within 1 % (PS p. 12)
_SHORT_US = const(15000)  # in an outage shorter than this no chip can have lost its settings
_MODES = {
    h.VERIFY: (_VERIFY, 0),
    h.REPAIR: (_REPAIR, 0),
    h.RESET: (_RESET, 0),
    h.RING: (_SETTLE, 0),
}
_PER_TICK = const(4)  # registers verified in a tick, about as long as a burst


class Sensing:
    """Fetches for the loop. `split`: begin() starts the burst that fetch() collects.

    imu: the driver; board: for the recovery of the bus; health: takes the counts; slowly: called
    with a count whenever it is time for slow work (health's look_every).
    another: True when another part was taken on, until somebody sets it False.

    fetch(dt_us): True with a new good burst in imu.counts; False with the last good one there.
    dt_us: time since the last call. Faults are counted and acted on; nothing is raised. While
    all is well it is the function of _quick(), else _mend(): a test of the mode in each tick
    would cost as much as the judgement of the burst.
    """

    def __init__(self, imu, board, health, split, slowly):
        self._imu = imu
        self._board = board
        self._health = health
        self._split = split
        self._slowly = slowly
        self._looks = 0
        self._wait_us = 0
        self._row = 0
        self._sure = True  # that the chip has its settings
        self.another = False
        self._mending = self._mend  # a bound method is a heap block: made once
        self._taking = self._quick()
        self._go(_RUN)

    def begin(self):
        """Start the burst of the coming tick; returns at once."""
        if self._mode <= _SETTLE:
            self._imu.start()

    def _quick(self):
        """fetch() of a sensor that is well, with all it needs as locals: 40 us less a tick."""
        imu, health = self._imu, self._health

        @micropython.native  # bytecode takes 30 us longer
        def fetch(
            dt_us,
            take=imu.collect if self._split else imu.read,
            judge=judge,
            counts=imu.counts,
            memory=health.memory,
            odd=self._odd,
        ):
            try:
                while take() is False:  # it ends: the driver raises ETIMEDOUT
                    pass
                cause = judge(counts, memory)
                if not cause:
                    return True
            except OSError as error:
                cause = _cause(error)
            return odd(cause, dt_us)

        return fetch

    def _go(self, mode):
        self._mode = mode
        self.fetch = self._mending if mode else self._taking

    @micropython.native
    def _odd(self, cause, dt_us):
        if cause == guard.LOOK:
            return self._look(dt_us)
        if cause <= h.FROZEN:
            self._sure = False
        self._act(self._health.bad(cause, dt_us))
        return False

    @micropython.native
    def _look(self, dt_us):
        """A good burst after an outage, or time to compare the next of the registers."""
        health = self._health
        if health.in_row:
            if not self._sure and health.age_us > _SHORT_US:
                self._act(h.VERIFY)
                return self._mend(dt_us)
            self._sure = True
            health.good(dt_us)
            return True
        try:
            if not (self._imu.check() or self._imu.recheck()):
                health.count(h.REGISTER)
                self._act(h.REPAIR)
        except OSError as error:
            health.count(_cause(error))
        self._looks += 1
        self._slowly(self._looks)
        return True

    def _act(self, action):
        if action == h.HOLD:
            return
        if action == h.RECOVER:
            self._imu.use_bus(self._board.recover())
            self._taking = self._quick()
            self._go(self._mode)
            return
        mode, self._wait_us = _MODES[action]
        self._go(mode)
        if action == h.RING:
            self._wait_us = self._health.ring_us
        else:
            self._imu.rewind()
            self._row = 0

    def _mend(self, dt_us):
        """A tick of the way back, no new burst; a failure begins it anew with VERIFY."""
        health = self._health
        try:
            if self._mode == _SETTLE:
                self._settle(dt_us)
            elif self._mode == _VERIFY:
                self._verify()
            elif self._mode == _REPAIR:
                self._repair()
            else:
                self._reset(dt_us)
            health.wait(dt_us)
        except OSError as error:
            action = health.bad(_cause(error), dt_us)
            self._act(h.VERIFY)
            if action == h.RECOVER:
                self._act(action)
        return False

    def _settle(self, dt_us):
        imu, health = self._imu, self._health
        if self._split:
            while not imu.collect():
                pass
        else:
            imu.read()
        self._wait_us -= dt_us
        if guard.saturated(imu.counts):
            health.count(h.SATURATED)
            self._wait_us = health.ring_us
        guard.hold(imu.counts, health.memory)
        if self._wait_us <= 0:
            guard.forget(health.memory)
            self._go(_RUN)

    def _verify(self):
        imu = self._imu
        for _ in range(_PER_TICK):
            if not (imu.check() or imu.recheck()):
                imu.rewind()
                self._health.count(h.REGISTER)
                self._go(_REPAIR)
                self._repair()  # a dead bus fails here, and the chip has lost nothing
                return
            self._row += 1
            if self._row == imu.rows:
                if self._same_part():
                    self._sure = True
                    guard.forget(self._health.memory)
                    self._go(_RUN)
                return

    def _repair(self):
        if self._imu.repair() and self._same_part():
            self._sure = True
            self._go(_SETTLE)
            self._wait_us = _SETTLE_US

    def _same_part(self):
        """True unless another part sits there; one that is known is taken on."""
        if self._imu.same_part():
            return True
        if self._imu.adopt():
            self.another = True
            self._health.count(h.ANOTHER)
            self._act(h.REPAIR)
        else:
            self._health.bad(h.ANOTHER, 0)
            self._act(h.VERIFY)
        return False

    def _reset(self, dt_us):
        self._wait_us -= dt_us
        if self._wait_us > 0:
            return
        self._wait_us = _RESET_US
        if self._mode == _RESET:
            self._imu.reset_chip()
            self._go(_RESET_PATHS)
        elif self._mode == _RESET_PATHS:
            self._imu.reset_paths()
            self._go(_RESET_DONE)
        else:
            self._act(h.REPAIR)


def _cause(error):
    if error.errno == errno.ETIMEDOUT:
        return h.TIMEOUT
    return h.REGISTER if "register" in str(error) else h.NACK  # the driver's verification

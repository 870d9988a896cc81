# SPDX-License-Identifier: MIT
"""One good burst per tick into imu.counts, or the last good one again; and the way out of faults.

The policy is health.POLICY. A repair writes the sensor's configuration a register each tick, so
that no tick is long; afterwards the gyro settles, and all registers are looked at again.
"""

import errno

from micropython import const

from firmware import health as h
from firmware.health import judge

_RUN = const(0)
_REPAIR = const(1)
_SETTLE = const(2)

_SETTLE_US = const(35000)  # gyro start-up to within 1 % (PS p. 12)
_CHECK_US = const(40000)  # time between two looks at a register: all of them in half a second
_ROWS = const(12)  # more than the configuration's table has: all of it, once after an outage


class Sensing:
    """Fetches for the loop. `split`: begin() starts the burst that fetch() collects.

    imu: the driver; board: for the recovery of the bus; health: takes the counts.
    """

    def __init__(self, imu, board, health, split):
        self._imu = imu
        self._board = board
        self._health = health
        self._split = split
        self._mode = _RUN
        self._settle_us = 0
        self._check_us = 0
        self._checks = 0  # looks still to be taken without delay

    def begin(self):
        """Start the burst of the coming tick; returns at once."""
        if self._mode != _REPAIR:
            self._imu.start()

    def fetch(self, dt_us):
        """True with a new good burst in imu.counts; False with the last good one there.

        dt_us: time since the last call. Faults are counted and acted on; nothing is raised.
        """
        if self._mode == _REPAIR:
            self._repair(dt_us)
            return False
        cause = self._burst()
        if self._mode == _SETTLE and not cause:
            self._settle_us -= dt_us
            if self._settle_us > 0:
                self._health.wait(dt_us)
                return False
            self._mode = _RUN
        if cause:
            self._act(self._health.bad(cause, dt_us))
            return False
        if self._health.good():
            self._checks = _ROWS
        self._recheck(dt_us)
        return True

    def _burst(self):
        imu = self._imu
        try:
            if self._split:
                while not imu.collect():
                    pass  # it ends: the driver raises ETIMEDOUT
            else:
                imu.read()
        except OSError as error:
            return _cause(error)
        return judge(imu.counts, self._health.memory, self._health.same_max)

    def _recheck(self, dt_us):
        self._check_us += dt_us
        if not self._checks and self._check_us < _CHECK_US:
            return
        self._check_us = 0
        if self._checks:
            self._checks -= 1
        try:
            if not self._imu.check():
                self._health.count(h.REGISTER)
                self._act(h.REPAIR)
        except OSError as error:
            self._health.count(_cause(error))

    def _act(self, action):
        if action == h.RECOVER:
            self._imu.use_bus(self._board.recover())
        elif action == h.REPAIR:
            self._imu.rewind()
            self._mode = _REPAIR

    def _repair(self, dt_us):
        self._health.wait(dt_us)
        try:
            if self._imu.repair():
                self._mode = _SETTLE
                self._settle_us = _SETTLE_US
        except OSError as error:
            self._imu.rewind()
            if self._health.bad(_cause(error), 0) == h.RECOVER:
                self._act(h.RECOVER)


def _cause(error):
    return h.TIMEOUT if error.errno == errno.ETIMEDOUT else h.NACK

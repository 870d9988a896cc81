# SPDX-License-Identifier: MIT
"""What counts as a fault in flight, how it is seen and what is done: a table and its accounts.

Whatever the fault, its sample is not used: the filter goes on with the last good one, so the
angle is predicted from the last rate, and the age of that sample is kept. After `failsafe_ms` the
estimate is stale, the angle is held, and outputs go to their safe values.
"""

from array import array

import micropython
from micropython import const

HOLD = const(0)  # nothing but the prediction; the next tick tries again
REPAIR = const(1)  # write the configuration again, a register each tick
RECOVER = const(2)  # nine clocks, STOP, a new I2C object; then REPAIR

# Faults of a burst, in the order of judge()'s codes.
# cause, how it is seen, faults in a row before the action, action
NACK = const(1)
TIMEOUT = const(2)
FILL = const(3)
FROZEN = const(4)
JUMP = const(5)
REGISTER = const(6)
POLICY = (
    ("good", "", 0, HOLD),
    ("nack", "the sensor does not acknowledge (EIO, ENODEV)", 10, RECOVER),
    ("timeout", "the bus does not move (ETIMEDOUT)", 1, RECOVER),
    ("fill", "all words equal, or a tail of 0xFE or 0xFF", 1, REPAIR),
    ("frozen", "the same 14 bytes for longer than a sensor's noise allows", 1, REPAIR),
    ("jump", "a rate or force that leaps for one or two samples", 0, HOLD),
    ("register", "a register does not hold its setting any more", 1, REPAIR),
)

# judge()'s memory, int16 words
_RAW = const(7)  # the burst before this one; the last good one is at 0
_SAME = const(14)  # how often the same burst came
_JUMPS = const(15)  # rejected as a leap in a row
_PRIMED = const(16)
_MEMORY = const(17)

_AGE_MAX_US = const(1000000000)  # a small int for ever

# Largest step of one sample, counts. Gyro: an eighth of full scale, what a flipped bit 12 makes;
# accelerometer: half of full scale, since vibration is not a fault.
_GYRO_LEAP = const(4096)
_ACCEL_LEAP = const(16384)


@micropython.viper
def judge(counts: ptr16, memory: ptr16, same_max: int) -> int:
    """0 for a good burst, which is remembered; else the fault's code, and counts are put back.

    A leap is believed when the next burst agrees with it, or after two rejections.
    """
    first = counts[0]
    equal = 0
    fresh = 0
    leap = 0
    agrees = 1
    i = 0
    while i < 7:
        raw = counts[i]
        if raw == first:
            equal += 1
        if raw != memory[_RAW + i]:
            fresh = 1
        if i != 3:  # the temperature steers nothing
            limit = _GYRO_LEAP if i > 3 else _ACCEL_LEAP
            value = (raw ^ 0x8000) - 0x8000
            step = value - ((memory[i] ^ 0x8000) - 0x8000)
            if step > limit or step < 0 - limit:
                leap = 1
            step = value - ((memory[_RAW + i] ^ 0x8000) - 0x8000)
            if step > limit or step < 0 - limit:
                agrees = 0
        memory[_RAW + i] = raw
        i += 1
    fault = 0
    tail = counts[6]
    if equal == 7:
        fault = FILL
    elif tail == counts[5] and tail == counts[4] and (tail == 0xFEFE or tail == 0xFFFF):
        fault = FILL if tail == counts[3] else 0
    if fault == 0 and memory[_PRIMED]:
        if fresh:
            memory[_SAME] = 0
        elif memory[_SAME] < same_max:
            memory[_SAME] += 1
        else:
            fault = FROZEN
        if fault == 0 and leap and agrees == 0 and memory[_JUMPS] < 2:
            memory[_JUMPS] += 1
            fault = JUMP
    if fault == 0:
        memory[_PRIMED] = 1
        memory[_JUMPS] = 0
    i = 0
    while i < 7:
        if fault == 0:
            memory[i] = counts[i]
        elif memory[_PRIMED]:
            counts[i] = memory[i]
        i += 1
    return fault


class Health:
    """Faults by cause, faults in a row, and the age of the last good sample.

    stale_us: age from which the estimate is stale; same_max: identical bursts in a row allowed.
    """

    def __init__(self, stale_us=100000, same_max=10):
        self.stale_us = stale_us
        self.same_max = same_max
        self.counts = array("i", [0] * len(POLICY))
        self.memory = array("H", [0] * _MEMORY)
        self.age_us = 0
        self.in_row = 0
        self.last = 0

    @property
    def stale(self):
        """Whether the last good sample is older than failsafe_ms."""
        return self.age_us >= self.stale_us

    def good(self):
        """A burst was good. Returns whether it ended an outage."""
        ended = self.in_row > 0
        self.in_row = 0
        self.age_us = 0
        return ended

    def bad(self, cause, dt_us):
        """A tick without a good sample, dt_us after the last tick. Returns the action."""
        self.counts[cause] += 1
        self.last = cause
        self.in_row += 1
        self._grow_old(dt_us)
        after = POLICY[cause][2]
        if after and self.in_row % after == 0:
            return POLICY[cause][3]
        return HOLD

    def wait(self, dt_us):
        """A tick without a sample that is no new fault: repairing, or settling after it."""
        self.in_row += 1
        self._grow_old(dt_us)

    def count(self, cause):
        """Count a fault that cost no sample."""
        self.counts[cause] += 1

    def _grow_old(self, dt_us):
        if self.age_us < _AGE_MAX_US:
            self.age_us += dt_us

    def stats(self):
        """{cause: count} of the causes seen, and the age of the last good sample in ms."""
        out = {"age_ms": self.age_us // 1000, "stale": self.stale}
        for code in range(1, len(POLICY)):
            if self.counts[code]:
                out[POLICY[code][0]] = self.counts[code]
        return out

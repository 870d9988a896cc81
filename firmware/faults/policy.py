# SPDX-License-Identifier: MIT
"""What counts as a fault in flight, how it is seen and what is done: a table and its accounts.

Whatever the fault, its sample is not used: the filter goes on with the last good rate, so the
angle is predicted, and the age of that sample is kept. From `failsafe_ms` on the estimate is
stale and outputs go to their safe values; firmware.tick.gap says how long it is still predicted.
"""

from array import array

from micropython import const

from firmware.tick import judge as guard

HOLD = const(0)  # nothing but the prediction; the next tick tries again
VERIFY = const(1)  # compare all registers with the configuration, and WHO_AM_I; else REPAIR
REPAIR = const(2)  # write the configuration again, a register each tick; settle
RESET = const(3)  # reset the chip first, its waits spread over ticks; then REPAIR
RECOVER = const(4)  # nine clocks, STOP, a new I2C object; then VERIFY
RING = const(5)  # wait until the sensor's low-pass has forgotten it
ADOPT = const(6)  # another known part: take its profile, REPAIR, start the estimate anew

NACK = const(1)
TIMEOUT = const(2)
FILL = guard.FILL
FROZEN = guard.FROZEN
JUMP = guard.JUMP
SATURATED = guard.SATURATED
REGISTER = const(7)
ANOTHER = const(8)
CLOCK = const(9)

# cause, how it is seen, how many in a row until the action (0: never), the action
POLICY = (
    ("good", "", 0, HOLD),
    ("nack", "the sensor does not acknowledge (EIO, ENODEV)", 8, RECOVER),
    ("timeout", "the bus does not move (ETIMEDOUT)", 1, RECOVER),
    ("fill", "temperature and gyro all equal: asleep, or a broken transfer", 1, VERIFY),
    ("frozen", "the same 14 bytes for longer than a sensor's noise allows", 25, RESET),
    ("jump", "a rate or force that leaps for one or two samples", 0, HOLD),
    ("saturated", "a rate at its full scale: the true one is larger", 1, RING),
    ("register", "a register, read twice, does not hold its setting", 1, REPAIR),
    ("another", "WHO_AM_I is that of another part", 1, ADOPT),
    ("clock", "the ticks' mean period is more than 1.5 % off: the filter follows", 0, HOLD),
)

_AGE_MAX_US = const(1000000000)  # a small int for ever
_RARELY = const(8)  # times the count of the table: how often at least the action is repeated


class Health:
    """Faults by cause, faults in a row, and the age of the last good sample.

    stale_us: age from which the estimate is stale; same_max: identical bursts in a row allowed;
    ring_us: how long the sensor's low-pass still shows a saturation that is over; look_every:
    good bursts between two looks at a register.
    gap_us: set by the burst that ends an outage to the time since the good one before it.
    """

    def __init__(self, stale_us=100000, same_max=10, ring_us=22000, look_every=25):
        self.stale_us = stale_us
        self.ring_us = ring_us
        self.counts = array("i", [0] * len(POLICY))
        self.memory = guard.memory(same_max, look_every)
        self.age_us = 0
        self.gap_us = 0
        self.in_row = 0
        self.last = 0

    def good(self, dt_us):
        """A good burst after others that were not, dt_us after the last tick."""
        self.gap_us = self.age_us + dt_us
        self.age_us = 0
        self.in_row = 0

    def bad(self, cause, dt_us):
        """A tick without a good sample, dt_us after the last tick. Returns the action.

        The same action comes again after twice, four and eight times as many faults, then
        after each eight times: a broken bus must not cost more than a good one.
        """
        self.counts[cause] += 1
        if cause != self.last:
            self.last = cause
            self.in_row = 0
        self.wait(dt_us)
        after = POLICY[cause][2]
        if after and self.in_row % after == 0:
            times = self.in_row // after
            if times % _RARELY == 0 or times in (1, 2, 4):
                return POLICY[cause][3]
        return HOLD

    def wait(self, dt_us):
        """A tick without a sample that is no new fault: repairing, or settling after it."""
        self.in_row += 1
        guard.look_next(self.memory)
        if self.age_us < _AGE_MAX_US:
            self.age_us += dt_us

    def count(self, cause):
        """Count a fault that cost no sample."""
        self.counts[cause] += 1

    def stats(self):
        """{cause: count} of the causes seen."""
        out = {}
        for code in range(1, len(POLICY)):
            if self.counts[code]:
                out[POLICY[code][0]] = self.counts[code]
        over = guard.accel_saturated(self.memory)
        if over:
            out["accel_saturated"] = over
        return out

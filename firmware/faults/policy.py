# SPDX-License-Identifier: MIT
"""What counts as a fault in flight and what is done: a table.

Whatever the fault, its sample is not used: the tick predicts with the last good rate and keeps
the age of that sample (firmware.tick). From `failsafe_ms` on the estimate is stale and outputs go
to their safe values. The tick counts; the foreground decides here and acts (firmware.faults.mend).
"""

from collections import namedtuple

from micropython import const

HOLD = const(0)  # nothing but the prediction; the next tick tries again
VERIFY = const(1)  # compare all registers with the configuration, and WHO_AM_I; else REPAIR
REPAIR = const(2)  # write the configuration again; settle
RESET = const(3)  # reset the chip first, and wait; then REPAIR
RECOVER = const(4)  # nine clocks, STOP, a new I2C object; then VERIFY
RING = const(5)  # the tick waits until the sensor's low-pass has forgotten it
ADOPT = const(6)  # another known part: take its profile, REPAIR, start the estimate anew

# causes: places in the table, and in the tick's counts
NACK = const(1)
TIMEOUT = const(2)
FILL = const(3)
FROZEN = const(4)
JUMP = const(5)
SATURATED = const(6)
REGISTER = const(7)
ANOTHER = const(8)
CLOCK = const(9)
UNVERIFIED = const(11)  # no fault: bursts come again, and the chip may have lost its settings

# after: how many in a row until the action (0: never)
Row = namedtuple("Row", ("cause", "after", "action"))

POLICY = (
    Row("good", 0, HOLD),
    Row("nack", 8, RECOVER),
    Row("timeout", 1, RECOVER),
    Row("fill", 1, VERIFY),
    Row("frozen", 25, RESET),
    Row("jump", 0, HOLD),
    Row("saturated", 0, RING),
    Row("register", 1, REPAIR),
    Row("another", 1, ADOPT),
    Row("clock", 0, HOLD),
)

_RARELY = const(8)  # times the count of the table: how often at least the action is repeated


_BLIND = const(2)  # nacks in a row, where a stuck bus is told by the same error


def action(cause, in_row, acted, blind=False):
    """What to do about `in_row` ticks in a row without a good sample, the last fault `cause`.

    acted: in_row when the action was taken last, 0: not yet. It comes again after twice, four and
    eight times as many, then after each eight times: a broken bus must not cost more than a good
    one. blind: this port has one error for all that fails on a bus.
    """
    row = POLICY[cause]
    after = _BLIND if blind and cause == NACK else row.after
    if not after or in_row < after:
        return HOLD
    if acted:
        after = min(2 * acted, acted + _RARELY * row.after)
    return row.action if in_row >= after else HOLD

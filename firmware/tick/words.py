# SPDX-License-Identifier: MIT
"""The words that the tick and the foreground share, an array of int32; each is whole by itself.

T: the tick writes, F: the foreground writes. Constants must be local to a file to cost nothing,
so each file names the places that it uses; a test holds them against this table.

place name       who  what
0     ODD        F T  1: something of the words below wants the tick's long way
1     CAUSE      T    code of the last fault, a place in firmware.faults.policy's table
2     IN_ROW     T    ticks without a good sample in a row
3     AGE_US     T    since the last good sample, at the last tick; 0: it had one
4     PREDICTED  T    ticks whose angle was predicted, all so far
5     STALE_US   F    from this age on the estimate is stale and the outputs are safe
6     UNUSED_US  F T  so long bursts are not used: settling, ringing; the tick counts down
7     RING_US    F    how long the sensor's low-pass shows a saturation that is over
8     SURE       F T  1: the chip has its settings; 0: after a fault, until verified
9     FORGET     F T  1: the next burst is no leap
10    SWAP       F T  1: the filter's pending coefficients are complete
11    ZERO_YAW   F T  1: yaw is 0 from the next sample on
12    DUE        F T  ticks until the foreground is scheduled
13    LATE_US    F    a tick later than this after the last one ends a gap
14    WAITING    F T  1: it is scheduled and has not run yet; 2: nor is the bus used before
15    FROM_US    F T  age at which the filter that bridges the gap took over
16    UNSURE_US  F T  so long the tilt is not known well enough to be claimed
17    YAW_LOST   T    1: that is more than can be claimed
18    IS_SAFE    F T  1: the outputs have their safe values
19    OUTPUTS    F    1: there is something to drive or a watchdog to feed
20    ERRORS     T    exceptions of the tick itself
21    FAILED     T    exceptions of hard outputs
22    LIMIT      F    exceptions of an output in a row until its safe value
23    BUSY       T    ticks that found the bus taken
24    PAUSE      F    1: the filter is the foreground's for the moment
25    AGAIN      T    1: a safe() failed in the tick, the foreground repeats it
26    SOFT       F T  ticks since the soft outputs ran
27    PATIENCE   F    so many, and they get their safe values
28    YAW_DOUBT  T    how far gaps may have put the yaw off, mdeg
30    COUNT      T    from here on: how often each cause was seen
"""

from array import array

import micropython
from micropython import const

_ODD = const(0)
_AGE_US = const(3)
_DUE = const(12)
_LATE_US = const(13)
_UNSURE_US = const(16)
_YAW_LOST = const(17)
_OUTPUTS = const(19)
_COUNT = const(30)
_CAUSES = const(16)
_EST_DOUBT = const(16)  # firmware.tick.estimate's


def make():
    """The words, all zero but SURE."""
    words = array("i", [0] * (_COUNT + _CAUSES))
    words[8] = 1
    return words


@micropython.viper
def begun(words: ptr32, lock: ptr32, dt_us: int, est: ptr32) -> int:
    """A tick has begun, dt_us after the last one; what there is besides a burst, a filter and an
    estimate: 1 outputs, 2 the foreground is due, 4 the long way. lock: firmware.bus's words.

    Doubt about the tilt shrinks with the time that good samples cover, not in an outage.
    """
    more = words[_YAW_LOST] << 1
    due = words[_UNSURE_US]
    if due:
        more |= 1
        if not words[_AGE_US]:
            due -= dt_us
            if due < 0:
                due = 0
            words[_UNSURE_US] = due
    est[_EST_DOUBT] = more
    more = words[_OUTPUTS]
    due = words[_DUE] - 1
    words[_DUE] = due
    if due <= 0:
        more |= 2
    if words[_ODD] or lock[0] or dt_us > words[_LATE_US]:
        more |= 4
    return more

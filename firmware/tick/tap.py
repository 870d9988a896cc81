# SPDX-License-Identifier: MIT
"""Samples put by in the tick, so that a foreground that lags loses none: a ring of records.

A tap stands behind the hard outputs while firmware.stream wants samples, and is not there
otherwise. A record is one or more parts of 28 bytes, each a frame's content:

    0 kind: 16 + 4 (start & 3) + part   1 flags   2-3 number of the sample, modulo 2^16
    4-27 of part 0: ticks_us of the tick, the burst's 7 counts, 3 angles in 8 mdeg
    4-27 of each other: 12 channels: 32-bit numbers shifted right and held to 16 bits

Flags: 1 predicted, 2 at rest, 4 tilt and 8 yaw uncertain.

The ring is one array of int32, whose first words tell what is in it; records follow from 26 on
(T: the tick writes, F: the foreground):

0     HEAD       T    records written, modulo 2^30; the ring's size is a power of two
1     TAIL       F    records read; while waiting for a trigger T
2     SIZE       F    how many records there are
3     LOST       T    samples for which there was no room
4     EVERY      F    every so many ticks are one sample
5     LEFT       T    ticks until the next
6     SEQ        T    the next sample's number
7     CHANNELS   F    beside those of part 0
8     LENGTH     F    bytes of a record
9     MODE       F T  0 all samples; 1 waits for the trigger; 2 triggered; 3 complete, F sends it
10    WATCH      F    place in the record, in 16 bits, of the channel that triggers
11    LEVEL      F    its value
12    RISING     F    1: from below to it, 0: from above
13    BEFORE     F    at least so many samples come before the trigger
14    AFTER      F    and so many after it
15    COUNT      T    samples still to come
16    LAST       T    the channel's value a sample ago
17    AT         T    number of the sample that triggered
18    FILL       F    frames in the pair that is being made
19    PART       F    of the record that is being sent, its first byte
20    ERRORS     T    exceptions of what reads controllers
21    KIND       F    of part 0
22    BATCH      F    samples from one call of the foreground to the next
23    WAIT       F T  samples until then
24    ASKED      F T  1: it is called and has not run yet
"""

from array import array

import micropython
from micropython import const

_HEAD = const(0)
_TAIL = const(1)
_SIZE = const(2)
_LOST = const(3)
_EVERY = const(4)
_LEFT = const(5)
_SEQ = const(6)
_CHANNELS = const(7)
_LENGTH = const(8)
_MODE = const(9)
_WATCH = const(10)
_LEVEL = const(11)
_RISING = const(12)
_BEFORE = const(13)
_AFTER = const(14)
_COUNT = const(15)
_LAST = const(16)
_AT = const(17)
_ERRORS = const(20)
_KIND = const(21)
_BATCH = const(22)
_WAIT = const(23)
_ASKED = const(24)
_RECORDS = const(26)

# places: firmware.tick.estimate, firmware.tick.timing
_T_US = const(1)
_AT_REST = const(11)
_UNCERTAIN = const(12)
_AGE_US = const(14)
_GRID = const(1)
_PERIOD = const(2)
_DEADLINE = const(3)

# where a channel comes from
_EST = const(0)
_TIMING = const(1)
_MORE = const(2)  # read from controllers; else how late the tick was


def ring(size, length):
    """One for `size` records of `length` bytes each. MemoryError."""
    return clear(array("i", range(_RECORDS + size * length // 4)), size, length)  # in one piece


def clear(made, size, length):
    """The same ring, empty."""
    for i in range(_RECORDS):
        made[i] = 0
    made[_SIZE] = size
    made[_LENGTH] = length
    return made


def over(drive, run, ring, est, burst, timing, program, reads, more):
    """`drive` (None: nothing) and then the tap, as the tick's drive.

    run(_): called softly every few samples; est, burst, timing: the tick's arrays; program:
    source, place, shift of each channel beside those of part 0; reads: functions fit for the
    tick, each of which gives a small integer for `more`.
    """

    @micropython.native
    def call(run=run, ring=ring, schedule=micropython.schedule):
        try:
            schedule(run, 0)
            ring[_ASKED] = 1
        except RuntimeError:  # the queue is full: the next time
            pass

    @micropython.viper
    def take(_fresh) -> int:
        """One tick's sample. Its place, in 16 bits, when take_more() is to complete it; 0."""
        words = ptr32(ring)
        left = words[_LEFT] - 1
        words[_LEFT] = left
        if left > 0:
            return 0
        words[_LEFT] = words[_EVERY]
        wait = words[_WAIT] - 1
        words[_WAIT] = wait
        if wait <= 0:
            words[_WAIT] = words[_BATCH]
            if not words[_ASKED]:
                call()
        mode = words[_MODE]
        if mode == 3:
            return 0
        seq = words[_SEQ]
        words[_SEQ] = (seq + 1) & 0xFFFF
        head = words[_HEAD]
        if ((head - words[_TAIL]) & 0x3FFFFFFF) >= words[_SIZE]:
            if mode == 0:
                words[_LOST] += 1
                return 0
            words[_TAIL] = (words[_TAIL] + 1) & 0x3FFFFFFF
        at = 2 * _RECORDS + (head & (words[_SIZE] - 1)) * (words[_LENGTH] >> 1)
        estimate = ptr32(est)
        counts = ptr16(burst)
        out = ptr16(ring)
        flags = words[_KIND] | estimate[_UNCERTAIN] << 10
        if estimate[_AGE_US]:
            flags |= 256
        if estimate[_AT_REST]:
            flags |= 512
        out[at + 0] = flags
        out[at + 1] = seq
        out[at + 2] = estimate[_T_US] & 0xFFFF
        out[at + 3] = estimate[_T_US] >> 16 & 0xFFFF
        out[at + 4] = counts[0]
        out[at + 5] = counts[1]
        out[at + 6] = counts[2]
        out[at + 7] = counts[3]
        out[at + 8] = counts[4]
        out[at + 9] = counts[5]
        out[at + 10] = counts[6]
        out[at + 11] = estimate[2] >> 3 & 0xFFFF
        out[at + 12] = estimate[3] >> 3 & 0xFFFF
        out[at + 13] = estimate[4] >> 3 & 0xFFFF
        if words[_CHANNELS]:
            return at
        words[_HEAD] = (head + 1) & 0x3FFFFFFF
        if mode:
            trigger(ring, at)
        return 0

    if not drive and not program:
        return take

    @micropython.native
    def beside(fresh, drive=drive, take=take, take_more=take_more, ring=ring, est=est,
               timing=timing, program=program, reads=reads, more=more):  # fmt: skip
        if drive:
            drive(fresh)
        at = take(fresh)
        if at:
            i = 0
            for read in reads:
                try:
                    more[i] = read()
                except BaseException:
                    ring[_ERRORS] += 1
                i += 1
            take_more(ring, est, timing, program, more, at)

    return beside


@micropython.viper
def take_more(ring: ptr32, est: ptr32, timing: ptr32, program: ptr8, more: ptr32, at: int):
    """The other parts of the record whose first part stands at `at`, which is then complete."""
    out = ptr16(ring)
    flags = int(out[at + 0])
    first = at
    n = ring[_CHANNELS]
    to = 0
    i = 0
    p = 0
    while i < n:
        if i % 12 == 0:
            at += 14
            flags += 1
            out[at + 0] = flags
            out[at + 1] = out[first + 1]
            to = at + 2
        source = int(program[p + 0])
        place = int(program[p + 1])
        if source == _EST:
            value = est[place + 0]
        elif source == _TIMING:
            value = timing[place + 0]
        elif source == _MORE:
            value = more[place + 0]
        else:
            value = 0
            if timing[_GRID]:
                value = est[_T_US] + timing[_PERIOD] - timing[_DEADLINE]
                value = ((value + 0x20000000) & 0x3FFFFFFF) - 0x20000000
        value = value >> int(program[p + 2])
        if value > 32767:
            value = 32767
        elif value < -32768:
            value = -32768
        out[to + 0] = value & 0xFFFF
        to += 1
        p += 3
        i += 1
    ring[_HEAD] = (ring[_HEAD] + 1) & 0x3FFFFFFF
    if ring[_MODE]:
        trigger(ring, first)


@micropython.viper
def trigger(ring: ptr32, at: int):
    """Whether the record at `at`, the newest, is the event, or the last one after it."""
    if ring[_MODE] == 2:
        count = ring[_COUNT] - 1
        ring[_COUNT] = count
        if count <= 0:
            ring[_MODE] = 3
        return
    out = ptr16(ring)
    value = (int(out[at + ring[_WATCH]]) ^ 0x8000) - 0x8000
    level = ring[_LEVEL]
    last = ring[_LAST]
    ring[_LAST] = value
    if not ring[_RISING]:
        level = 0 - level
        last = 0 - last
        value = 0 - value
    if last < level and value >= level:
        if ((ring[_HEAD] - ring[_TAIL]) & 0x3FFFFFFF) > ring[_BEFORE]:
            ring[_AT] = int(out[at + 1])
            ring[_COUNT] = ring[_AFTER]
            ring[_MODE] = 2

# SPDX-License-Identifier: MIT
"""Samples put by in the tick, so that a foreground that lags loses none: a ring of records.

A tap stands behind the hard outputs while firmware.stream wants samples, and is not there
otherwise. A record is one or more parts of 28 bytes, each a frame's content:

    0 kind: 16 + 4 format + part   1 flags   2-3 number of the sample, modulo 2^16
    4-27 12 words of 16 bits

The first two words of part 0 are the tick's ticks_us; the rest are channels, each a 32-bit number
shifted right and held to 16 bits. Flags: 1 predicted, 2 at rest, 4 tilt and 8 yaw uncertain.

The ring's words, an array of int32 (T: the tick writes, F: the foreground):

0     HEAD       T    records written, modulo 2^30; the ring's size is a power of two
1     TAIL       F    records read; while waiting for a trigger T
2     SIZE       F    how many records the ring holds
3     LOST       T    samples for which there was no room
4     EVERY      F    every so many ticks are one sample
5     LEFT       T    ticks until the next
6     SEQ        T    the next sample's number
7     CHANNELS   F
8     LENGTH     F    bytes of a record
9     MODE       F T  0 all samples; 1 waits for the trigger; 2 triggered; 3 complete, F sends it
10    WATCH      F    the channel that triggers
11    LEVEL      F    its value
12    RISING     F    1: from below to it, 0: from above
13    BEFORE     F    at least so many samples come before the trigger
14    AFTER      F    and so many after it
15    COUNT      T    samples still to come
16    LAST       T    the channel's value a sample ago
17    AT         T    number of the sample that triggered
18    FILL       F    frames in the pair that is being made
19    PART       F    of the record that is being sent
20    ERRORS     T    exceptions of what reads controllers
21    KIND       F    of part 0
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
_WORDS = const(22)

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
_BURST = const(1)
_TIMING = const(2)
_MORE = const(3)  # read from controllers; else how late the tick was


def words():
    """A ring's words, all zero."""
    return array("i", [0] * _WORDS)


def over(drive, ring, sources, reads):
    """`drive` (None: nothing) and then the tap, as the tick's drive.

    ring: (words, buffer, program); sources: (estimate, burst, timing, more); reads: functions
    fit for the tick, each of which gives a small integer for `more`.
    """
    control, buffer, program = ring
    est, burst, timing, more = sources

    @micropython.native
    def tapped(fresh, drive=drive, reads=reads, more=more, control=control, buffer=buffer,
               program=program, est=est, burst=burst, timing=timing, take=take):  # fmt: skip
        if drive:
            drive(fresh)
        if reads:
            i = 0
            for read in reads:
                try:
                    more[i] = read()
                except BaseException:
                    control[_ERRORS] += 1
                i += 1
        take(control, buffer, program, est, burst, timing, more)

    return tapped


@micropython.viper
def take(
    control: ptr32,
    ring: ptr8,
    program: ptr8,
    est: ptr32,
    burst: ptr16,
    timing: ptr32,
    more: ptr32,
):
    """One tick's sample into the ring. program: source, place, shift of each channel."""
    left = control[_LEFT] - 1
    if left > 0:
        control[_LEFT] = left
        return
    control[_LEFT] = control[_EVERY]
    mode = control[_MODE]
    if mode == 3:
        return
    seq = control[_SEQ]
    control[_SEQ] = (seq + 1) & 0xFFFF
    head = control[_HEAD]
    if ((head - control[_TAIL]) & 0x3FFFFFFF) >= control[_SIZE]:
        if mode == 0:
            control[_LOST] += 1
            return
        control[_TAIL] = (control[_TAIL] + 1) & 0x3FFFFFFF
    now = est[_T_US]
    late = 0
    if timing[_GRID]:
        late = ((now + timing[_PERIOD] - timing[_DEADLINE] + 0x20000000) & 0x3FFFFFFF) - 0x20000000
    flags = (1 if est[_AGE_US] else 0) | (est[_UNCERTAIN] << 2)
    if est[_AT_REST]:
        flags |= 2
    at = (head & (control[_SIZE] - 1)) * control[_LENGTH]
    end = at + control[_LENGTH]
    watch = control[_WATCH]
    watched = 0
    n = control[_CHANNELS]
    first = control[_KIND]
    kind = first
    i = 0
    while at < end:
        ring[at] = kind
        ring[at + 1] = flags
        ring[at + 2] = seq & 0xFF
        ring[at + 3] = seq >> 8
        stop = at + 28
        at += 4
        if kind == first:
            ring[at] = now & 0xFF
            ring[at + 1] = now >> 8 & 0xFF
            ring[at + 2] = now >> 16 & 0xFF
            ring[at + 3] = now >> 24 & 0xFF
            at += 4
        while at < stop:
            value = 0
            if i < n:
                p = 3 * i
                place = int(program[p + 1])
                source = int(program[p])
                if source == _EST:
                    value = est[place + 0]
                elif source == _BURST:
                    value = (int(burst[place + 0]) ^ 0x8000) - 0x8000
                elif source == _TIMING:
                    value = timing[place + 0]
                elif source == _MORE:
                    value = more[place + 0]
                else:
                    value = late
                value = value >> int(program[p + 2])
                if value > 32767:
                    value = 32767
                elif value < -32768:
                    value = -32768
                if i == watch:
                    watched = value
                i += 1
            ring[at] = value & 0xFF
            ring[at + 1] = value >> 8 & 0xFF
            at += 2
        kind += 1
    control[_HEAD] = (head + 1) & 0x3FFFFFFF
    if mode == 1:
        level = control[_LEVEL]
        last = control[_LAST]
        control[_LAST] = watched
        if ((head - control[_TAIL]) & 0x3FFFFFFF) >= control[_BEFORE]:
            if control[_RISING]:
                hit = last < level and watched >= level
            else:
                hit = last > level and watched <= level
            if hit:
                control[_AT] = seq
                control[_COUNT] = control[_AFTER]
                control[_MODE] = 2
    elif mode == 2:
        count = control[_COUNT] - 1
        control[_COUNT] = count
        if count <= 0:
            control[_MODE] = 3

# SPDX-License-Identifier: MIT
"""Judges each burst before a filter sees it, and knows the last good ones; no allocation.

Most bursts take the short way, a few microseconds; the long way is for those that look odd.
"""

from array import array

import micropython
from micropython import const

# what judge() returns besides 0 for a good burst: places in firmware.faults.policy's table
FILL = const(3)
FROZEN = const(4)
JUMP = const(5)
SATURATED = const(6)

# the memory, 16-bit words: the last good burst is at 0
_REJECTED = const(8)  # the burst that was taken for a leap
_SAME = const(16)  # how often the same burst came
_JUMPS = const(17)  # rejected as a leap in a row
_PRIMED = const(18)  # there is a last good burst to compare with
_CALM = const(19)  # primed, and the last burst was neither the same nor a leap
_ACCEL_OVER = const(20)  # bursts with a saturated accelerometer, which are good
_SAME_MAX = const(21)  # identical bursts in a row that are still good
_GYRO_MOST = const(22)  # a larger step of the gyro is a leap, counts
_WORDS = const(23)

# Largest step of one sample, counts. Gyro: an eighth of full scale, what a flipped bit 12 makes,
# or what a push makes where the range is small and the samples are far apart (leap());
# accelerometer: half of full scale, since vibration is not a fault.
_GYRO_LEAP = const(4096)
_GYRO_LEAP_MAX = const(15000)
_PUSH_DPS2 = const(12000)  # of a robot of some kilograms
_ACCEL_LEAP = const(16384)
_FILL_LEAP = const(64)  # of the gyro to words that are all the same
_NEAR = const(26000)  # of 32768: a leap to there is the edge of a saturation
_AGREES = const(2)  # rejections after which a leap is believed


def memory():
    """What judge() has to remember between two calls; allow() says how often a burst may repeat.

    The last good burst is its first seven words.
    """
    words = array("H", [0] * _WORDS)
    words[_GYRO_MOST] = _GYRO_LEAP
    return words


def allow(words, same_max, gyro_dps=2000, rate_hz=1000):
    """So many identical bursts in a row are still good, and so large a step of the gyro is one
    that a push makes with this range at this rate."""
    words[_SAME_MAX] = same_max
    push = int(_PUSH_DPS2 / rate_hz * 32768 / gyro_dps)
    words[_GYRO_MOST] = max(_GYRO_LEAP, min(_GYRO_LEAP_MAX, push))


@micropython.viper
def forget(words: ptr16):
    """The next burst is no leap, whatever came before: after an outage."""
    words[_PRIMED] = 0
    words[_CALM] = 0


@micropython.viper
def saturated(counts: ptr16) -> int:
    """1 when a rate is near its full scale; the low-pass rounds the edges of a saturation."""
    value = 0
    most = _NEAR
    i = 4  # the fourth local: an older one is in a register, where 1.26 would change it
    while i < 7:
        value = (int(counts[i]) ^ 0x8000) - 0x8000
        if value >= most or value <= 0 - most:
            return 1
        i += 1
    return 0


def accel_saturated(words):
    """How many good bursts had an accelerometer at its full scale (up to 65535)."""
    return words[_ACCEL_OVER]


@micropython.viper
def judge(counts, words) -> int:
    """0 for a good burst, which is remembered; else the fault's code, and counts are put back to
    the last good burst.
    """
    c = ptr16(counts)
    m = ptr16(words)
    # steps of 16 bits; in range, none of the high bits is set after adding the limit
    x = c[4]
    y = c[5]
    z = c[6]
    t = x - m[4]
    fresh = t
    leap = t + _GYRO_LEAP
    t = y - m[5]
    fresh |= t
    leap |= t + _GYRO_LEAP
    t = z - m[6]
    fresh |= t
    leap |= t + _GYRO_LEAP
    # the two highest bits differ beyond half of full scale
    large = (x ^ x << 1 | y ^ y << 1 | z ^ z << 1) & 0x8000 | leap & 0xE000
    if x == y and y == z:
        large = 1
    x = c[0]
    y = c[1]
    z = c[2]
    leap = x - m[0] + _ACCEL_LEAP | y - m[1] + _ACCEL_LEAP | z - m[2] + _ACCEL_LEAP
    large |= (x ^ x << 1 | y ^ y << 1 | z ^ z << 1 | leap) & 0x8000
    if large or fresh == 0 or m[_CALM] == 0:
        return int(_doubt(counts, words))
    p = ptr32(c)  # of a pointer it is free, of an object a call
    q = ptr32(m)
    q[0] = p[0]
    q[1] = p[1]
    q[2] = p[2]
    m[6] = c[6]
    return 0


@micropython.viper
def _doubt(counts, words) -> int:
    """The long way of judge().

    A leap is believed when the next burst agrees with it, or after two rejections.
    """
    c = ptr16(counts)
    m = ptr16(words)
    fault = 0
    changed = 0
    leap = 0
    agrees = 1
    over = 0
    i = 0
    while i < 7:
        raw = c[i]
        if raw != m[i]:
            changed = 1
        if i != 3:  # the temperature steers nothing
            if (raw + 0x8200 & 0xFFFF) < 0x400:  # within 1.6 % of full scale
                if i > 3:
                    fault = SATURATED
                over = 1
            limit = int(m[_GYRO_MOST]) if i > 3 else _ACCEL_LEAP
            value = (raw ^ 0x8000) - 0x8000
            step = value - ((m[i] ^ 0x8000) - 0x8000)
            if step > limit or step < 0 - limit:
                leap = 1
                if i > 3 and m[_PRIMED] and (value > _NEAR or value < 0 - _NEAR):
                    fault = SATURATED
            step = value - ((m[_REJECTED + i] ^ 0x8000) - 0x8000)
            if step > limit or step < 0 - limit:
                agrees = 0
        i += 1
    # a broken transfer, a sleeping chip: the tail is filled with one byte. A clone whose
    # temperature register is at the gyro's zero reads such words too, but then it is no leap
    if c[6] == c[5] and c[5] == c[4] and c[4] == c[3]:
        far = 0
        i = 4
        while i < 7:
            step = ((c[i] ^ 0x8000) - 0x8000) - ((m[i] ^ 0x8000) - 0x8000)
            if step > _FILL_LEAP or step < 0 - _FILL_LEAP:
                far = m[_PRIMED]
            i += 1
        if far or c[3] == 0xFEFE or (c[3] == c[2] and c[2] == c[1] and c[1] == c[0]):
            fault = FILL
    if fault == 0:
        if over and m[_ACCEL_OVER] < 65535:
            m[_ACCEL_OVER] += 1
        if m[_PRIMED]:
            jumps = m[_JUMPS]
            if changed:
                m[_SAME] = 0
            elif m[_SAME] < m[_SAME_MAX]:
                m[_SAME] += 1
            else:
                fault = FROZEN
            if leap and fault == 0 and jumps < _AGREES and (jumps == 0 or agrees == 0):
                fault = JUMP
                m[_JUMPS] = jumps + 1
    i = 0
    while i < 7:
        if fault:
            m[_REJECTED + i] = c[i]
            c[i] = m[i]
        else:
            m[i] = c[i]
        i += 1
    m[_CALM] = 0
    if fault:
        return fault
    m[_JUMPS] = 0
    if changed or m[_PRIMED] == 0:
        m[_SAME] = 0
        m[_CALM] = 1
    m[_PRIMED] = 1
    return 0

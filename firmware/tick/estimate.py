# SPDX-License-Identifier: MIT
"""The estimate that the tick publishes and everybody reads: whole, or not at all.

One array of int32, written by the tick; firmware.first begins it, and firmware.wiring adds a doubt
to it. Its first word is odd while a tick writes and greater by two after each, so a reader who
finds the same even number before and after has one instant. Angles in millidegrees, rates in
millidegrees per second, calibrated and in the robot's frame; accelerometer in counts of its range,
calibrated and in the robot's frame too.
"""

from array import array

import micropython
from micropython import const

# places; 2 to 11 are the filter's `out`, in its order
_SEQ = const(0)
_T_US = const(1)  # ticks_us of the tick
_YAW = const(4)
_OUT = const(2)  # roll, pitch, yaw; rates x, y, z; accelerometer x, y, z; at rest
_OUTS = const(10)
_UNCERTAIN = const(12)  # 1 the tilt, 2 the yaw
_TEMP = const(13)  # the sensor's raw temperature
_AGE_US = const(14)  # since the last good sample, at the tick; 0: this tick's
_TURNS = const(15)  # of the yaw, whole ones
_WORDS = const(16)
_DOUBT = const(16)  # the tick's own: what UNCERTAIN becomes with the next good sample
_HALF = const(180000)


def words():
    """A new estimate, all zero."""
    return array("i", [0] * (_WORDS + 1))


@micropython.viper
def publish(est: ptr32, out: ptr32, memory: ptr16, now: int):
    """A tick at `now` with a good sample: the filter's `out`, and the temperature of the last
    good burst in firmware.tick.judge's memory. What it is not sure of, words.begun() has said."""
    seq = est[_SEQ] + 1
    est[_SEQ] = seq
    est[_T_US] = now
    now = out[2]
    turned = now - est[_YAW]
    if turned > _HALF:
        est[_TURNS] -= 1
    elif turned < 0 - _HALF:
        est[_TURNS] += 1
    est[2] = out[0]
    est[3] = out[1]
    est[4] = now
    est[5] = out[3]
    est[6] = out[4]
    est[7] = out[5]
    est[8] = out[6]
    est[9] = out[7]
    est[10] = out[8]
    est[11] = out[9]
    est[_UNCERTAIN] = est[_DOUBT]
    est[_TEMP] = (int(memory[3]) ^ 0x8000) - 0x8000
    est[_AGE_US] = 0
    est[_SEQ] = seq + 1


@micropython.viper
def publish_predicted(est: ptr32, out: ptr32, age_us: int, now: int):
    """The same for a tick without one, age_us after the last good sample."""
    est[_SEQ] += 1
    est[_T_US] = now
    i = out[2] - est[_YAW]
    if i > _HALF:
        est[_TURNS] -= 1
    elif i < 0 - _HALF:
        est[_TURNS] += 1
    i = 0
    while i < _OUTS:
        est[_OUT + i] = out[i]
        i += 1
    est[_AGE_US] = age_us
    est[_SEQ] += 1


@micropython.viper
def read(est: ptr32, copy: ptr32) -> int:
    """Copy the estimate, one instant; 0 where a tick came in between, and the copy is mixed."""
    before = est[_SEQ]
    i = 0
    while i < _WORDS:
        copy[i] = est[i]
        i += 1
    if before & 1 or est[_SEQ] != before:
        return 0
    return 1

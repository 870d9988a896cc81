# SPDX-License-Identifier: MIT
"""The first sample of a loop, and what is known from it before the first tick; loaded for that,
and forgotten.
"""

import time
from array import array
from errno import ENODEV

from calibration.watch import near
from micropython import const

from firmware import wiring
from firmware.tick import estimate, judge

_DATA_MS = const(200)  # and four of the sensor's periods: until its data have to have changed
_MOVED_G = const(0.02)  # a degree, and more than one sample's noise
_LEVEL_US = const(1500000)  # after a levelling by one sample, which may have been pushed
_NO = (0.0, 0.0, 0.0)

# places: firmware.tick.words, firmware.tick.estimate
_ODD = const(0)
_SURE = const(8)
_UNSURE_US = const(16)
_UNCERTAIN = const(12)
# those that begin anew with a start, besides the counts
_FRESH = (1, 2, 3, 4, 6, 9, 10, 11, 15, 16, 17, 18, 20, 21, 23, 24, 25, 26, 28)
_COUNT = const(30)


def first(imu):
    """A good sample of now is in the driver's counts: of each word the middle one of three, so
    that one broken transfer is not what everything begins with. They differ from one before them:
    what comes again and again is of some time ago, and looks like rest. OSError."""
    failure = old = None
    bursts = []
    began = time.ticks_ms()
    patience_ms = _DATA_MS + 4000 // imu.rate_hz
    while time.ticks_diff(time.ticks_ms(), began) < patience_ms:
        try:
            imu.read()
            if imu.plausible():
                burst = array("h", imu.counts)
                if old is None:
                    old, failure = burst, None
                elif burst != old:
                    bursts.append(burst)
                    if len(bursts) < 3:
                        continue
                    for i in range(7):
                        imu.counts[i] = sorted([burst[i] for burst in bursts])[1]
                    return
        except OSError as error:
            failure = error
        time.sleep_us(500)
    sends = "nothing but %s, again and again" if old else "no data but %s"
    raise failure or OSError(ENODEV, "the sensor sends " + sends % list(imu.counts))


def begin(app, still):
    """One sample, levelled, so that the angles are true before the first tick. still: the Rest
    that has been, whose means are better than one sample, or None.
    """
    words, tick, imu = app.tick.words, app.tick, app.imu
    for place in _FRESH:
        words[place] = 0
    for place in range(_COUNT, len(words)):
        words[place] = 0
    words[_SURE] = words[_ODD] = 1
    for place in range(len(tick.est)):
        tick.est[place] = 0
    first(imu)
    now = time.ticks_us()
    tick.timing.follow(now)
    accel_g = imu.accel_g()
    if still and not (
        near(accel_g, still.accel_g, _MOVED_G)
        and near(imu.gyro_dps(), still.gyro_dps, app.config.still_dps)
    ):
        still = None  # it has moved since
    if app.learning.known:
        accel_g = still.accel_g if still else accel_g
        wiring.begin_at(app.filter, app.calibration.apply(accel_g, _NO)[0])
        if not still:
            app.filter.relevel()
            words[_UNSURE_US] = _LEVEL_US
    app.filter.update(imu.counts)
    burst = array("H", [count & 0xFFFF for count in imu.counts])
    judge.forget(tick.memory)
    for place in range(7):  # a pause ahead of the first tick is bridged from here
        tick.memory[place] = burst[place]
    judge.judge(burst, tick.memory)  # and what is a leap from here is one
    estimate.publish(tick.est, app.filter.out, burst, now)
    app.learning.begin()
    tick.est[_UNCERTAIN] = 1 if words[_UNSURE_US] else 0

# SPDX-License-Identifier: MIT
"""A sensor that lies still: its mean readings, and from them the gyro's bias.

It takes a second or two and waits in between, so it belongs at the start, not in a running loop.
"""

import time
from collections import namedtuple
from math import sqrt

from calibration import Calibration

# Means over the time of rest: g, deg/s, degC
Rest = namedtuple("Rest", ("accel_g", "gyro_dps", "temp_c"))

_GYRO_LIMIT_DPS = 0.5  # deviation; the sensor's own noise is 0.1 at the widest filter
_ACCEL_LIMIT_G = 0.02  # deviation; own noise 0.008 at the widest filter
_DRIFT_LIMIT_G = 0.01  # of the mean from the first half to the second: a slow turn
_BIAS_LIMIT_DPS = 40  # PS p. 12: +-20 at once and +-20 over temperature


class NotStill(ValueError):
    """The sensor moved while it should rest; the text says how."""


def rest(imu, seconds=1.0, gyro_limit_dps=_GYRO_LIMIT_DPS):
    """Mean readings (a Rest) of a sensor that lies still. NotStill says why not. OSError.

    gyro_limit_dps: the largest standard deviation of a rate that is still rest.
    """
    half_ms = int(500 * seconds)
    count, first, first_squares, temp_c = _sums(imu, half_ms)
    more, second, second_squares, more_c = _sums(imu, half_ms)
    n = count + more
    scale = [imu.accel_lsb_per_g] * 3 + [imu.gyro_lsb_per_dps] * 3
    mean, spread, drift = [], [], []
    for i in range(6):
        total = first[i] + second[i]
        mean.append(total / n / scale[i])
        # integers up to here, so that single precision does not eat the small difference
        variance = n * (first_squares[i] + second_squares[i]) - total * total
        spread.append(sqrt(max(0, variance)) / n / scale[i])
        drift.append((second[i] / more - first[i] / count) / scale[i])
    _judge(mean, spread, drift, gyro_limit_dps)
    return Rest(tuple(mean[:3]), tuple(mean[3:]), (temp_c + more_c) / n)


def gyro_bias(imu, cal=None, seconds=2.0):
    """`cal` (or a new Calibration) with the gyro bias of a sensor that lies still. NotStill."""
    still = rest(imu, seconds)
    cal = (cal or Calibration(who_am_i=imu.who_am_i)).at(still.temp_c)
    return cal.but(gyro_bias_dps=still.gyro_dps)


def _sums(imu, ms):
    """Of the samples of so many milliseconds, ten at least: their count, sums and sums of squares
    of the six axes' counts, sum of the degrees. One in five may fail."""
    pause_us = max(500, min(20000, round(500000 / imu.rate_hz)))
    sums, squares, temp_c = [0] * 6, [0] * 6, 0.0
    n = failed = 0
    began = time.ticks_ms()
    while n < 10 or time.ticks_diff(time.ticks_ms(), began) < ms:
        time.sleep_us(pause_us)
        failure = None
        try:
            imu.read()
            if not imu.plausible():
                failure = NotStill("no data: the sensor sends %s" % list(imu.counts))
        except OSError as error:
            failure = error
        if failure:
            failed += 1
            if failed > 5 + n // 4:
                raise failure
            continue
        for i in range(6):
            value = imu.counts[i if i < 3 else i + 1]
            sums[i] += value
            squares[i] += value * value
        temp_c += imu.temp_c()
        n += 1
    return n, sums, squares, temp_c


def _judge(mean, spread, drift, gyro_limit_dps):
    for i in range(3):
        axis = "xyz"[i]
        for size, limit, unit, what in (
            (spread[3 + i], gyro_limit_dps, "deg/s", "gyro %s shook by" % axis),
            (spread[i], _ACCEL_LIMIT_G, "g", "accelerometer %s shook by" % axis),
            (abs(drift[3 + i]), gyro_limit_dps, "deg/s", "gyro %s drifted by" % axis),
            (abs(drift[i]), _DRIFT_LIMIT_G, "g", "accelerometer %s drifted by" % axis),
            (abs(mean[3 + i]), _BIAS_LIMIT_DPS, "deg/s", "gyro %s turns at" % axis),
        ):
            if size > limit:
                raise NotStill("moved: %s %.3g %s (limit %g)" % (what, size, unit, limit))
    length = sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2)
    if not 0.8 < length < 1.2:
        raise NotStill("moved, or broken: it feels %.3g g instead of 1 g" % length)

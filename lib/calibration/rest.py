# SPDX-License-Identifier: MIT
"""A sensor that lies still: its mean readings, and from them the gyro's bias.

Both sensors have to say so: a turn that is steady looks like a bias to the gyro, but about any
axis that is not vertical it moves gravity. It takes a second or two and waits in between, so it
belongs at the start, not in a running loop.
"""

import time
from math import degrees, sqrt

from micropython import const

from calibration import Calibration
from calibration.watch import BIAS_LIMIT_DPS, Rest, near

_GYRO_LIMIT_DPS = const(0.5)  # deviation; the sensor's own noise is 0.1 at the widest filter
_ACCEL_LIMIT_G = const(0.02)  # deviation; own noise 0.008 at the widest filter
_ODD = const(12)  # deviations: a sample so far off is no noise
_PARTS = const(3)  # of a rest, at least: the last against the first shows a tilt best
_SIGMAS = const(4)  # of the accelerometer's means: so much between them is a tilt
_LIKELY = const(2.5)  # of them: more is hardly hidden in the noise
_TILT_G = const(0.002)  # and less is none
_LONG_S = const(0.5)  # a rest that is long enough for any rate
_SLOW_DPS = const(2.5)  # taken for a bias, it tilts by less than three degrees


class NotStill(ValueError):
    """The sensor moved while it should rest; the text says how."""


def rest(imu, seconds=1.0, gyro_limit_dps=_GYRO_LIMIT_DPS, bias_dps=None):
    """Mean readings (a Rest) of a sensor that lies still. NotStill says why not. OSError.

    seconds: at least; a slow sensor takes as many samples as its noise asks for, and where the
    rates are not near bias_dps, the bias as known, it takes until a slow turn would have tilted
    gravity so far that it is seen: half a second at most.
    gyro_limit_dps: the largest standard deviation of a rate that is still rest.
    """
    needed = 8 + imu.dlpf_hz // 8  # samples of their own until a mean rate is good to 0.03 deg/s
    # and in each part the low-pass lets more than one pass, else it hides the noise of its mean
    part_s = max(seconds, needed / imu.rate_hz, 1.5 / imu.dlpf_hz) / _PARTS
    parts = [_Part(imu, gyro_limit_dps, part_s)]
    while True:
        parts.append(_Part(imu, gyro_limit_dps, part_s, parts[-1]))
        if len(parts) < _PARTS:
            continue
        still, tilted_g = _weigh(imu, parts, part_s, gyro_limit_dps)
        most_dps = degrees(tilted_g) / ((len(parts) - 1) * part_s)  # from the first to the last
        if most_dps < _SLOW_DPS or len(parts) * part_s >= _LONG_S:
            return still
        if bias_dps and near(still.gyro_dps, bias_dps, _SLOW_DPS):
            return still


def _weigh(imu, rows, seconds, gyro_limit_dps):
    """(a Rest of all these parts, of so many seconds each, and the most that it may have tilted in
    them, g). NotStill."""
    count = sum([part.count for part in rows])
    scale = [imu.accel_lsb_per_g] * 3 + [imu.gyro_lsb_per_dps] * 3
    mean, spread, drift = [], [], []
    for i in range(6):
        mean.append(sum([part.count * part.mean(i) for part in rows]) / count / scale[i])
        variance = sum([part.variance(i) for part in rows]) / len(rows)
        spread.append(sqrt(variance) / scale[i])
        drift.append((rows[-1].mean(i) - rows[0].mean(i)) / scale[i])
    # samples of their own in each part, which make the noise of its mean
    own = min(rows[0].count, max(2.0, seconds * min(imu.rate_hz, 3 * imu.dlpf_hz)))
    noise = [sqrt(2 / own) * axis for axis in spread[:3]]
    # with few of them the spread is not known well either
    tilts = [max(_TILT_G, _SIGMAS * (1 + 3 / own) * axis) for axis in noise]
    _judge(mean, spread, drift, tilts, gyro_limit_dps)
    tilted_g = max([abs(g) for g in drift[:3]]) + _LIKELY * (1 + 1 / own) * max(noise)
    temp_c = sum([part.count * part.temp_c for part in rows]) / count
    return Rest(tuple(mean[:3]), tuple(mean[3:]), temp_c), tilted_g


def gyro_bias(imu, cal=None, seconds=2.0):
    """`cal` (or a new Calibration) with the gyro bias of a sensor that lies still. NotStill."""
    still = rest(imu, seconds)
    cal = (cal or Calibration(who_am_i=imu.who_am_i)).at(still.temp_c)
    return cal.but(gyro_bias_dps=still.gyro_dps)


class _Part:
    """Samples of a part of a rest: counts about a centre, so that the sums stay small integers.
    One in five may be lost or garbled."""

    def __init__(self, imu, gyro_limit_dps, seconds, before=None):
        self._imu = imu
        self.count = self._failed = 0
        self._sums, self._squares, self._temps = [0] * 6, [0] * 6, 0.0
        # what was read last, and since when: data that stand still are of some time ago, and look
        # like rest
        self._last, self._looked = before.seen if before else ([], time.ticks_ms())
        accel = int(_ODD * _ACCEL_LIMIT_G * imu.accel_lsb_per_g)
        gyro = int(_ODD * gyro_limit_dps * imu.gyro_lsb_per_dps)
        began, span_us = time.ticks_us(), 1000000 * seconds
        five = [] if before else [self._sample() for _ in range(5)]
        # medians: where a garbled one does not count
        self.centre = before.centre if before else [sorted(values)[2] for values in zip(*five)]
        while five or self.count < 5 or time.ticks_diff(time.ticks_us(), began) < span_us:
            counts = five.pop() if five else self._sample()
            off = [value - middle for value, middle in zip(counts, self.centre)]
            for i in range(6):
                if abs(off[i]) > (accel if i < 3 else gyro):
                    self._lost(self._moved(i, off[i]))
                    break
            else:
                for i in range(6):
                    self._sums[i] += off[i]
                    self._squares[i] += off[i] * off[i]
                self._temps += imu.temp_c()
                self.count += 1

    def mean(self, i):
        """Of axis i, counts."""
        return self.centre[i] + self._sums[i] / self.count

    def variance(self, i):
        """Of axis i, counts squared."""
        n, total = self.count, self._sums[i]
        return max(0, n * self._squares[i] - total * total) / (n * n)

    @property
    def temp_c(self):
        return self._temps / self.count

    @property
    def seen(self):
        """For the next part."""
        return self._last, self._looked

    def _sample(self):
        while True:
            try:
                counts = self._read()
            except OSError as error:
                self._lost(error)
                continue
            if self._imu.plausible():
                return counts[:3] + counts[4:]
            self._lost(NotStill("no data: the sensor sends %s" % counts))

    def _read(self):
        """Twice in each period. OSError. NotStill where the same comes for four of them, and for
        a tenth of the time of a slow low-pass: behind it a quiet sensor changes little."""
        imu = self._imu
        time.sleep_us(max(500, min(20000, round(500000 / imu.rate_hz))))
        imu.read()
        counts, now = list(imu.counts), time.ticks_ms()
        if counts != self._last:
            self._last, self._looked = counts, now
        elif time.ticks_diff(now, self._looked) > 10 + 4000 / imu.rate_hz + 100 / imu.dlpf_hz:
            raise NotStill("no data: the sensor sends nothing but %s, again and again" % counts)
        return counts

    def _lost(self, error):
        self._failed += 1
        if self._failed > 5 + self.count // 4:
            raise error

    def _moved(self, i, off):
        imu = self._imu
        if i < 3:
            return _not_still("accelerometer %s shook by", i, off / imu.accel_lsb_per_g, "g", 0)
        return _not_still("gyro %s shook by", i, off / imu.gyro_lsb_per_dps, "deg/s", 0)


def _judge(mean, spread, drift, least, gyro_limit_dps):
    """NotStill, unless all of it is that of a sensor at rest; least: the tilt that is seen, g."""
    for i in range(3):
        for k, what, size, limit in (
            (3 + i, "gyro %s shook by", spread[3 + i], gyro_limit_dps),
            (i, "accelerometer %s shook by", spread[i], _ACCEL_LIMIT_G),
            (3 + i, "gyro %s drifted by", abs(drift[3 + i]), gyro_limit_dps),
            (i, "accelerometer %s drifted by", abs(drift[i]), least[i]),
            (3 + i, "gyro %s turns at", abs(mean[3 + i]), BIAS_LIMIT_DPS),
        ):
            if size > limit:
                raise _not_still(what, k, size, "g" if k < 3 else "deg/s", limit)
    length = sqrt(mean[0] ** 2 + mean[1] ** 2 + mean[2] ** 2)
    if not 0.8 < length < 1.2:
        raise NotStill("moved, or broken: it feels %.3g g instead of 1 g" % length)


def _not_still(what, i, size, unit, limit):
    text = "moved: " + what % "xyz"[i % 3] + " %.3g %s" % (abs(size), unit)
    return NotStill(text + " (limit %.2g)" % limit if limit else text)

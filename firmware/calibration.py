# SPDX-License-Identifier: MIT
"""The calibration of the part that is there: on the flash, and moved with the temperature.

It follows the chip's temperature, and learns the gyro's bias whenever the robot rests. Nothing
is allocated unless the temperature has moved by a degree or a rest of ten seconds has been seen.
"""

from array import array

from calibration import Calibration
from calibration.thermal import BiasLearner

from firmware import store

PATH = "calibration.txt"
_KIND = "calibration"
_VERSION = 1

_REST_LOOKS = 10  # about ten seconds
_SLOPE_MAX = 0.7  # deg/s per degC: twice the datasheet's (PS p. 12)
_WORTH_DPS = 0.05  # less is not worth a write to flash


def load_for(imu):
    """(Calibration, warnings) of what is stored and fits this part."""
    cal, warnings = load_calibration()
    if cal.who_am_i not in (None, imu.who_am_i):
        warnings.append("%s is of another kind of sensor: only its mounting is used" % PATH)
        cal = cal.mounting()
    return cal, warnings


def load_calibration(path=PATH):
    """(Calibration, warnings) of what is stored; the ideal one when there is none."""
    stored, warnings = store.load(path, _KIND, _VERSION, ("date",))
    if stored:
        try:
            return Calibration.from_dict(stored), warnings
        except ValueError as error:
            warnings.append("%s: %s; none used" % (path, error))
    return Calibration(), warnings


def save_calibration(cal, path=PATH):
    """Store a Calibration safely (firmware.store). OSError when the flash refuses; ValueError for
    numbers that no working part needs.
    """
    fields = cal.to_dict()
    Calibration.from_dict(fields)  # what load_calibration() would refuse is not written
    del fields["version"]
    store.save(path, _KIND, _VERSION, {k: v for k, v in fields.items() if v not in (None, "")})


def keep_learned(learned, imu):
    """Store what was learned of this part's gyro, a Calibration or None. OSError, ValueError."""
    if learned:
        stored, _ = load_calibration()
        if stored.who_am_i in (None, imu.who_am_i):  # another part's calibration is worth more
            save_calibration(stored.gyro_from(learned))


class Warming:
    """cal: the calibration at the temperature of the start; imu: the driver.

    moved: called with the Calibration when the temperature has changed it.
    """

    def __init__(self, cal, imu, moved):
        self.cal = cal
        self._imu = imu
        self._moved = moved
        self._learner = BiasLearner(cal)
        self._degree = int(imu.profile.temp_lsb_per_c)
        self._raw = imu.counts[3]
        self._slopes = any(cal.gyro_slope_dps_per_c) or any(cal.accel_slope_g_per_c)
        self._sums = array("i", (0, 0, 0, 0))  # gyro counts since the rest began, how many
        self._rested = 0
        self.rests = 0

    def look(self, at_rest, second):
        """Some times a second; `second`: once a second. A learner gets means, not samples."""
        counts, sums = self._imu.counts, self._sums
        if second and self._slopes and abs(counts[3] - self._raw) > self._degree:
            self._raw = counts[3]
            self._moved(self.cal.at(self._imu.temp_c()))
        if not at_rest:
            self._forget()
            return
        for i in range(3):
            sums[i] += counts[4 + i]
        sums[3] += 1
        if second:
            self._rested += 1
        if self._rested == _REST_LOOKS:
            self.rests += 1
            lsb = sums[3] * self._imu.gyro_lsb_per_dps
            self._learner.rested(self._imu.temp_c(), [sums[i] / lsb for i in range(3)])
            self._forget()

    def _forget(self):
        self._rested = 0
        for i in range(4):
            self._sums[i] = 0

    def learned(self):
        """The calibration with what was learned, or None when it is nothing new or not sound."""
        if not self.rests:
            return None
        new = self._learner.calibration()
        if max([abs(s) for s in new.gyro_slope_dps_per_c]) > _SLOPE_MAX:
            new = new.but(gyro_slope_dps_per_c=self.cal.gyro_slope_dps_per_c)
        old = self.cal.at(new.temp_c).gyro_bias_dps
        if max([abs(a - b) for a, b in zip(new.gyro_bias_dps, old)]) < _WORTH_DPS:
            return None
        return new

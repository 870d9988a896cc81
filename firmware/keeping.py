# SPDX-License-Identifier: MIT
"""The calibration on the flash: loaded, saved, and what of it fits the part that is there."""

from calibration import Calibration

from firmware import store

PATH = "calibration.txt"
_KIND = "calibration"
_VERSION = 1


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

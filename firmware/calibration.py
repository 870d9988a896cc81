# SPDX-License-Identifier: MIT
"""The calibration of the part that is there, on the flash."""

from calibration import Calibration

from firmware import store
from firmware.config import CALIBRATION_PATH as PATH

_KIND = "calibration"
_VERSION = 1

_WORTH_DPS = 0.05  # less is not worth a write to flash


def load_for(imu, path=PATH):
    """(Calibration, warnings) of what is stored and fits this part."""
    cal, warnings = load_calibration(path)
    if cal.who_am_i not in (None, imu.who_am_i):
        warnings.append("%s is of another kind of sensor: only its mounting is used" % path)
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


def keep_learned(learned, imu, path=PATH):
    """Store what was learned of this part's gyro, a Calibration, where it is another bias than
    the stored one. OSError, ValueError."""
    stored, _ = load_calibration(path)
    if stored.who_am_i not in (None, imu.who_am_i):  # another part's calibration is worth more
        return
    old = stored.at(learned.temp_c).gyro_bias_dps
    off = max([abs(a - b) for a, b in zip(learned.gyro_bias_dps, old)])
    if off >= _WORTH_DPS or not any(stored.gyro_bias_dps):
        save_calibration(stored.gyro_from(learned), path)

# SPDX-License-Identifier: MIT
"""The gyro's bias as a start finds it, before the loop runs.

A bias is known by what is stored for this temperature, and by a rest. Loaded for the start, and
forgotten.
"""

import time
from collections import namedtuple

from calibration import Calibration
from calibration.rest import NotStill, rest
from calibration.watch import near, turn_dps
from micropython import const

from firmware import filters
from firmware.calibration import load_for
from firmware.learning import BOUND_DPS_PER_C, NOTHING, ONCE, SURE, TILTED_G

# still: calibration.watch.Rest of the start, or None
Begin = namedtuple("Begin", ("calibration", "known", "still", "warnings"))

_SPREAD = const(6.0)  # from the least to the largest of some hundred samples, in deviations
_TRIES = const(2.0)  # of rest_s: so long a start waits for rest
_STORED_DPS = const(0.4)  # a bias is no further from the stored one, and a little for each degC


def find(imu, config):
    """A Begin: the stored calibration with the gyro's bias as it is now. OSError."""
    cal, warnings = load_for(imu, config.calibration_path)
    stored, stored_c = any(cal.gyro_bias_dps), cal.temp_c
    cal = cal.at(imu.temp_c())
    if config.self_test:
        from firmware.report import tested

        good, lines = tested(imu)
        if not good:
            warnings.append("self-test failed, or the sensor was moved: " + ", ".join(lines))
    known, still = SURE if stored else NOTHING, None
    bias = cal.gyro_bias_dps if stored else None
    if config.rest_s:
        try:
            still = _rested(imu, config, bias)
            bound = _STORED_DPS + BOUND_DPS_PER_C * abs(still.temp_c - stored_c)
            now = cal.at(still.temp_c).gyro_bias_dps
            turn = turn_dps(still, now, bound) if stored else 0.0
            if stored and not turn and not near(still.gyro_dps, now, bound):
                _same_again(still, imu, config, bias)
        except NotStill as error:
            still = None
            used = "the stored one is used" if stored else "none is known, angles are uncertain"
            warnings.append("gyro bias not measured, %s: it %s" % (used, error))
    if still:
        cal = cal.at(still.temp_c)
        if turn:
            text = "it turns by %.1f deg/s, or the gyro's bias has changed: the stored one is used"
            warnings.append(text % turn)
        else:
            if stored and not near(still.gyro_dps, cal.gyro_bias_dps, bound):
                known = ONCE
                warnings.append("the gyro's bias is not the stored one: is it the same sensor?")
            cal = cal.but(gyro_bias_dps=still.gyro_dps)
            known = known or ONCE
    return Begin(_folding(cal, imu, config, warnings), known, still, warnings)


def _rested(imu, config, bias_dps):
    """A Rest; waits for it a while. NotStill, OSError."""
    # the low-pass forgets the gyro's start: eight of its time constants, two of the samples
    time.sleep_ms(int(8 * 160 / config.dlpf_hz + 2000 / imu.rate_hz))
    began = time.ticks_ms()
    while True:
        try:
            return rest(imu, config.rest_s, config.still_dps / _SPREAD, bias_dps)
        except NotStill:
            if time.ticks_diff(time.ticks_ms(), began) > 1000 * _TRIES * config.rest_s:
                raise


def _same_again(still, imu, config, bias_dps):
    """NotStill where what looked like a Rest was a slow tilt: a later one shows it."""
    if not near(_rested(imu, config, bias_dps).accel_g, still.accel_g, TILTED_G):
        raise NotStill("moved: it tilts slowly")


def _folding(cal, imu, config, warnings):
    """`cal`, or as much of it as this range's integers can hold."""
    for less in (cal, cal.mounting(), Calibration()):
        try:
            filters.make(config, less, imu, config.rate_hz)
            return less
        except ValueError as error:
            warnings.append("the stored calibration is not used: %s" % error)
    return cal

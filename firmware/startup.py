# SPDX-License-Identifier: MIT
"""What happens once, before the loop runs: the stored calibration and the gyro's bias at rest."""

import time

from mpu6050 import MPU6050
from mpu6050.calibration import Calibration

from firmware import store
from firmware.board import diagnose

PATH = "calibration.txt"
KIND = "calibration"
VERSION = 1

# The fields of mpu6050.calibration.Calibration with their lengths and largest magnitude; the
# datasheet's tolerances (20 deg/s, 80 mg, 3 %, 2 % cross-axis) lie far within.
_FIELDS = (
    ("gyro_bias_dps", 3, 60.0),
    ("accel_bias_g", 3, 0.5),
    ("gyro_matrix", 9, 1.5),
    ("accel_matrix", 9, 1.5),
)
_BIAS_MAX_DPS = 40.0  # initial offset and drift over temperature (PS section 6.1)


def sensor(board, config):
    """The driver, configured. OSError with the driver's words and what the bus itself shows."""
    try:
        imu = MPU6050(
            board.i2c(),
            address=config.address,
            gyro_dps=config.gyro_dps,
            accel_g=config.accel_g,
            dlpf_hz=config.dlpf_hz,
            rate_hz=config.rate_hz if config.drive == "data-ready" else config.sensor_hz,
        )
    except OSError as error:
        code = error.args[0] if error.args else 0
        raise OSError(
            code, "%s\nSeen: %s" % (error.args[-1], diagnose(board, config.address))
        ) from error
    imu.data_ready(config.drive == "data-ready")
    return imu


def calibration(imu, config):
    """(Calibration, warnings): the stored one, with the gyro's bias as measured now."""
    fields, warnings = load_calibration()
    if config.rest_s:
        bias, why = gyro_bias(imu, config.rest_s, config.still_dps)
        if bias:
            fields["gyro_bias_dps"] = bias
        else:
            kept = "the stored one" if "gyro_bias_dps" in fields else "zero"
            warnings.append("gyro bias not measured, %s is used: %s" % (kept, why))
    return Calibration(**fields), warnings


def load_calibration(path=PATH):
    """(fields, warnings): what is stored, as keyword arguments of Calibration; maybe empty."""
    stored, warnings = store.load(path, KIND, VERSION)
    fields = {}
    for name, length, largest in _FIELDS:
        value = (stored or {}).get(name)
        if value is None:
            continue
        # `<=` is false for nan, so a nan is refused as well
        if (
            isinstance(value, tuple)
            and len(value) == length
            and all(isinstance(x, (int, float)) and abs(x) <= largest for x in value)
        ):
            fields[name] = tuple(float(x) for x in value)
        else:
            warnings.append("%s: %s is not %d sound numbers: ignored" % (path, name, length))
    return fields, warnings


def save_calibration(fields, path=PATH):
    """Store a dict of Calibration's fields, and notes (residual, date, ...) if it has them."""
    store.save(path, KIND, VERSION, fields)


def gyro_bias(imu, seconds, still_dps):
    """((x, y, z) in deg/s, None) from samples at rest, or (None, why not).

    Paper 004 (MPU6050 Kalman): the mean of many samples, 1 ms apart, while the sensor stands
    still. Here it is checked: the spread of each axis must stay below still_dps.
    """
    lsb = imu.gyro_lsb_per_dps
    low = [32767] * 3
    high = [-32768] * 3
    total = [0] * 3
    n = max(1, int(seconds * 1000))
    for _ in range(n):
        imu.read()
        for axis in range(3):
            value = imu.counts[4 + axis]
            total[axis] += value
            low[axis] = min(low[axis], value)
            high[axis] = max(high[axis], value)
        time.sleep_us(500)
    spread = max(high[axis] - low[axis] for axis in range(3)) / lsb
    if spread > still_dps:
        return None, "it moves: the gyro spread over %.1f deg/s, still is below %.1f" % (
            spread,
            still_dps,
        )
    bias = tuple(total[axis] / n / lsb for axis in range(3))
    if max(abs(b) for b in bias) > _BIAS_MAX_DPS:
        return None, "it turns steadily: %.1f, %.1f, %.1f deg/s" % bias
    return bias, None

# SPDX-License-Identifier: MIT
"""What happens once, before the loop runs: the stored calibration and the gyro's bias at rest."""

import time

from mpu6050 import MPU6050

from firmware.board import diagnose
from firmware.calibration import load_for

_BIAS_MAX_DPS = 40.0  # initial offset and drift over temperature (PS section 6.1)


def sensor(board, config):
    """The driver, configured. OSError with the driver's words and what the bus itself shows."""
    failure = None
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
        failure = error
    if failure is not None:  # raised out here, so that one traceback is shown
        seen = diagnose(board, config.address)
        raise OSError(failure.args[0], "%s\nSeen: %s" % (failure.args[-1], seen))
    imu.data_ready(config.drive == "data-ready")
    return imu


def calibration(imu, config):
    """(Calibration, warnings): the stored one, with the gyro's bias as measured now."""
    cal, warnings = load_for(imu)
    imu.read()
    cal = cal.at(imu.temp_c())
    if config.self_test:
        from firmware.report import tested

        good, lines = tested(imu)
        if not good:
            warnings.append("self-test failed, or the sensor was moved: " + ", ".join(lines))
    if config.rest_s:
        bias, why = gyro_bias(imu, config.rest_s, config.still_dps)
        if bias:
            cal = cal.but(gyro_bias_dps=bias)
        else:
            warnings.append("gyro bias not measured, the stored one (or zero) is used: " + why)
    return cal, warnings


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

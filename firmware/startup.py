# SPDX-License-Identifier: MIT
"""What happens once, before the loop runs: the stored calibration and the gyro's bias at rest."""

import time

from calibration import Calibration
from calibration.rest import NotStill, rest
from mpu6050 import MPU6050, ranges

from firmware import filters
from firmware.board import diagnose
from firmware.calibration import load_for

_OFF = 0.005  # of the rate: the filter follows the true one, the knob still says what it is
_SPREAD = 6.0  # from the least to the largest of some hundred samples, in standard deviations


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
            rate_hz=sensor_rate_hz(config),
        )
    except OSError as error:
        failure = error
    if failure is not None:  # raised out here, so that one traceback is shown
        seen = diagnose(board, config.address)
        raise OSError(failure.args[0], "%s\nSeen: %s" % (failure.args[-1], seen))
    imu.data_ready(config.drive == "data-ready")
    return imu


def set_up(imu, config):
    """The knobs to a sensor that goes on measuring. OSError when it does not take them."""
    if hasattr(imu, "set_up"):  # a MinIMU-9 keeps its own settings
        imu.set_up(config.gyro_dps, config.accel_g, config.dlpf_hz, sensor_rate_hz(config))
        imu.data_ready(config.drive == "data-ready")


def awake(imu, config):
    """The same for one that was left alone: it may have lost its supply, or sleep."""
    set_up(imu, config)
    imu.configure()


def sensor_rate_hz(config):
    """What the driver is asked for. ValueError where the sensor cannot set the loop's pace: its
    divider makes whole parts of its own rate only, and the loop would not be what was asked.
    """
    if config.drive != "data-ready":
        return config.sensor_hz
    own = 8000 if config.dlpf_hz == 260 else 1000  # Hz (RM p. 13)
    n = own // config.rate_hz
    for rate in (own / n, own / (n + 1)):
        if abs(rate - config.rate_hz) <= _OFF * config.rate_hz:
            return config.rate_hz
    raise ValueError(
        "rate_hz = %s with drive = data-ready: the sensor makes %d / n; nearest %.1f and %.1f Hz"
        % (config.rate_hz, own, own / (n + 1), own / n)
    )


class _Ranges:
    """What a sensor with these knobs would have, for check()."""

    def __init__(self, config):
        self.gyro_range_dps, self.accel_range_g = config.gyro_dps, config.accel_g
        self.delay_s = ranges.delay_s(config.dlpf_hz, ranges.FAMILIES[0])


def check(config):
    """ValueError where the knobs do not go together, whatever each of them is by itself."""
    rate_hz = sensor_rate_hz(config)
    ranges.divider(ranges.dlpf(config.dlpf_hz)[1], rate_hz)
    filters.make(config, Calibration(), _Ranges(config), config.rate_hz)


def calibration(imu, config):
    """(Calibration, warnings, known): the stored one, with the gyro's bias as measured now; known:
    whether that was measured, now or ever."""
    cal, warnings = load_for(imu)
    measured = False
    imu.read()
    cal = cal.at(imu.temp_c())
    if config.self_test:
        from firmware.report import tested

        good, lines = tested(imu)
        if not good:
            warnings.append("self-test failed, or the sensor was moved: " + ", ".join(lines))
    if config.rest_s:
        time.sleep_ms(_settling_ms(config, imu))
        try:
            still = rest(imu, config.rest_s, config.still_dps / _SPREAD)
            cal = cal.at(still.temp_c).but(gyro_bias_dps=still.gyro_dps)
            measured = True
        except NotStill as error:
            text = "gyro bias not measured, the stored one (or zero) is used: it %s"
            warnings.append(text % error)
    folded = _folding(cal, imu, config, warnings)
    return folded, warnings, folded is cal and (measured or any(cal.gyro_bias_dps))


def _folding(cal, imu, config, warnings):
    """`cal`, or as much of it as this range's integers can hold."""
    for less in (cal, cal.mounting(), Calibration()):
        try:
            filters.make(config, less, imu, config.rate_hz)
            return less
        except ValueError as error:
            warnings.append("the stored calibration is not used: %s" % error)
    return cal


def _settling_ms(config, imu):
    """Until the low-pass has forgotten the gyro's start: five of its time constants, and two of
    the sensor's samples."""
    return int(5 * 160 / config.dlpf_hz + 2000 / imu.rate_hz)

# SPDX-License-Identifier: MIT
"""What the knobs ask of the sensor, and whether they go together."""

from calibration import Calibration
from micropython import const
from mpu6050 import ranges

from firmware import filters

_OFF = const(0.005)  # of the rate: the filter follows the true one, the knob still says what it is


def set_up(imu, config):
    """The knobs to a sensor that goes on measuring. OSError when it does not take them."""
    imu.set_up(config.gyro_dps, config.accel_g, config.dlpf_hz, sensor_rate_hz(config))
    imu.data_ready(config.drive == "data-ready")


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


def check_pace(config, board):
    """ValueError where the bus is too slow for the rate, or the sensor cannot make it."""
    rate_hz = sensor_rate_hz(config)
    refused = ""
    try:
        ranges.divider(ranges.dlpf(config.dlpf_hz)[1], rate_hz)
    except ValueError as error:
        refused = str(error)
        if config.drive != "data-ready":
            refused = refused.replace("rate_hz", "sensor_hz")  # the knob, not the driver's name
    if refused:
        raise ValueError(refused)
    burst_us = board.burst_us(config.bus_hz)
    if 10 * burst_us * config.rate_hz > 7000000:
        text = "rate_hz = %d: a burst takes %d us of its period at bus_hz = %d"
        raise ValueError(text % (config.rate_hz, burst_us, config.bus_hz))


class _Ranges:
    """What a sensor with these knobs would have, for check()."""

    def __init__(self, config):
        self.gyro_range_dps, self.accel_range_g = config.gyro_dps, config.accel_g
        self.delay_s = ranges.delay_s(config.dlpf_hz, ranges.FAMILIES[0])


def check(config, board):
    """ValueError where the knobs do not go together, whatever each of them is by itself."""
    check_pace(config, board)
    try:
        filters.make(config, Calibration(), _Ranges(config), config.rate_hz)
    except MemoryError:
        pass  # no room to try it beside what runs: the next start will

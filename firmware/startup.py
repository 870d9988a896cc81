# SPDX-License-Identifier: MIT
"""The sensor found and set up, before the loop runs.

As tolerant as the flight: what fails is tried again for a while, then refused with what was seen,
how often, and what to check.
"""

import time
from array import array
from errno import ENODEV

from calibration import Calibration
from micropython import const
from mpu6050 import MPU6050, ranges

from firmware import filters

_OFF = const(0.005)  # of the rate: the filter follows the true one, the knob still says what it is
_PATIENCE_MS = const(1000)  # a supply may take 100 ms to rise (PS p. 15), a plug to be pushed in
_EACH_MS = const(100)  # of which one attempt asks for its name
_FIRST = const(30)
# what the driver advises, and the knob for it
_WAYS = (
    ("address=0x68", 'app.set("address", 0x68)'),
    ("address=0x69", 'app.set("address", 0x69)'),
    ("allow_unknown", 'app.set("allow_unknown", 1)'),
)


def sensor(board, config, bus=None, kind=None):
    """The driver, configured; bus: firmware.bus, which others may use already; kind: another class
    than MPU6050. OSError with what was seen, how often, and what to check."""
    seen = {}  # type: dict

    def make(i2c):
        settings = {
            "gyro_dps": config.gyro_dps,
            "accel_g": config.accel_g,
            "dlpf_hz": config.dlpf_hz,
            "wait_ms": _EACH_MS,
            "lock": bus,
        }
        if kind:
            imu = kind(i2c, **settings)
        else:
            imu = MPU6050(
                i2c,
                address=config.address,
                rate_hz=sensor_rate_hz(config),
                allow_unknown=config.allow_unknown,
                seen=seen,
                **settings,
            )
        imu.data_ready(config.drive == "data-ready")
        return imu

    return _patiently(make, board, config, bus, seen, _with(bus, board.i2c))


def again(imu, board, config, bus=None):
    """A sensor that stood still meanwhile measures again, as the knobs say: it may sleep, have
    lost its supply, or have another master's settings. OSError as sensor()."""

    def look(i2c):
        if i2c:
            imu.use_bus(i2c)
        if not (imu.same_part() or imu.same_part() or imu.adopt()):
            raise OSError(ENODEV, "another device answers at 0x%02X than before" % imu.address)
        if imu.asleep:
            imu.wake()
        imu.rewind()
        for _ in range(imu.rows):
            if not (imu.check() or imu.recheck()):
                imu.reset()
                imu.configure()
                break
        set_up(imu, config)
        return imu

    return _patiently(look, board, config, bus, {}, None)


def _with(bus, work):
    """What work() returns, the bus held."""
    if not bus:
        return work()
    with bus:
        return work()


def _patiently(work, board, config, bus, seen, i2c):
    """What work(i2c) returns, tried for _PATIENCE_MS with a bus that is freed and made anew in
    between: the sensor may come up later than the board, or hang in a transfer that a reset cut
    off.
    """
    began = time.ticks_ms()
    failure = None
    tries = 0
    while failure is None or time.ticks_diff(time.ticks_ms(), began) < _PATIENCE_MS:
        tries += 1
        try:
            return work(i2c)
        except OSError as error:
            failure = error
        i2c = _with(bus, board.recover)
    # raised out here, so that one traceback is shown
    passed_s = time.ticks_diff(time.ticks_ms(), began) / 1000
    text = "%s\nTried %d times in %.1f s." % (failure.args[-1], tries, passed_s)
    knobs = [knob for way, knob in _WAYS if way in text]
    if knobs:
        text += " In the app: %s." % " or ".join(knobs)
    if 2 * sum([n for got, n in seen.items() if got >= 0]) <= sum(seen.values()):
        from firmware.diagnose import diagnose

        text += "\nSeen: %s" % _with(bus, lambda: diagnose(board, config.address))
    raise OSError(failure.args[0], text)


def first(imu):
    """A good sample is in the driver's counts: of each word the middle one of three, so that one
    broken transfer is not what everything begins with. OSError when none comes."""
    failure = None
    bursts = []
    for _ in range(_FIRST):
        try:
            imu.read()
            if imu.plausible():
                bursts.append(array("h", imu.counts))
        except OSError as error:
            failure = error
        if len(bursts) == 3:
            for i in range(7):
                imu.counts[i] = sorted([burst[i] for burst in bursts])[1]
            return
        time.sleep_ms(1)
    raise failure or OSError(ENODEV, "the sensor sends no data but %s" % list(imu.counts))


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
    filters.make(config, Calibration(), _Ranges(config), config.rate_hz)

# SPDX-License-Identifier: MIT
"""The sensor found and set up, before the loop runs; loaded for that, and forgotten.

As tolerant as the flight: what fails is tried again for a while, then refused with what was seen,
how often, and what to check.
"""

import time
from errno import ENODEV

from micropython import const
from mpu6050 import MPU6050

from firmware.first import first
from firmware.settings import sensor_rate_hz, set_up

_PATIENCE_MS = const(1000)  # a supply may take 100 ms to rise (PS p. 15), a plug to be pushed in
_EACH_MS = const(100)  # of which one attempt asks for its name
# what the driver advises, and the knob for it
_WAYS = (
    ("address=0x68", 'app.set("address", 0x68)'),
    ("address=0x69", 'app.set("address", 0x69)'),
    ("allow_unknown", 'app.set("allow_unknown", 1)'),
)


def check(app, running):
    """OSError, with what to set, where one of the others that run has this app's sensor, or wires
    that do not go together with its own."""
    mine = app.board
    wires = mine.sda, mine.scl
    for other in running:
        if not other.running:
            continue
        its = other.board
        its_wires = its.sda, its.scl
        if wires != its_wires:  # an ESP32 has any pins for any number
            if mine.i2c_id == its.i2c_id or wires[0] in its_wires or wires[1] in its_wires:
                text = "I2C%d has the pins SDA GP%d, SCL GP%d for a running App: set the knob bus"
                raise OSError(text % (its.i2c_id, its.sda, its.scl))
        elif mine.bus_hz != its.bus_hz:
            raise OSError("these wires run at %d Hz for a running App: set bus_hz" % its.bus_hz)
        elif other.kind is app.kind and other.config.address == app.config.address:
            raise OSError("this sensor has a running App: use App.current(), or stop it first")


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
        first(imu)
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
        try:
            first(imu)
        except OSError:  # it hangs, and the registers are as they should be
            imu.reset()
            imu.configure()
            raise
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

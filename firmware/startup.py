# SPDX-License-Identifier: MIT
"""The sensor found and set up, before the loop runs, and its first sample; loaded for that, and
forgotten.

As tolerant as the flight: what fails is tried again for a while, then refused with what was seen,
how often, and what to check.
"""

import time
from array import array
from errno import ENODEV

from calibration.watch import near
from micropython import const
from mpu6050 import MPU6050

from firmware import wiring
from firmware.settings import sensor_rate_hz, set_up
from firmware.tick import estimate, judge

_PATIENCE_MS = const(1000)  # a supply may take 100 ms to rise (PS p. 15), a plug to be pushed in
_EACH_MS = const(100)  # of which one attempt asks for its name
_DATA_MS = const(200)  # and four of the sensor's periods: until its data have to have changed
_MOVED_G = const(0.02)  # a degree, and more than one sample's noise
_LEVEL_US = const(1500000)  # after a levelling by one sample, which may have been pushed
_NO = (0.0, 0.0, 0.0)

# places: firmware.tick.words, firmware.tick.estimate
_ODD = const(0)
_SURE = const(8)
_UNSURE_US = const(16)
_UNCERTAIN = const(12)
# those that begin anew with a start, besides the counts
_FRESH = (1, 2, 3, 4, 6, 9, 10, 11, 15, 16, 17, 18, 20, 21, 23, 24, 25, 26, 28)
_COUNT = const(30)
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


def first(imu):
    """A good sample of now is in the driver's counts: of each word the middle one of three, so
    that one broken transfer is not what everything begins with. They differ from one before them:
    what comes again and again is of some time ago, and looks like rest. OSError."""
    failure = old = None
    bursts = []
    began = time.ticks_ms()
    patience_ms = _DATA_MS + 4000 // imu.rate_hz
    while time.ticks_diff(time.ticks_ms(), began) < patience_ms:
        try:
            imu.read()
            if imu.plausible():
                burst = array("h", imu.counts)
                if old is None:
                    old, failure = burst, None
                elif burst != old:
                    bursts.append(burst)
                    if len(bursts) < 3:
                        continue
                    for i in range(7):
                        imu.counts[i] = sorted([burst[i] for burst in bursts])[1]
                    return
        except OSError as error:
            failure = error
        time.sleep_us(500)
    sends = "nothing but %s, again and again" if old else "no data but %s"
    raise failure or OSError(ENODEV, "the sensor sends " + sends % list(imu.counts))


def begin(app, still):
    """One sample, levelled, so that the angles are true before the first tick. still: the Rest
    that has been, whose means are better than one sample, or None.
    """
    words, tick, imu = app.tick.words, app.tick, app.imu
    for place in _FRESH:
        words[place] = 0
    for place in range(_COUNT, len(words)):
        words[place] = 0
    words[_SURE] = words[_ODD] = 1
    for place in range(len(tick.est)):
        tick.est[place] = 0
    app.filter.standing()  # loads what is needed below: the first sample shall not wait for that
    first(imu)
    now = time.ticks_us()
    tick.timing.follow(now)
    accel_g = imu.accel_g()
    if still and not (
        near(accel_g, still.accel_g, _MOVED_G)
        and near(imu.gyro_dps(), still.gyro_dps, app.config.still_dps)
    ):
        still = None  # it has moved since
    if app.learning.known:
        accel_g = still.accel_g if still else accel_g
        wiring.begin_at(app.filter, app.calibration.apply(accel_g, _NO)[0])
        if not still:
            app.filter.relevel()
            words[_UNSURE_US] = _LEVEL_US
    app.filter.update(imu.counts)
    burst = array("H", [count & 0xFFFF for count in imu.counts])
    judge.forget(tick.memory)
    for place in range(7):  # a pause ahead of the first tick is bridged from here
        tick.memory[place] = burst[place]
    judge.judge(burst, tick.memory)  # and what is a leap from here is one
    estimate.publish(tick.est, app.filter.out, burst, now)
    app.learning.begin()
    tick.est[_UNCERTAIN] = 1 if words[_UNSURE_US] else 0

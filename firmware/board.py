# SPDX-License-Identifier: MIT
"""Pins, bus and timers of the board: the only place that knows `machine`.

What a chip has and can do is data (firmware.chips); find() picks this board's row, the knobs
change its pins, bus and speed. Pin numbers are GPIO numbers.
"""

import sys
import time
from errno import ENODEV

import machine
from machine import I2C, PWM, Pin, SoftI2C, Timer
from micropython import const

from firmware.briefly import Briefly
from firmware.row import bus_of, reason

# A burst takes 400 us; the port's own 50 ms would stop the loop for 12 ticks. The ESP32's driver
# of MicroPython 1.29 waits in steps of 10 ms and makes no transfer at all in less
_TIMEOUT_US = {"rp2": 2000, "esp32": 20000}
# on RP2 it is for a whole transfer: 2 KB to a display where no tick waits
_FRAME_US = const(50000)
_SOFT_TIMEOUT_US = const(2000)
_ONE_ERROR = (1, 29)  # from here on every failure of an ESP32's bus is ENODEV
_HALF_CLOCK_US = const(5)
_VERSION = sys.implementation.version[:2]

_taken = {}  # type: dict  # output pin: who drives it
_timers = []  # type: list  # ids of the ESP32's timers that run


class Board:
    """Attributes: name, i2c_id, bus_hz; sda, scl, int_pin (None: nobody knows), outputs (GPIO
    numbers); row: firmware.row.Row; soft: the bus is bit-banged; one_error: a failed transfer
    does not say whether the bus is stuck.
    """

    def __init__(self, row):
        self.row = row
        self.name, self.platform = row.name, row.platform
        self.soft = _VERSION < row.deaf_before
        self.one_error = row.platform == "esp32" and not self.soft and _VERSION >= _ONE_ERROR
        self.sda, self.scl, self.int_pin = row.sda, row.scl, row.int_pin
        self.outputs = row.outputs
        self.i2c_id, self.bus_hz = 0, 400000
        self._timeout_us = _TIMEOUT_US[row.platform]

    def use(self, config):
        """The pins, the bus and its speed as the knobs say, -1: the board's own.

        ValueError where the chip cannot do that, OSError where neither knows a pin: both name
        the knobs.
        """
        row = self.row
        pins = [row.sda, row.scl, row.int_pin]
        for i, knob in enumerate(_PINS):
            pin = getattr(config, knob)
            self.check_pin(knob, pin)
            if pin >= 0:
                pins[i] = pin
        if pins[0] is None or pins[1] is None:
            raise OSError(ENODEV, self._unknown("pin_sda and pin_scl"))
        if pins[2] is None and config.drive == "data-ready":
            raise OSError(ENODEV, self._unknown("pin_int"))
        bus = bus_of(row, pins[0], pins[1], config.bus)
        outputs = []
        for i, knob in enumerate(_OUTPUTS):
            pin = getattr(config, knob)
            self.check_pin(knob, pin)
            if pin >= 0:
                outputs.append(pin)
            elif i < len(row.outputs):
                outputs.append(row.outputs[i])
        used = pins[:2] + [pin for pin in pins[2:] if pin is not None] + outputs
        for pin in used:
            if used.count(pin) > 1:
                raise ValueError("GP%d is to be two things: pin_sda, pin_scl, pin_int and "
                                 "pin_out_1 to 4 are %s" % (pin, used))  # fmt: skip
        self.sda, self.scl, self.int_pin = pins
        self.outputs = tuple(outputs)
        self.i2c_id, self.bus_hz = bus, config.bus_hz

    def check_pin(self, knob, pin):
        """ValueError where this pin, which a knob gives, cannot be what the knob says."""
        why = "" if pin < 0 else reason(self.row, pin, knob.split("_")[1])
        if why:
            raise ValueError("%s = %d, on %s: %s" % (knob, pin, self.name, why))

    def _unknown(self, knobs):
        text = 'no pins known for "%s" (%s): set the knobs %s to what it is wired to, for '
        text += 'instance app.set("pin_sda", 8); then app.start() and app.save()'
        return text % (self.name, self.platform, knobs)

    def check_version(self):
        """OSError where this MicroPython is too old for this chip."""
        least = self.row.least
        if _VERSION < least:
            text = "MicroPython %d.%d is too old: %s needs %d.%d or newer"
            raise OSError(ENODEV, text % (_VERSION + (self.name,) + least))

    def warnings(self):
        """What is to be said about this board and its MicroPython, texts."""
        if not self.soft:
            return []
        text = "MicroPython %d.%d waits up to a second for a stuck bus on %s: the bus is "
        text += "bit-banged, at half its speed; %d.%d does not"
        return [text % (_VERSION + (self.name,) + self.row.deaf_before)]

    def burst_us(self, bus_hz):
        """How long a burst of 14 bytes takes: 17 bytes of 9 bits, starts and a stop."""
        return 156000000 // bus_hz * (2 if self.soft else 1)

    def i2c(self):
        """The sensor's bus."""
        scl, sda = Pin(self.scl), Pin(self.sda)
        if self.soft:
            return SoftI2C(scl=scl, sda=sda, freq=self.bus_hz, timeout=_SOFT_TIMEOUT_US)
        return I2C(self.i2c_id, scl=scl, sda=sda, freq=self.bus_hz, timeout=self._timeout_us)

    def wait(self, split):
        """Bursts are split: none waits in the tick, so other devices' transfers may take long.
        True where i2c() gives another object now."""
        before = self._timeout_us
        rp2 = self.platform == "rp2"
        self._timeout_us = _FRAME_US if split and rp2 else _TIMEOUT_US[self.platform]
        return self._timeout_us != before and not self.soft

    def recover(self):
        """Free a bus whose SDA a device holds low, and return a new I2C object.

        Up to nine clocks let the device finish its byte, a STOP ends the transfer (I2C-bus
        specification UM10204, 3.1.16). The I2C block must be made anew: it no longer has the pins.
        """
        scl = Pin(self.scl, Pin.OPEN_DRAIN, value=1)
        sda = Pin(self.sda, Pin.OPEN_DRAIN, value=1)
        for _ in range(9):
            if sda.value():
                break
            scl.value(0)
            time.sleep_us(_HALF_CLOCK_US)
            scl.value(1)
            time.sleep_us(_HALF_CLOCK_US)
        sda.value(0)
        time.sleep_us(_HALF_CLOCK_US)
        sda.value(1)
        time.sleep_us(_HALF_CLOCK_US)
        return self.i2c()

    @property
    def held(self):
        """Whether a device holds SDA low. Only while nobody transfers: its level is data then."""
        return not Pin(self.sda).value()  # without a mode: the I2C block keeps it

    @property
    def has_spare_timer(self):
        """Whether two apps leave one for each to notice that the other one has died."""
        return self.row.timers[0] < 0 or len(self.row.timers) > 2

    def has_hard(self, timer):
        """Whether this port calls in a hard interrupt: of a timer, or of the INT line."""
        if self.platform != "rp2":
            return False
        return not timer or _VERSION >= (1, 26)

    def ticking(self, source, hard):
        """`source` (timer or data_ready) with this kind of interrupt, as source(period, call)."""

        def start(period_us, callback):
            return source(period_us, callback, hard)

        return start

    def timer(self, period_us, callback, hard=False):
        """Call `callback(timer)` every period in the background, the REPL alive.

        hard: in the interrupt itself, where nothing of Python delays it (has_hard()). OSError
        where no timer is left.
        """
        return _Ticks(self.row, period_us, callback, hard)

    def data_ready(self, _period_us, callback, hard=False):
        """Call `callback(pin)` at each rising edge of the sensor's INT line."""
        return _Edges(Pin(self.int_pin, Pin.IN), callback, hard)

    def line_levels(self, up):
        """Levels (sda, scl) of the idle bus against a weak internal pull of the board."""
        levels = []
        for number in (self.sda, self.scl):
            pin = Pin(number, Pin.IN, Pin.PULL_UP if up else Pin.PULL_DOWN)
            time.sleep_us(50)
            levels.append(pin.value())
        return levels

    def scan(self, swapped=False):
        """Addresses that answer, bit-banged; `swapped`: as if SDA and SCL had changed places."""
        sda, scl = (self.scl, self.sda) if swapped else (self.sda, self.scl)
        return SoftI2C(scl=Pin(scl), sda=Pin(sda), freq=100000, timeout=_SOFT_TIMEOUT_US).scan()

    def take(self, owner, count):
        """The first `count` output pins, for `owner` (a word) alone. ValueError where another
        has one of them, or there are not so many."""
        pins = self.outputs[:count]
        if len(pins) < count:
            text = "%s needs %d outputs, the board has %d: set the knobs pin_out_1 to pin_out_%d"
            raise ValueError(text % (owner, count, len(pins), count))
        for pin in pins:
            if _taken.get(pin, owner) != owner:
                raise ValueError("GP%d drives %s already, not %s" % (pin, _taken[pin], owner))
        for pin in pins:
            _taken[pin] = owner
        return pins

    def give_back(self, owner):
        """The pins that `owner` took are free again."""
        for pin in [pin for pin in _taken if _taken[pin] == owner]:
            del _taken[pin]

    def pwm(self, pin, freq_hz, duty_ns=0):
        """A PWM output that carries this pulse from its first one on: some ports begin with half
        of the period, which is a kick for a motor and full speed for some ESCs.
        """
        return PWM(Pin(pin), freq=freq_hz, duty_ns=duty_ns)

    def watchdog(self, timeout_ms):
        """The board's watchdog, started: it cannot be stopped again."""
        return machine.WDT(timeout=timeout_ms)


_PINS = ("pin_sda", "pin_scl", "pin_int")
_OUTPUTS = ("pin_out_1", "pin_out_2", "pin_out_3", "pin_out_4")


class _Ticks:
    """A timer that runs, with an id of its own where the port has some."""

    def __init__(self, row, period_us, callback, hard):
        free = [number for number in row.timers if number < 0 or number not in _timers]
        if not free:
            raise OSError(ENODEV, "no timer left: %s has %d" % (row.name, len(row.timers)))
        self._id = free[0]
        _timers.append(self._id)
        options = {"hard": True} if hard else {}
        self._timer = Timer(  # type: ignore[call-overload]  # the stubs forget tick_hz with a period
            self._id,
            mode=Timer.PERIODIC,
            period=period_us,
            tick_hz=1000000,
            callback=callback,
            **options,
        )

    def deinit(self):
        self._timer.deinit()
        if self._id in _timers:
            _timers.remove(self._id)


class _Edges:
    def __init__(self, pin, callback, hard):
        self._pin = pin
        options = {"hard": True} if hard else {}
        pin.irq(handler=callback, trigger=Pin.IRQ_RISING, **options)

    def deinit(self):
        self._pin.irq(handler=None)


def here():
    """The Board this runs on; its pins are None where nobody knows them."""
    return Board(_row(sys.platform, sys.implementation._machine))


def find(platform=None, name=None):
    """The Board of this name, or this one. OSError naming the knobs when nobody knows its pins."""
    platform = platform or sys.platform
    board = Board(_row(platform, name or sys.implementation._machine))
    if board.sda is None:
        raise OSError(ENODEV, board._unknown("pin_sda and pin_scl"))
    return board


def _row(platform, machine):
    with Briefly("firmware.chips", "firmware.pinouts"):
        from firmware import chips

        return chips.find(platform, machine)

# SPDX-License-Identifier: MIT
"""Pins, bus and timers of each board: the only place that knows `machine`.

The boards are rows of data. `find()` picks this board's row; everything else is made from it.
Pin numbers are GPIO numbers. No board uses pins that strap its boot, its flash or its USB.
"""

import sys
import time

import machine
from machine import I2C, PWM, Pin, SoftI2C, Timer

# What sys.implementation._machine contains (the first row that fits), then the pins.
# name, platform, contains, I2C id, SDA, SCL, INT, servo and ESC outputs, timer ids (lead, tick)
BOARDS = (
    ("Pico 2", "rp2", "RP2350", 0, 4, 5, 6, (16, 17, 18, 19), (-1, -1)),
    ("Pico W", "rp2", "Pico W", 0, 4, 5, 6, (16, 17, 18, 19), (-1, -1)),
    ("Pico", "rp2", "RP2040", 0, 4, 5, 6, (16, 17, 18, 19), (-1, -1)),
    ("ESP32-S3", "esp32", "ESP32S3", 0, 8, 9, 10, (4, 5, 6, 7), (0, 1)),
    ("ESP32-C3", "esp32", "ESP32C3", 0, 6, 7, 10, (0, 1, 3, 4), (0, 1)),
    ("ESP32", "esp32", "ESP32", 0, 21, 22, 19, (25, 26, 27, 14), (0, 1)),
)

_BUS_HZ = 400000  # the sensor's limit
_TIMEOUT_US = 2000  # a burst takes 400 us; the port's own 50 ms would stop the loop for 12 ticks
_HALF_CLOCK_US = 5

_taken = {}  # type: dict  # output pin: who drives it


class Board:
    """One board's pins. Attributes: name, i2c_id, sda, scl, int_pin, outputs (GPIO numbers)."""

    def __init__(self, row):
        self.name, self.platform, _, self.i2c_id = row[:4]
        self.sda, self.scl, self.int_pin, self.outputs, self._timer_ids = row[4:]
        self._timers = 0

    def i2c(self):
        """The sensor's bus at 400 kHz."""
        return I2C(
            self.i2c_id,
            scl=Pin(self.scl),
            sda=Pin(self.sda),
            freq=_BUS_HZ,
            timeout=_TIMEOUT_US,
        )

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

    def has_hard(self, timer):
        """Whether this port calls in a hard interrupt: of a timer, or of the INT line."""
        if self.platform != "rp2":
            return False
        return not timer or sys.implementation.version[:2] >= (1, 26)

    def ticking(self, source, hard):
        """`source` (timer or data_ready) with this kind of interrupt, as source(period, call)."""

        def start(period_us, callback):
            return source(period_us, callback, hard)

        return start

    def timer(self, period_us, callback, hard=False):
        """Call `callback(timer)` every period in the background, the REPL alive.

        hard: in the interrupt itself, where nothing of Python delays it (has_hard()).
        """
        timer_id = self._timer_ids[self._timers % 2]
        self._timers += 1
        options = {"hard": True} if hard else {}
        return Timer(  # type: ignore[call-overload]  # the stubs forget tick_hz with a period
            timer_id,
            mode=Timer.PERIODIC,
            period=period_us,
            tick_hz=1000000,
            callback=callback,
            **options,
        )

    def data_ready(self, _period_us, callback, hard=False):
        """Call `callback(pin)` at each rising edge of the sensor's INT line."""
        return _Edges(Pin(self.int_pin, Pin.IN), callback, hard)

    def line_levels(self, pull):
        """Levels (sda, scl) of the idle bus against a weak internal pull of the board."""
        levels = []
        for number in (self.sda, self.scl):
            pin = Pin(number, Pin.IN, pull)
            time.sleep_us(50)
            levels.append(pin.value())
        return levels

    def scan(self, swapped=False):
        """Addresses that answer, bit-banged; `swapped`: as if SDA and SCL had changed places."""
        sda, scl = (self.scl, self.sda) if swapped else (self.sda, self.scl)
        return SoftI2C(scl=Pin(scl), sda=Pin(sda), freq=100000, timeout=_TIMEOUT_US).scan()

    def take(self, owner, count):
        """The first `count` output pins, for `owner` (a word) alone. ValueError where another
        has one of them, or there are not so many."""
        pins = self.outputs[:count]
        if len(pins) < count:
            raise ValueError("%s needs %d outputs, the board has %d" % (owner, count, len(pins)))
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


class _Edges:
    def __init__(self, pin, callback, hard):
        self._pin = pin
        options = {"hard": True} if hard else {}
        pin.irq(handler=callback, trigger=Pin.IRQ_RISING, **options)

    def deinit(self):
        self._pin.irq(handler=None)


def find(platform=None, name=None):
    """The Board this runs on. OSError naming what was found when it is none of the rows."""
    platform = platform or sys.platform
    name = name or sys.implementation._machine
    for row in BOARDS:
        if row[1] == platform and row[2] in name:
            return Board(row)
    raise OSError("no pins known for %s (%s): add a row to firmware/board.py" % (name, platform))


def diagnose(board, address):
    """Why the sensor does not answer: one text that names what was seen and what to check.

    Call it after the construction of the driver failed; it bit-bangs the bus, so the I2C object
    must be made anew afterwards.
    """
    wires = "SDA GP%d, SCL GP%d" % (board.sda, board.scl)
    names = ("SDA", "SCL")
    up = board.line_levels(Pin.PULL_UP)
    stuck = [names[i] for i in (0, 1) if not up[i]]
    if stuck:
        return (
            "%s held low (%s): a device hangs in a transfer or the wire touches GND. "
            "Check: take the sensor's power away for a moment; no short to GND"
            % (" and ".join(stuck), wires)
        )
    down = board.line_levels(Pin.PULL_DOWN)
    floating = [names[i] for i in (0, 1) if not down[i]]
    if floating:
        return (
            "no pull-up on %s (%s): the line follows the board's weak pull. "
            "Check: sensor's VCC and GND connected, the wire itself; a bare chip needs 4.7 kOhm "
            "from each line to 3.3 V" % (" and ".join(floating), wires)
        )
    found = board.scan()
    if address in found:
        return "address 0x%02x answers now (%s): a loose contact. Check the plugs" % (
            address,
            wires,
        )
    if found:
        return "no device at 0x%02x, found: %s (%s). Check: AD0 low is 0x68, high 0x69; %s" % (
            address,
            ", ".join("0x%02x" % a for a in found),
            wires,
            'app.set("address", ...) takes the other',
        )
    if board.scan(swapped=True):
        return "SDA and SCL are swapped: the sensor answers the other way round. Check: %s" % wires
    return (
        "both lines are high but no device answers (%s). "
        "Check: sensor's VCC and GND, CS/nCS high, the right pins; SCL is not on SDA" % wires
    )

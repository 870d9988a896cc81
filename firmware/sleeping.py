# SPDX-License-Identifier: MIT
"""The board asleep until its sensor is moved. INT wakes it, and it starts anew with main.py.

    from firmware import sleeping

    if sleeping.woke(app):          # before app.start(), which sets the sensor up anew
        ...
    sleeping.until_moved(app)       # 20 uA for the sensor; does not return

INT has to be wired to app.board.int_pin (knob pin_int). An MPU6050 proper only.
"""

import sys

import machine
from machine import Pin
from mpu6050 import motion

# IO_BANK0's DORMANT_WAKE_INTE0: four bits a pin (RP2040 datasheet 2.19.6.3, RP2350 9.11)
_DORMANT_WAKE = {"RP2040": 0x40014160, "RP2350": 0x400282D8}
_LEVEL_HIGH = 2


def until_moved(app, threshold_mg=64, hz=5):
    """Stop, let the accelerometer alone look hz times a second, and sleep deeply until it has
    moved by threshold_mg (lib/mpu6050/motion.py has the ranges).

    ValueError where the pin cannot wake this chip, or the sensor cannot; OSError.
    """
    app.stop()
    app.board.use(app.config)
    _wake_by(app.board)
    imu = app.paused(lambda imu: imu)
    motion.enable(imu, threshold_mg, 1, active_low=False)
    imu.cycle(hz)
    machine.deepsleep()


def woke(app):
    """Whether the sensor saw motion since until_moved(); asked before app.start(). OSError."""
    app.board.use(app.config)
    return motion.woke(app.board.i2c(), app.config.address)


def _wake_by(board):
    """INT's high level ends the deep sleep. ValueError where it cannot."""
    number = board.int_pin
    if number is None:
        raise ValueError("no INT pin known: set the knob pin_int")
    pin = Pin(number, Pin.IN)
    if sys.platform == "rp2":
        # machine.deepsleep() stops the crystal: such levels start it again
        place = _DORMANT_WAKE[board.row.chip] + number // 8 * 4
        machine.mem32[place] = _LEVEL_HIGH << number % 8 * 4
        return
    import esp32  # type: ignore[import-not-found,unused-ignore]

    why = "MicroPython has no such function for it"
    try:
        if hasattr(esp32, "wake_on_ext0"):
            return esp32.wake_on_ext0(pin, esp32.WAKEUP_ANY_HIGH)
        if hasattr(esp32, "wake_on_ext1"):
            return esp32.wake_on_ext1((pin,), esp32.WAKEUP_ANY_HIGH)
    except ValueError as error:
        why = "%s: set the knob pin_int to one that the RTC reaches" % error
    raise ValueError("GP%d cannot wake %s, %s" % (number, board.name, why))

# SPDX-License-Identifier: MIT
"""The `time` module of a board on the virtual clock: ticks that wrap at 2**30, sleeps, a date."""

import calendar
import time as wall
import types

PERIOD = 1 << 30
_MASK = PERIOD - 1
_HALF = PERIOD >> 1
START_BEFORE_WRAP_S = 2.0
EPOCH_START = 1_735_689_600  # 2025-01-01, the date a board without a set clock is given here


def ticks_add(ticks, delta):
    """Return `ticks + delta`, wrapped; `delta` beyond half a period is refused as on the board."""
    if not -_HALF <= delta < _HALF:
        raise OverflowError("ticks interval overflow")
    return (ticks + delta) & _MASK


def ticks_diff(end, start):
    """Return `end - start` as a signed number of ticks."""
    return ((end - start + _HALF) & _MASK) - _HALF


def make_module(clock, hard, before_wrap_s=START_BEFORE_WRAP_S, call_ns=1_000):
    """Return a `time` module; each tick read costs `call_ns`, so that a busy wait comes to its
    end.
    """
    us_offset = PERIOD - int(before_wrap_s * 1e6)
    ms_offset = PERIOD - int(before_wrap_s * 1e3)

    def ticks_us():
        clock.busy(call_ns)
        return (clock.now_ns // 1_000 + us_offset) & _MASK

    def ticks_ms():
        clock.busy(call_ns)
        return (clock.now_ns // 1_000_000 + ms_offset) & _MASK

    def sleep_ms(ms, /):
        hard.refuse("sleep_ms")
        clock.sleep(max(0, int(ms)) * 1_000_000)

    def sleep_us(us, /):
        if us <= 1000:  # a short one is a loop in C, in which no soft callback runs
            clock.busy(max(0, int(us)) * 1_000)
        else:
            clock.sleep(int(us) * 1_000)

    def sleep(seconds, /):
        hard.refuse("sleep")
        if seconds < 0:
            raise ValueError("sleep length must be non-negative")
        clock.sleep(int(seconds * 1e9))

    def now():
        hard.refuse("time.time()", MemoryError)  # a number beyond 31 bits
        return EPOCH_START + clock.now_ns // 1_000_000_000

    def gmtime(seconds=None, /):
        parts = wall.gmtime(now() if seconds is None else seconds)
        return tuple(parts)[:8]

    module = types.ModuleType("time", "MicroPython's time module on the virtual clock.")
    module.ticks_us = module.ticks_cpu = ticks_us
    module.ticks_ms, module.ticks_add, module.ticks_diff = ticks_ms, ticks_add, ticks_diff
    module.sleep, module.sleep_ms, module.sleep_us = sleep, sleep_ms, sleep_us
    module.time, module.gmtime, module.localtime = now, gmtime, gmtime
    module.time_ns = lambda: EPOCH_START * 1_000_000_000 + clock.now_ns
    module.mktime = lambda parts, /: calendar.timegm((*parts[:6], 0, 0, 0))
    return module

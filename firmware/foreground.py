# SPDX-License-Identifier: MIT
"""What is scheduled after a tick: all that may allocate, wait or raise. One door for it.

The tick schedules after() when something is due, at most once at a time; it runs between two
bytecodes of the main program. While the main program is stuck in C code nothing of this happens,
and the tick goes on predicting, steering and keeping outputs safe.

A soft tick waits while it runs, so a look is made in parts, after a tick each.
"""

import sys

from micropython import const, stack_use

from firmware import ctrl_c, wiring
from firmware.faults import policy

# places: firmware.tick.words, firmware.tick.timing
_AGE_US = const(3)
_STALE_US = const(5)
_DUE = const(12)
_WAITING = const(14)
_AGAIN = const(25)
_COUNT = const(30)
_TICKS = const(5)
_AT_REST = const(11)  # firmware.tick.estimate

# a program that is deeper in calls than so many bytes is let go on first, since a look takes up to
# 2600 and a hard tick works on the same 8 KB and wants 2560 (firmware.stack); for so long at most
_DEEP = const(2700)
_PUT_OFF_MS = const(80)
_FULL = const(4900)  # of the 8 KB of an RP2: no room for a mending or a look either
_LOOKS_HZ = const(5)  # how often a register is looked at, and the rest once a second
_CORRECT_TIMER = const(5)  # looks from one at the mean period to the next
_CORRECT_EDGES = const(1)  # the same when the sensor's clock sets the pace
# parts of a look
_REGISTER = const(0)
_LEARNING = const(1)
_CLOCK = const(2)


class Foreground:
    """The app's soft world. `app`: firmware.app.App, whose parts it calls."""

    def __init__(self, app):
        self._app = app
        self._words = app.tick.words
        self._ticks = app.tick.timing.words
        self.after = self._after  # a bound method is a heap block: made once
        self.errors = self._put_off = 0
        self.error = None
        self.wire(250, 5)

    def wire(self, rate_hz, correct_every):
        """For a loop of rate_hz that begins anew."""
        self._look_every = max(1, int(rate_hz) // _LOOKS_HZ)
        self._put_off_most = int(rate_hz) * _PUT_OFF_MS // 1000
        self._correct_every = correct_every
        self._seen = self._looked = 0
        self._looks = 0
        self._part = _REGISTER  # any other: a look is under way
        self._clock_off = False

    def _after(self, _):
        self._words[_WAITING] = 0
        try:
            if self._app.running and not self._can_wait(self._app):  # a local more: a heap block
                self._turn(self._app)  # else it was queued while the loop ended
        except KeyboardInterrupt:
            return ctrl_c.press()

    def _can_wait(self, app):
        """Whether the program is deep in calls: so deep that there is no room, or nobody waits
        for each tick. It stays due."""
        used = stack_use()
        if used > _FULL and sys.platform == "rp2":
            return True
        wait = app.tick_kind == "hard" and used > _DEEP and self._put_off < self._put_off_most
        self._put_off = self._put_off + 1 if wait else 0  # and with it a look, whoever waits
        return wait and not self._busy(app)

    def _turn(self, app):
        words, bus = self._words, app.bus
        patient, bus.patient = bus.patient, bus.hard  # a soft tick cannot run while this does
        try:
            self._work(app)
        except Exception as error:
            self.errors += 1
            if self.error is None:
                sys.print_exception(error)
            self.error = error
        finally:  # also after a Ctrl-C, which goes to whatever runs
            words[_DUE] = 1  # and so may a second one, from here on
            bus.patient = patient
            looked = self._ticks[_TICKS] - self._looked
            words[_DUE] = 1 if self._part or self._busy(app) else max(1, self._look_every - looked)

    def _busy(self, app):
        """Whether every tick is to be followed by this."""
        if app.loop.dead or self._words[_AGAIN]:
            return True
        return app.outputs.soft or app.telemetry.on or app.loop.readers or not app.mend.idle

    def _work(self, app):
        ticks = self._ticks[_TICKS]
        missed = max(0, ticks - self._seen - 1)
        self._seen = ticks
        if app.tick.error is KeyboardInterrupt:  # it came while a soft tick ran
            app.tick.error = None
            raise KeyboardInterrupt
        if app.loop.dead:
            wiring.revive(app)
        if self._words[_AGAIN]:
            app.outputs.mend()
        if not app.mend.idle:
            app.mend.run()
        if app.outputs.active:
            app.outputs.run(missed)
        if app.telemetry.on:
            app.telemetry.tick(app.tick.est, app.stale, missed + 1)
        if app.loop.readers:
            app.loop.wake()
        if self._put_off:
            return
        if self._part:
            self._look(app)
        elif ticks - self._looked >= self._look_every or ticks < self._looked:
            self._looked = ticks
            self._looks += 1
            self._look(app)

    def _look(self, app):
        """A part of what is done _LOOKS_HZ times a second: a register, temperature and bias, the
        sensor's own clock."""
        part = self._part
        self._part = 0 if part == _CLOCK else part + 1
        if part == _REGISTER:
            if app.mend.well and not app.bus.held:
                try:
                    app.mend.release()
                    if not (app.imu.check() or app.imu.recheck()):
                        app.mend.repair()
                except OSError as error:
                    app.mend.count(error)
        elif part == _LEARNING:
            second = self._looks % _LOOKS_HZ == 0
            app.learning.look(app.filter, app.tick.est[_AT_REST], second)
        elif self._looks % self._correct_every == 0:
            self._correct(app)

    def _correct(self, app):
        """The filter's period follows the measured one: the sensor's clock is no crystal."""
        mean = app.loop.recent_period_us()
        if not mean or abs(mean - app.period_us) <= 1:
            return
        nominal = app.loop.period_us
        off = abs(mean - nominal) * 200 > 3 * nominal
        if off and not self._clock_off:
            self._words[_COUNT + policy.CLOCK] += 1
        self._clock_off = off
        wiring.follow(app, mean)

# SPDX-License-Identifier: MIT
"""What the estimate drives: functions called after each step, with a safe state each.

    app.outputs.add(update, safe)               # after the tick, softly: ordinary Python
    app.outputs.add(update, safe, hard=True)    # in the tick: integers, no allocation

They are the user's, so they are isolated: an exception is counted and shown once, the loop lives.
safe() is called when the estimate is stale, when the loop stops, when update() has failed
`output_failures` times in a row, and when the function is taken away. It should allocate nothing:
the tick calls it, and only one that fails there is called again from here.
"""

import sys

from micropython import const

from firmware.tick.drive import Drive

# places: firmware.tick.words
_AGE_US = const(3)
_STALE_US = const(5)
_DUE = const(12)
_OUTPUTS = const(19)
_FAILED = const(21)
_AGAIN = const(25)
_SOFT = const(26)
_TRIES = const(3)
_UNSAFE = const(1)
_RAISED = const(2)


class Outputs:
    """Functions of one argument, the app. tick: firmware.tick.Tick, which calls the hard ones.

    active: whether there are any; soft: whether there are some to be called after the tick.
    late: how many ticks the soft ones missed because the foreground was busy.
    """

    def __init__(self, tick, app):
        self._tick, self._app = tick, app
        self._words = tick.words
        self._rows = []  # (update, safe, hard, tune), as wanted; the drive has those in effect
        self._drive = None
        self._told = []
        self.feed = self.tap = None
        self.late = 0
        self.error = None
        self.hand_over()

    @property
    def failed(self):
        """Exceptions of all of them so far."""
        return self._words[_FAILED]

    @property
    def raising(self):
        """Whether a function raised the last time it was called."""
        return any(self._drive.in_row)

    def add(self, update, safe=None, hard=False, tune=None):
        """Call `update(app)` after each step, and `safe()` whenever it can no longer steer.

        hard: it is fit for the tick (integers, no allocation; it reads app.angles_mdeg and
        app.rates_mdps only). tune(period_us): told the loop's period, now and when it changes.
        """
        for function in (update, safe or update, tune or update):
            if not callable(function):
                raise ValueError("outputs.add(update, safe): functions, not %r" % (function,))
        if tune and self._app.period_us:
            tune(self._app.period_us)
        self._rows.append((update, safe, hard, tune))
        self.hand_over()

    def remove(self, update):
        """Take a function away, its output safe. ValueError when it was never added."""
        for row in tuple(self._rows):
            if row[0] == update:
                self._rows.remove(row)
                self.hand_over()
                self._make_safe(row)
                return
        raise ValueError("not among the outputs: %s" % _name(update))

    def has(self, update):
        """Whether this function is among them."""
        for row in self._rows:
            if row[0] == update:
                return True
        return False

    def clear(self):
        """Take all functions away, their outputs safe."""
        rows, self._rows = self._rows, []
        self.hand_over()  # first: a tick may come in between, and must not drive them again
        for row in rows:
            self._make_safe(row)

    def watch(self, feed):
        """Call `feed()`, a watchdog's, after each good step in which no hard function failed."""
        self.feed = feed
        self.hand_over()

    def tune(self, period_us):
        """The loop's period has changed."""
        for row in self._drive.rows:
            if row[3]:
                row[3](period_us)

    def safe(self):
        """Put every output into its safe state: the loop stops. A Ctrl-C in it is raised after."""
        try:
            self._drive.safe()
            self.mend()
        except KeyboardInterrupt:
            self._drive.safe()
            self.mend()
            raise

    def run(self, missed):
        """After a tick: the soft functions, with the newest estimate; `missed` ticks had none."""
        self.mend()
        words, drive = self._words, self._drive
        words[_SOFT] = 0
        if words[_AGE_US] >= words[_STALE_US]:
            return
        for i, row in enumerate(drive.rows):
            if row[2]:
                continue
            self.late += missed
            try:
                row[0](self._app)
                drive.in_row[i] = 0
            except Exception as error:
                self._show(row[0], error)
                drive.failed(i, error.__class__)
            if self._drive is not drive:  # the function changed them; the next tick has the new
                self._drive.take_state(drive)
                return

    def mend(self):
        """Call again each safe() that failed in the tick, and name what raised there."""
        drive = self._drive
        self._words[_AGAIN] = 0
        for i, row in enumerate(drive.rows):
            if drive.flags[i] & _UNSAFE:
                drive.flags[i] &= ~_UNSAFE
                self._make_safe(row)
            if drive.flags[i] & _RAISED:
                drive.flags[i] &= ~_RAISED
                self._show(row[0], drive.kinds[i])

    def _make_safe(self, row):
        """Its safe(), again where it fails: nothing is left between here and the motor."""
        tries = _TRIES if row[1] else 0
        while tries:
            tries -= 1
            try:
                row[1]()
                return
            except Exception as error:
                self._words[_FAILED] += 1
                print("%s raised%s:" % (_name(row[1]), "" if tries else ", and is not safe"))
                sys.print_exception(error)

    def _show(self, update, error):
        """Once for each function."""
        self.error = error
        if update in self._told:
            return
        self._told.append(update)
        print("output %s raised:" % _name(update))
        if isinstance(error, Exception):
            sys.print_exception(error)
        else:
            print(error.__name__, "in the tick; app.outputs counts on")

    def hand_over(self):
        """Give the tick what is wanted, all at once, whatever runs in between.

        Scheduled work may come in, work with the drive that is in effect, and change the outputs
        itself: then what it wanted is here too, but not yet in the drive.
        """
        while True:
            rows = tuple(self._rows)
            old = self._drive
            self._drive = made = Drive(self._words, self._app, rows, self.feed)
            self.active = bool(rows)
            self.soft = any(not row[2] for row in rows)
            drive = made.tick if rows or self.feed else None
            if self.tap:  # firmware.stream's
                drive = self.tap(drive)
            self._tick.drive = drive or made.tick
            if old:
                made.take_state(old)  # now that it knows all: also a tick of the meantime
            self._words[_OUTPUTS] = 1 if drive else 0
            self._words[_DUE] = 0  # the foreground is wanted after each tick from now on
            if rows == tuple(self._rows):
                return


def _name(function):
    """The function's name, with its class where it is a method."""
    owner = getattr(function, "__self__", None)
    name = getattr(function, "__name__", None) or str(function)
    return name if owner is None else "%s.%s" % (type(owner).__name__, name)

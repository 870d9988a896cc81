# SPDX-License-Identifier: MIT
"""`machine.Timer`: re-armed from the scheduled instant, soft unless the port and version know hard
ones.
"""

import weakref

ONE_SHOT, PERIODIC = 0, 1


class Timer:
    """Common part; `delta_ns` between expiries, `ticks` counts them."""

    _port = None
    _numbered = None  # per Port: esp32 id -> timer
    ONE_SHOT, PERIODIC = ONE_SHOT, PERIODIC

    def _setup(self):
        self._event, self._callback, self._hard, self.ticks = None, None, False, 0

    def init(
        self, *, mode=PERIODIC, callback=None, period=None, tick_hz=1000, freq=None, **options
    ):
        """`period` in 1/`tick_hz` seconds (whole number), or `freq` in hertz."""
        hard = self._hard_option(options)
        if options:
            raise TypeError("extra keyword arguments given")
        if period is not None and not isinstance(period, int):
            raise TypeError("can't convert %s to int" % type(period).__name__)
        self.deinit()
        units = self._units_per_s
        if freq is not None:
            count = int(units / freq)
        else:
            count = (0xFFFFFFFF if period is None else period) * units // tick_hz
        self._delta_ns = max(1, count) * (1_000_000_000 // units)
        self._mode, self._callback, self._hard = mode, callback, hard
        self._arm(self._port.clock.now_ns + self._delta_ns)

    def _action(self):
        return self._expire

    def deinit(self):
        """Stop; what is in the queue already still runs, as on the board."""
        if self._event is not None:
            self._event.cancel()
            self._event = None

    def _arm(self, t_ns):
        self._due_ns = t_ns
        self._event = self._port.clock.at(t_ns, self._action())

    def _expire(self):
        self.ticks += 1
        if self._mode == PERIODIC:
            self._arm(self._due_ns + self._delta_ns)
        else:
            self._event = None
        if not self._hard:  # also without a callback, which then is a TypeError each time
            self._port.clock.scheduler.offer(self._callback, self)
        elif not self._port.hard.call(
            self._callback, self, "uncaught exception in timer callback"
        ):
            self.deinit()


class Rp2Timer(Timer):
    """Id -1 only, microseconds; `hard=` since 1.26.

    A timer that the program does not keep ends when it is collected, here at once.
    """

    _units_per_s = 1_000_000

    def __init__(self, id=-1, **settings):
        self._event = None
        if id != -1:
            raise ValueError("Timer doesn't exist")
        self._port.hard.refuse("a new Timer", MemoryError)
        self._setup()
        if settings:
            self.init(**settings)

    def _action(self):
        method = weakref.WeakMethod(self._expire)
        return lambda: method()()

    def __del__(self):
        self.deinit()

    def _hard_option(self, options):
        return bool(options.pop("hard", False)) if self._port.version >= (1, 26) else False

    def __repr__(self):
        mode = "PERIODIC" if self._mode else "ONE_SHOT"
        return "Timer(mode=%s, tick_hz=1000000, period=%d)" % (mode, self._delta_ns // 1000)


class Esp32Timer(Timer):
    """A hardware id; one object for each; a tenth of a microsecond; never hard."""

    _units_per_s = 10_000_000

    def __new__(cls, id, **settings):
        if id not in cls._port.traits.timer_ids:
            raise ValueError("invalid Timer number")
        timer = cls._numbered.get(id)
        if timer is None:
            timer = cls._numbered[id] = object.__new__(cls)
            timer._id = id
            timer._setup()
        return timer

    def __init__(self, id, **settings):
        if settings:
            self.init(**settings)

    def _hard_option(self, options):
        if self._port.version >= (1, 27) and options.pop("hard", False):
            raise ValueError("hard Timers are not implemented")
        return False

    def __repr__(self):
        mode = "PERIODIC" if self._mode else "ONE_SHOT"
        return "Timer(%d, mode=%s, period=%d)" % (self._id, mode, self._delta_ns // 1_000_000)

    def value(self):
        """Milliseconds since the last expiry."""
        last_ns = self._due_ns - self._delta_ns
        return (self._port.clock.now_ns - last_ns) // 1_000_000

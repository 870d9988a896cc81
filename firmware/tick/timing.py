# SPDX-License-Identifier: MIT
"""The accounts of a loop's timing: period, lateness, duration, lost ticks; no allocation.

Everything is int32 in two arrays, kept by one viper function; statistics are made on demand.
"""

from array import array

import micropython
from micropython import const

# The accounts, an array of int32. All times are microseconds.
_RUNNING = const(0)
_GRID = const(1)  # 1: a timer with a grid of its own; 0: edges of the sensor's clock
_PERIOD = const(2)
_DEADLINE = const(3)
_LAST = const(4)  # when the last accepted tick began
_TICKS = const(5)
_LOST = const(6)
_EXTRA = const(7)  # calls that came too early: queued during a stall, already counted as lost
_OVERRUNS = const(8)
_TOOK = const(9)  # duration of the last step, -1 before the first; counted a tick later
_DT_MIN = const(10)
_DT_MAX = const(11)
_LATE_MAX = const(12)
_TOOK_MAX = const(13)
_SUM = const(14)  # of the periods of the window that runs
_COUNT = const(15)
_MEAN256 = const(16)  # sum of the 256 periods of the last whole window; 0 before
_EARLIEST = const(17)  # least lateness in the window that runs
_MARK = const(18)  # _LAST and _TICKS + _LOST when recent_period_us() was asked last
_MARK_TICKS = const(19)
_WRAPS = const(20)  # how often ticks_us began anew
_CATCH = const(21)  # calls that a timer still makes up for after a stall, back to back
_WORDS = const(22)

# Histograms, log-linear, 8 bins per octave, exact below 16 us, up to 2^20 us.
_BINS = const(144)
_WINDOW = const(256)
_FAR = const(1 << 29)


@micropython.viper
def account(words: ptr32, bins: ptr32, now: int) -> int:
    """Account for a tick at `now`. Returns the microseconds since the last one, 0 to skip it.

    Tick differences are taken modulo 2^30, the period of ticks_us on both ports.
    """
    if words[_RUNNING] == 0:
        return 0
    period = words[_PERIOD]
    dt = ((now - words[_LAST] + 0x20000000) & 0x3FFFFFFF) - 0x20000000
    late = 0
    lost = 0
    if words[_GRID]:
        late = ((now - words[_DEADLINE] + 0x20000000) & 0x3FFFFFFF) - 0x20000000
        if late < 0 or words[_TICKS] == 0:
            if words[_TICKS] and (dt < (period >> 1) or words[_CATCH]):
                if words[_CATCH]:
                    words[_CATCH] -= 1
                words[_EXTRA] += 1
                return 0
            words[_DEADLINE] = now  # no timer is early: the grid was late
            late = 0
        if words[_CATCH]:
            words[_CATCH] -= 1
        if late >= period:
            lost = late // period
            late -= lost * period
            words[_CATCH] = lost
        words[_DEADLINE] = (words[_DEADLINE] + (lost + 1) * period) & 0x3FFFFFFF
        if late < words[_EARLIEST]:
            words[_EARLIEST] = late
    else:
        if words[_TICKS] and dt < (period >> 1):
            words[_EXTRA] += 1
            return 0
        lost = (dt + (period >> 1)) // period - 1
        if lost < 0:
            lost = 0
    took = words[_TOOK]
    if took > words[_TOOK_MAX]:
        words[_TOOK_MAX] = took
    if took > period:
        words[_OVERRUNS] += 1
    if now < words[_LAST]:
        words[_WRAPS] += 1
    words[_LAST] = now
    if words[_TICKS] == 0:
        words[_TICKS] = 1
        if dt < period + (period >> 1):
            dt = period  # the first comes when it comes, but it may come after a pause
        return dt
    words[_TICKS] += 1
    words[_LOST] += lost
    if dt < words[_DT_MIN]:
        words[_DT_MIN] = dt
    if dt > words[_DT_MAX]:
        words[_DT_MAX] = dt
    if late > words[_LATE_MAX]:
        words[_LATE_MAX] = late
    if lost == 0:
        words[_SUM] += dt
        words[_COUNT] += 1
    # the window: its mean period, and the grid follows its earliest tick
    if words[_COUNT] == _WINDOW:
        words[_MEAN256] = words[_SUM]
        words[_SUM] = 0
        words[_COUNT] = 0
        words[_DEADLINE] = (words[_DEADLINE] + words[_EARLIEST]) & 0x3FFFFFFF
        words[_EARLIEST] = _FAR
    # three histograms: |dt - period|, lateness, duration of the last step
    which = 0
    while which < 3:
        value = dt - period
        if value < 0:
            value = 0 - value
        if which == 1:
            value = late if late > 0 else 0
        if which == 2:
            value = took
        if value >= 0:
            shift = 0
            while (value >> shift) > 15:
                shift += 1
            index = 8 * shift + (value >> shift)
            if index >= _BINS:
                index = _BINS - 1
            bins[_BINS * which + index] += 1
        which += 1
    return dt


class Timing:
    """The accounts of one loop. `words` and `bins` are for account()."""

    def __init__(self):
        self.words = array("i", [0] * _WORDS)
        self.bins = array("i", [0] * (3 * _BINS))

    @property
    def running(self):
        return self.words[_RUNNING] == 1

    def clear(self):
        """Forget all but when the last tick was; too slow to be done while a timer runs."""
        last = self.words[_LAST]
        for i in range(_WORDS):
            self.words[i] = 0
        self.words[_LAST] = last
        for i in range(3 * _BINS):
            self.bins[i] = 0

    def start(self, period_us, grid, now):
        """Begin, cleared: period in microseconds, grid as in Loop, from `now` (ticks_us).

        The first tick's time counts from the last one, that of a start before or of follow().
        Quick, so that no tick of a timer just made is missed.
        """
        words = self.words
        words[_GRID] = 1 if grid else 0
        words[_PERIOD] = period_us
        words[_TOOK] = -1
        words[_DT_MIN] = words[_EARLIEST] = _FAR
        words[_DEADLINE] = (now + period_us) & (2 * _FAR - 1)
        words[_RUNNING] = 1

    def stop(self):
        """From now on account() skips every call."""
        self.words[_RUNNING] = 0

    def follow(self, now):
        """There was a sample at `now` (ticks_us) before the first tick."""
        self.words[_LAST] = now

    def last_us(self):
        """Instant of the last accepted tick, of ticks_us."""
        return self.words[_LAST]

    def recent_period_us(self):
        """Mean period since the last call, rounded, in microseconds; 0 when there was none."""
        words = self.words
        ticks = words[_TICKS] + words[_LOST]
        count = ticks - words[_MARK_TICKS]
        passed = (words[_LAST] - words[_MARK] + _FAR & 2 * _FAR - 1) - _FAR
        known = words[_MARK_TICKS]
        words[_MARK] = words[_LAST]
        words[_MARK_TICKS] = ticks
        return (passed + (count >> 1)) // count if known and count > 0 and passed > 0 else 0

    def stats(self):
        """Timing so far as a dict; quantiles are upper bounds of bins about 12 % wide."""
        words = self.words
        seen = words[_TICKS] > 1
        mean = words[_MEAN256] / _WINDOW
        if not mean and words[_COUNT]:
            mean = words[_SUM] / words[_COUNT]
        out = {
            "running": self.running,
            "ticks": words[_TICKS],
            "lost": words[_LOST],
            "overruns": words[_OVERRUNS],
            "skipped_calls": words[_EXTRA],
            "tick_wraps": words[_WRAPS],
            "period_us": words[_PERIOD],
            "period_mean_us": mean,
            "period_min_us": words[_DT_MIN] if seen else 0,
            "period_max_us": words[_DT_MAX],
        }
        tops = [0, words[_LATE_MAX], words[_TOOK_MAX]]
        if seen:
            tops[0] = max(words[_DT_MAX] - words[_PERIOD], words[_PERIOD] - words[_DT_MIN])
        for which, name in enumerate(("jitter", "late", "step")):
            out[name + "_p50_us"] = min(tops[which], self._quantile(which, 50))
            out[name + "_p99_us"] = min(tops[which], self._quantile(which, 99))
            out[name + "_max_us"] = tops[which]
        return out

    def _quantile(self, which, percent):
        bins = self.bins
        first = _BINS * which
        need = (sum(bins[i] for i in range(first, first + _BINS)) * percent + 99) // 100
        if not need:
            return 0
        for i in range(_BINS):
            need -= bins[first + i]
            if need <= 0:
                break
        shift = max(0, (i - 8) // 8)
        return ((i - 8 * shift + 1) << shift) - 1

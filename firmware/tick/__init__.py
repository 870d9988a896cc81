# SPDX-License-Identifier: MIT
"""What an interrupt runs: the burst begun, and a tick later taken, judged, filtered, published.

    lead: begin()   ->   tick: run(): poll -> judge -> filter -> estimate -> hard outputs
                                        |-> no good sample: predict          -> foreground, softly

On RP2 with MicroPython 1.26 this is a hard interrupt, elsewhere a soft callback; the code is the
same. It allocates nothing, waits for nothing, raises nothing, mends nothing. All on its path is
native or viper code; what it works with are default arguments, bound in the foreground by
wire(), since a closure of more than four names is itself an allocation and a global's dictionary
may grow under it. What has no decorator is set-up.
"""

import time

import micropython
from micropython import const

from firmware.tick import estimate, judge, words
from firmware.tick.gap import Gap
from firmware.tick.timing import Timing, account

# places: firmware.tick.words
_ODD = const(0)
_CAUSE = const(1)
_IN_ROW = const(2)
_AGE_US = const(3)
_PREDICTED = const(4)
_UNUSED_US = const(6)
_RING_US = const(7)
_SURE = const(8)
_FORGET = const(9)
_SWAP = const(10)
_ZERO_YAW = const(11)
_DUE = const(12)
_LATE_US = const(13)
_WAITING = const(14)
_FROM_US = const(15)
_UNSURE_US = const(16)
_YAW_LOST = const(17)
_OUTPUTS = const(19)
_ERRORS = const(20)
_BUSY_TICKS = const(23)
_PAUSE = const(24)
_YAW_DOUBT = const(28)
_COUNT = const(30)
# and of the accounts of firmware.tick.timing, of the estimate
_RUNNING = const(0)
_TOOK = const(9)
_EST_UNCERTAIN = const(12)
_EST_YAW = const(4)
_EST_TURNS = const(15)
_EST_DOUBT = const(16)

# causes that are places in firmware.faults.policy's table, and two that are no fault
_NACK = const(1)
_TIMEOUT = const(2)
_FROZEN = const(4)
_JUMP = const(5)
_SATURATED = const(6)
_LATE = const(10)  # nothing of now: the burst is under way, or older than a pause
_BUSY = const(11)  # the bus is taken, or what it brings is not used yet

_LONG_WAY = const(4)  # of what words.begun() tells

_CLAIM_US = const(100000)  # a swing has turned back by then: a prediction is no claim any more
_SLOW_US = const(8000)  # a transfer on a stuck bus, where the port waits for it
_FIRST = const(2)
_AGE_MAX_US = const(1000000000)  # a small int for ever
_SHORT_US = const(15000)  # in a gap shorter no chip loses its settings, no push makes a leap
_WRAP = const(0x3FFFFFFF)


class Tick:
    """One sensor's tick. Attributes that the foreground may use:

    est: firmware.tick.estimate's words; words: firmware.tick.words; timing: the accounts;
    now: (update, out, filter, swap, predictable), replaced whole by use(); drive: the hard
    outputs' function, or None; after: called softly when it is due; begin, run: for the sources;
    mask: its bit among those that wait for the bus.
    """

    def __init__(self, mask=1):
        self.mask = mask
        self.est = estimate.words()
        self.words = words.make()
        self.timing = Timing()
        self.memory = judge.memory()
        self.gap = Gap(self.words)
        self.now = self.drive = self.error = self.after = None
        self.begin = self.run = self.step = self._lost = self._odd = None

    def use(self, filter):
        """Work with this filter from the next tick on; it already stands where it shall go on."""
        filter.keep()
        self.words[_FROM_US] = self.words[_AGE_US]  # what was predicted is in its state
        self.now = (filter.update if filter.timed else filter.step, filter.out, filter,
                    filter.swap)  # fmt: skip

    def wire(self, imu, bus, period_us, timed, lead_us=0, hard=False):
        """Make begin() and run() for this driver, firmware.bus.Bus, period and kind of filter.

        timed: the filter's update takes the time as well. lead_us: how long before run() begin()
        starts a burst, 0: not at all, a whole period: run() does. One older than that and half a
        period is not of now. hard: others are, and come in between this soft one.
        """
        lock, start = bus.words, imu.start
        self.words[_LATE_US] = late_us = period_us + (period_us >> 1)
        imu.expire(lead_us + (period_us >> 1) if lead_us else 1 << 29)
        self.drive = self.drive or _nothing
        burst = _burst(imu, bus, lead_us, period_us)
        if hard:
            from firmware.tick.holding import wire

            start, poll = wire(lock, start, burst[0])
            burst = (poll,) + burst[1:]
        self._lost = self._make_lost()
        self._odd = self._make_odd(imu, lock, start, burst, period_us, timed, late_us)
        self.step = self._make_step(imu, lock, burst, timed)
        self.run = self._make_run()
        self.begin = self._make_begin(start, lock)

    def _make_begin(self, start, lock):
        @micropython.native
        def begin(
            _source,
            timing=self.timing.words,
            lock=lock,
            mask=self.mask,
            start=start,
            words=self.words,
        ):
            if timing[_RUNNING]:
                if lock[0]:
                    lock[1] |= mask  # the next holder lets it go first
                    return
                try:
                    start()
                except BaseException:
                    words[_ERRORS] += 1

        return begin

    def _make_run(self):
        @micropython.native
        def run(
            _source,
            tick=self,
            timing=self.timing.words,
            bins=self.timing.bins,
            words=self.words,
            account=account,
            ticks_us=time.ticks_us,
            step=self.step,
        ):
            now = ticks_us()
            dt_us = account(timing, bins, now)
            if dt_us:
                try:
                    step(dt_us, now)
                except BaseException as error:  # nothing may leave: the timer would be dead
                    words[_ODD] = 1
                    tick.raised(error)
                    tick._went_without(dt_us)
                took = (ticks_us() - now) & _WRAP
                timing[_TOOK] = took
                if took > _SLOW_US and words[_WAITING]:
                    words[_WAITING] = _FIRST

        return run

    @micropython.native
    def raised(self, error):
        """Keep what kind it was. A Ctrl-C is no error: the foreground gives it to the program."""
        self.error = error.__class__
        if self.error is not KeyboardInterrupt:
            self.words[_ERRORS] += 1
        self.words[_DUE] = 0

    @micropython.native
    def _went_without(self, dt_us):
        """A step raised: it is as if there had been no sample."""
        words = self.words
        if words[_AGE_US] < _AGE_MAX_US:
            words[_AGE_US] += dt_us
        try:
            self.drive(0)
            if words[_DUE] > 0:
                words[_DUE] -= 1
            self._call_after()
        except BaseException:
            words[_ERRORS] += 1

    def _make_step(self, imu, lock, burst, timed):
        poll, first, second, rest = burst

        @micropython.native
        def step(
            dt_us,
            now,
            tick=self,
            own=self.words,
            lock=lock,
            mask=self.mask,
            timed=timed,
            poll=poll,
            first=first,
            second=second,
            rest=rest,
            judge=judge.judge,
            counts=imu.counts,
            memory=self.memory,
            publish=estimate.publish,
            est=self.est,
            begun=words.begun,
        ):
            more = begun(own, lock, dt_us, est)
            if more >= _LONG_WAY:
                fresh = tick._odd(dt_us, now)
            else:
                fresh = poll(first, second, rest)
                if fresh == 1:
                    cause = judge(counts, memory)
                    if cause:
                        fresh = tick._lost(cause, dt_us, now)
                    else:
                        use = tick.now
                        if timed:
                            use[0](counts, dt_us)
                        else:
                            use[0](counts)
                        publish(est, use[1], memory, now)
                elif lock[1] & mask and not fresh:
                    fresh = tick._lost(_BUSY, dt_us, now)  # the burst could not begin
                else:
                    fresh = tick._lost(cause_of(fresh), dt_us, now)
            if more or not fresh:
                if own[_OUTPUTS]:
                    tick.drive(fresh)
                if own[_DUE] <= 0:
                    tick._call_after()

        return step

    def _make_lost(self):
        @micropython.native
        def lost(
            cause,
            dt_us,
            now,
            tick=self,
            words=self.words,
            est=self.est,
            publish=estimate.publish_predicted,
        ):
            """A tick without a good sample: counted, predicted; 0."""
            use = tick.now
            age_us = words[_AGE_US]
            paused = words[_PAUSE]
            if not age_us and not paused:
                tick.gap.open(use[2], tick.memory)
            if age_us < _AGE_MAX_US:
                age_us += dt_us
                words[_AGE_US] = age_us
            if cause < _LATE:
                if cause != words[_CAUSE]:
                    words[_CAUSE] = cause
                    words[_IN_ROW] = 0
                if cause <= _FROZEN:
                    words[_SURE] = 0
                elif cause == _SATURATED:
                    words[_UNUSED_US] = words[_RING_US]
                    est[_EST_UNCERTAIN] |= 1
                    tick.gap.beyond(tick.memory)
                words[_COUNT + cause] += 1
                words[_DUE] = 0
            elif cause == _BUSY:
                words[_BUSY_TICKS] += 1
            words[_IN_ROW] += 1
            words[_PREDICTED] += 1
            words[_ODD] = 1
            if not paused:
                tick.gap.predict(use[2], age_us)
            if age_us > _CLAIM_US:
                est[_EST_UNCERTAIN] |= 1
            publish(est, use[1], age_us, now)
            return 0

        return lost

    def _make_odd(self, imu, lock, start, burst, period_us, timed, late_us):
        poll, first, second, rest = burst

        @micropython.native
        def odd(
            dt_us,
            now,
            tick=self,
            words=self.words,
            lock=lock,
            mask=self.mask,
            start=start,
            late_us=late_us,
            period_us=period_us,
            timed=timed,
            poll=poll,
            first=first,
            second=second,
            rest=rest,
            counts=imu.counts,
            memory=self.memory,
        ):
            """The long way of a tick: after and in gaps, and where the foreground asks for
            something. 1 with a good sample."""
            use = tick.now
            if words[_DUE] <= 0:  # where each poll ends in a timeout soft ticks fill the queue:
                tick._call_after()  # there is room before it, and none after
            unused_us = words[_UNUSED_US]
            if unused_us:  # that time passes whatever this tick brings
                words[_UNUSED_US] = unused_us - dt_us if unused_us > dt_us else 0
                words[_FORGET] = 1
            if words[_PAUSE]:
                return tick._lost(_BUSY, dt_us, now)
            words[_ODD] = 0
            if words[_WAITING] == _FIRST:  # soft ticks queue up in front of it, each as slow
                return tick._lost(_BUSY, dt_us, now)
            if words[_SWAP]:
                use[3]()
                words[_SWAP] = 0
            if words[_ZERO_YAW]:
                tick.gap.zero_yaw(use[2])
                tick.est[_EST_YAW] = tick.est[_EST_TURNS] = 0
                words[_ZERO_YAW] = words[_YAW_LOST] = words[_YAW_DOUBT] = 0
            if not words[_AGE_US]:
                tick.gap.open(use[2], memory)
            if lock[0]:
                lock[1] |= mask
                return tick._lost(_BUSY, dt_us, now)
            turned_away = lock[1] & mask
            cause = poll(first, second, rest)
            if not cause and words[_AGE_US] > _SHORT_US:  # something in step holds each up
                start()
                cause = poll(first, second, rest)
            if cause and turned_away:  # else there was no burst yet, and it still goes first
                lock[1] ^= mask
            if cause != 1:
                cause = _BUSY if turned_away and not cause else cause_of(cause)
                return tick._lost(cause, dt_us, now)
            if unused_us:
                return tick._settle(counts, dt_us, now)
            if words[_FORGET]:
                judge.forget(memory)
                words[_FORGET] = 0
            cause = judge.judge(counts, memory)
            gap_us = words[_AGE_US] + dt_us
            if cause:
                if cause == _JUMP and gap_us - period_us > _SHORT_US:
                    cause = _LATE  # it may have turned meanwhile: the next one tells, no fault
                return tick._lost(cause, dt_us, now)
            if not words[_SURE]:
                if words[_AGE_US] > _SHORT_US:
                    words[_CAUSE] = _BUSY  # the foreground looks at the chip's registers first
                    words[_DUE] = 0
                    return tick._lost(_BUSY, dt_us, now)
                words[_SURE] = 1
            left_us = gap_us
            if gap_us > late_us:
                left_us = tick.gap.close(use[2], counts, gap_us, period_us)
            if timed:
                use[0](counts, min(left_us, 250000))
            else:
                use[0](counts)
            words[_AGE_US] = words[_IN_ROW] = 0
            if gap_us > late_us:
                tick.gap.closed(use[2], gap_us)
            # what closed() has found out since the tick began
            tick.est[_EST_DOUBT] = words[_YAW_LOST] << 1 | (1 if words[_UNSURE_US] else 0)
            estimate.publish(tick.est, use[1], memory, now)
            return 1

        return odd

    @micropython.native
    def _settle(self, counts, dt_us, now):
        """The chip answers, but its low-pass or its start-up still shows what was."""
        words = self.words
        if judge.saturated(counts):
            words[_COUNT + _SATURATED] += 1
            if words[_UNUSED_US] < words[_RING_US]:
                words[_UNUSED_US] = words[_RING_US]
        return self._lost(_BUSY, dt_us, now)

    @micropython.native
    def _call_after(self):
        """Let the foreground run, once; where the queue is full the next tick tries again."""
        words = self.words
        if not words[_WAITING]:
            words[_WAITING] = 1
            try:
                micropython.schedule(self.after, 0)
            except RuntimeError:
                words[_WAITING] = 0


def _burst(imu, bus, lead_us, period_us):
    """What brings a burst: a function and its three arguments, as a driver's `burst`."""
    if lead_us == period_us:
        return _polls_and_starts, imu.poll, imu.start, None
    if lead_us and imu.burst:
        return imu.burst
    if lead_us:
        return polled, imu.poll, None, None
    return polled, imu.fetch, None if imu.split else bus, None


@micropython.native
def _polls_and_starts(poll, start, rest):
    """The burst that has arrived, and the next one begun."""
    got = poll()
    start()  # while one is under way it does nothing
    return got


@micropython.native
def polled(poll, bus, rest):
    """The burst of a driver without a cheaper way to it; with a bus after that of another sensor
    on the same wires, of which this driver knows nothing."""
    if bus:
        bus.finish()
    return poll()


@micropython.native
def cause_of(got):
    """The cause of a poll() that brought no sample."""
    if not got:
        return _LATE
    if got == -110 or got == -116:  # ETIMEDOUT on rp2, on esp32
        return _TIMEOUT
    return _NACK


@micropython.native
def _nothing(_fresh):
    """drive() without outputs."""

# SPDX-License-Identifier: MIT
"""The fixed-period loop: its grid, its accounts, its exceptions, on both personalities."""

import random
import time
from itertools import pairwise

import pytest

from host_tests.firmware.test_gaps import BOARDS, Rig
from tools.virtual.motion import Still
from tools.virtual.port import Port

WRAP = 1 << 30  # ticks_us on a 32-bit MicroPython
DUE, ERRORS = 12, 20  # places of firmware.tick.words

board = pytest.mark.parametrize("platform", ["rp2", "esp32"])


class Source:
    """A tick source that the test pulls by hand."""

    def __init__(self, period_us, callback):
        self.period_us, self.callback, self.ended = period_us, callback, False

    def deinit(self):
        self.ended = True


class Time:
    """`time` with the test's clock."""

    def __init__(self, clock):
        self.ticks_us = clock

    @staticmethod
    def ticks_diff(a, b):
        return (a - b + WRAP // 2) % WRAP - WRAP // 2

    @staticmethod
    def sleep_us(us):
        pass


def ticking(step):
    """A Tick whose step is the test's, called with dt_us."""
    from firmware.tick import Tick

    tick = Tick()
    tick.step = lambda dt_us, now: step(dt_us)
    tick.drive = lambda fresh: None
    tick.words[DUE] = 1 << 20  # nobody in the foreground
    tick.begin = lambda source: None
    tick.run = tick._make_run()
    return tick


def make_loop(step, clock, **settings):
    """(loop, its sources) with `clock()` in place of ticks_us."""
    from firmware import loop as loops
    from firmware import tick as ticks

    loops.time = ticks.time = Time(clock)
    sources = []

    def source(period_us, callback):
        sources.append(Source(period_us, callback))
        return sources[-1]

    return loops.Loop(ticking(step), source, **settings), sources


@pytest.fixture
def port():
    with Port("rp2") as virtual:
        yield virtual


@board
def test_a_million_ticks_over_several_wraps_do_not_drift(platform):
    with Port(platform):
        from firmware.tick import timing

        plain = timing.account.__wrapped__  # the same code, unchecked: a hundred times faster
        period, ticks = 4000, 1_000_000 if platform == "rp2" else 100_000
        accounts = timing.Timing()
        words, bins = accounts.words, accounts.bins
        start = WRAP - 123_456
        accounts.start(period, True, start)
        late = random.Random(1).choices((3, 3, 3, 4, 5, 40, 900), k=1000)
        last = start
        for k in range(1, ticks + 1):
            now = start + k * period + late[k % 1000]
            account = timing.account if k % 1000 == 0 else plain
            dt = account(words, bins, now % WRAP)
            if k == 1:
                assert dt == period  # the first one has no tick before it
            else:
                assert dt == now - last
            last = now
        stats = accounts.stats()
        assert stats["ticks"] == ticks
        assert (stats["lost"], stats["skipped_calls"], stats["overruns"]) == (0, 0, 0)
        assert stats["late_max_us"] == 900 - 3  # the grid is that of the earliest ticks
        assert stats["period_mean_us"] == pytest.approx(period, abs=0.02 * period / 4)
        # the deadline is still on the grid that the timer began with
        ahead = (words[timing._DEADLINE] - (start + 3)) % WRAP
        assert ahead == (ticks + 1) * period % WRAP


def test_every_quantile_of_a_known_distribution_is_in_its_bin(port):
    from firmware.tick.timing import Timing, account

    accounts = Timing()
    accounts.start(1000, True, 0)
    now = 0
    for k in range(1, 1001):
        now = k * 1000 + (100 if k % 20 == 0 else 0)
        account(accounts.words, accounts.bins, now)
    stats = accounts.stats()
    assert stats["late_max_us"] == 100
    assert stats["late_p50_us"] == 0
    assert 100 <= stats["late_p99_us"] <= 113  # 5 % are 100 us late
    assert stats["jitter_max_us"] == 100
    assert stats["period_min_us"] == 900 and stats["period_max_us"] == 1100


def test_a_stall_is_skipped_and_counted_and_never_made_up_for_by_a_burst(port):
    now = [0]
    seen = []
    loop, sources = make_loop(seen.append, lambda: now[0])
    loop.start()
    for k in (1, 2, 3):
        now[0] = k * 4000
        sources[0].callback(None)
    now[0] = 3 * 4000 + 4000 * 5 + 700  # ticks 4 to 8 are due; the queue held them
    for _ in range(5):
        sources[0].callback(None)
        now[0] += 10
    now[0] = 9 * 4000
    sources[0].callback(None)
    assert seen == [4000, 4000, 4000, 20700, 3300]
    stats = loop.stats()
    assert (stats["ticks"], stats["lost"], stats["skipped_calls"]) == (5, 4, 4)
    assert stats["late_max_us"] == 700


def test_a_long_step_is_an_overrun_and_the_grid_stays(port):
    now = [0]
    loop, sources = make_loop(lambda dt: now.__setitem__(0, now[0] + 4500), lambda: now[0])
    loop.start()
    for k in (1, 3, 5):
        now[0] = k * 4000
        sources[0].callback(None)
    stats = loop.stats()
    assert stats["overruns"] == 2  # the third is counted with the next tick
    assert stats["lost"] == 2
    assert stats["step_max_us"] == 4500


def test_an_exception_in_the_step_never_leaves_the_timer(port):
    now = [0]

    def fails(dt):
        raise ValueError("in the step")

    loop, sources = make_loop(fails, lambda: now[0])
    loop.start()
    for k in range(1, 4):
        now[0] = k * 4000
        sources[0].callback(None)
    assert loop._tick.words[ERRORS] == 3
    assert loop._tick.error is ValueError
    assert loop.running


def test_stop_ends_all_sources_and_a_queued_call_does_nothing(port):
    now = [0]
    seen = []
    loop, sources = make_loop(seen.append, lambda: now[0], lead_us=450)
    loop.start()
    assert [s.period_us for s in sources] == [4000, 4000]
    now[0] = 4000
    sources[1].callback(None)
    loop.stop()
    assert all(s.ended for s in sources)
    sources[1].callback(None)
    sources[0].callback(None)
    assert seen == [4000] and not loop.running
    loop.start()
    assert loop.stats()["ticks"] == 0
    now[0] = 8000
    sources[-1].callback(None)
    assert seen == [4000, 4000]


def test_the_sensors_edges_set_the_pace_and_a_dead_line_is_ticked_by_the_guard(port):
    now = [0]
    seen = []
    guards = []

    def guard(period_us, callback):
        guards.append(Source(period_us, callback))
        return guards[-1]

    loop, sources = make_loop(seen.append, lambda: now[0], grid=False, guard=guard)
    loop.start()
    for k in range(1, 1000):
        now[0] = k * 3960  # the chip's clock is 1 % fast
        sources[0].callback(None)
        guards[0].callback(None)
    assert set(seen[1:]) == {3960}
    assert loop.recent_period_us() == 0  # since when is not known
    for k in range(1000, 1032):
        now[0] = k * 3960
        sources[0].callback(None)
    assert loop.recent_period_us() == 3960
    assert loop.stats()["edges_missing"] == 0
    for _ in range(3):  # INT is cut
        now[0] += 8000
        guards[0].callback(None)
        now[0] += 8000
        guards[0].callback(None)
    stats = loop.stats()
    assert stats["edges_missing"] == 6
    assert stats["lost"] == 6  # every second one


@pytest.mark.parametrize("rate_hz", [79, 1001, 0])
def test_rates_out_of_range_are_refused(port, rate_hz):
    from firmware.loop import Loop

    with pytest.raises(ValueError, match="80 to 1000"):
        Loop(ticking(print), None, rate_hz)


@board
@pytest.mark.parametrize("rate_hz", [80, 250, 333, 1000])
def test_the_ports_timer_keeps_the_period_exactly(platform, rate_hz):
    with Port(platform) as port:
        from firmware.board import find
        from firmware.loop import Loop

        began = []
        loop = Loop(ticking(lambda dt: began.append(port.now_ns)), find().timer, rate_hz)
        loop.start()
        port.run_ms(1000)
        loop.stop()
        ticks = len(began)
        assert ticks == 1_000_000 // round(1e6 / rate_hz)
        period_ns = round(1e6 / rate_hz) * 1000
        assert abs(began[-1] - began[0] - (ticks - 1) * period_ns) <= 2000
        assert loop.stats()["lost"] == 0
        port.run_ms(100)
        assert len(began) == ticks  # stopped is stopped


@board
def test_a_blocked_main_program_costs_ticks_but_no_burst(platform):
    with Port(platform) as port:
        from firmware.board import find
        from firmware.loop import Loop

        began = []
        loop = Loop(ticking(lambda dt: began.append(port.now_ns)), find().timer, 250)
        loop.start()
        port.run_ms(100)
        port.clock.busy(50_000_000)  # a C function that takes 50 ms: no soft callback runs
        port.run_ms(100)
        stats = loop.stats()
        assert stats["lost"] in (11, 12)
        assert stats["ticks"] + stats["lost"] in (62, 63)
        off_grid = [t for t in began if (t - began[0]) % 4_000_000 > 10_000]
        assert len(off_grid) == 1  # the one after the block; the next is on the grid again
        assert port.errors == []


@board
def test_samples_are_an_asynchronous_iterator(platform):
    with Port(platform) as port:
        from firmware.board import find
        from firmware.loop import Loop

        asyncio = port.modules["asyncio"]
        loop = Loop(ticking(lambda dt: loop.wake()), find().timer, 250)

        async def main():
            loop.start()
            seen = []
            async for item in loop.samples("it"):
                seen.append((item, time.ticks_us()))
                if len(seen) == 5:
                    break
            return seen

        seen = asyncio.run(main())
        assert [item for item, _ in seen] == ["it"] * 5
        gaps = [time.ticks_diff(b, a) for (_, a), (_, b) in pairwise(seen)]
        assert all(abs(gap - 4000) < 50 for gap in gaps)


@pytest.mark.parametrize("slow", [0, 1, 3])
@pytest.mark.parametrize("period_us, lead_us", [(4000, 450), (2000, 450), (10000, 450)])
def test_a_burst_begins_its_lead_before_the_tick_whatever_the_start_takes(
    port, period_us, lead_us, slow
):
    """The heap is searched while a source is made, so many times: bursts would be too old."""
    from firmware import loop as loops

    now, made = [0], []

    class Clock(Time):
        @staticmethod
        def sleep_us(us):
            now[0] += us

    def source(period, callback):
        if len(made) % 2 and len(made) // 2 < slow:
            now[0] += 2400
        made.append((now[0], Source(period, callback)))
        return made[-1][1]

    kept, loops.time = loops.time, Clock(lambda: now[0])
    try:
        tick = ticking(lambda dt_us: None)
        loop = loops.Loop(tick, source, 1000000 / period_us, lead_us=lead_us)
        loop.start()
        (leads_us, leads), (runs_us, runs) = [one for one in made if not one[1].ended]
        apart_us = (runs_us - leads_us) % period_us
        assert lead_us <= apart_us < lead_us + period_us // 4
        assert (leads.period_us, runs.period_us) == (period_us, period_us)
        loop.stop()
        assert all(one.ended for _, one in made)
    finally:
        loops.time = kept


@pytest.mark.parametrize("takes_us", [0, 900, 40000])
@pytest.mark.parametrize("pause_us", [0, 700, 2100, 90000])
@pytest.mark.parametrize("lead_us", [0, 450])
def test_what_a_start_takes_is_in_the_first_ticks_time(port, takes_us, pause_us, lead_us):
    """The first start after a sample, and each one after a stop: nothing of the time is lost."""
    seen, now = [], [5000]
    loop, sources = make_loop(seen.append, lambda: now[0], rate_hz=500, lead_us=lead_us)
    make = loop._source

    def source(period_us, callback):
        now[0] += takes_us
        return make(period_us, callback)

    loop._source = source
    loop._tick.timing.follow(now[0])
    for _ in range(3):
        last = now[0]
        now[0] += pause_us
        loop.start()
        for _ in range(2):
            now[0] += 2000
            sources[-1].callback(None)
        assert abs(sum(seen) - (now[0] - last)) < 1000  # the first comes when it comes
        seen.clear()
        loop.stop()


@pytest.mark.parametrize("lost", [False, True])
@pytest.mark.parametrize("read", [1, 2, 3])
def test_a_tick_that_comes_while_the_age_is_asked_makes_no_good_sample_old(port, lost, read):
    """A hard tick may come in between any two steps of the question: here as a clock is read."""
    asked, now = [-100], [0]

    def step(dt_us):
        loop._tick.words[3] = loop._tick.words[3] + dt_us if lost else 0

    def clock():
        asked[0] += 1
        if asked[0] == read:
            sources[-1].callback(None)  # and reads the clock itself
        return now[0]

    loop, sources = make_loop(step, clock, rate_hz=1000)
    loop.start()
    for _ in range(3):
        now[0] += 1000
        sources[-1].callback(None)
    now[0] += 990
    asked[0] = 0
    assert loop.age_us() == (3990 if lost else 990 if asked[0] < read else 0)


@pytest.mark.parametrize("never", [True, False], ids=["no timer", "one of two"])
@pytest.mark.parametrize("burst", ["auto", "blocking"])
@pytest.mark.parametrize("board", BOARDS)
def test_timers_that_died_in_a_full_heap_come_again_when_there_is_memory(
    board, burst, never, tmp_path, capsys
):
    """Till then the guard ticks alone: few samples, each waited for, and never stale."""
    with Rig(board, Still(10.0), tmp_path, rest_s=0.1, burst=burst) as rig:
        app = rig.app
        app.start()
        rig.port.run_ms(2000)
        make, tries = app.loop._source, []

        def full(period_us, callback):
            tries.append(period_us)
            if len(tries) < 9 and (never or len(tries) % 3):
                raise MemoryError
            return make(period_us, callback)

        app.loop._source = full
        for source in app.loop._sources[:-1]:
            source.deinit()
        for _ in range(150):
            rig.port.run_ms(1)
            assert not app.stale
        assert 2 <= len(tries) < 9 and app.running
        rig.port.run_ms(2500)
        assert app.running and not app.loop.dead and rig.claimed
        ticks = app.stats()["ticks"]
        rig.port.run_ms(200)
        assert app.stats()["ticks"] - ticks >= 49
        assert type(app.foreground.error) is MemoryError
        app.foreground.error = None  # as expected
        printed = capsys.readouterr().out
        assert printed.count("another one is started") == 1
        assert abs(app.roll_deg - 10.0) < 0.5
        app.stop()

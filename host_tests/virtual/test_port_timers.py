# SPDX-License-Identifier: MIT
"""Virtual time: ticks and their wrap, timers without drift, the queue of eight, hard and soft."""

import pytest

from tools.virtual.port import Port, VirtualReset
from tools.virtual.port.ticks import ticks_add, ticks_diff

WRAP = 2**30


def ticks(port):
    import time

    return time.ticks_us()


def test_ticks_start_two_seconds_before_their_wrap():
    with Port("rp2", call_ns=0) as port:
        import time

        assert time.ticks_us() == WRAP - 2_000_000
        assert time.ticks_ms() == WRAP - 2_000
        start = time.ticks_us()
        time.sleep_ms(2500)
        assert time.ticks_us() == 500_000
        assert time.ticks_diff(time.ticks_us(), start) == 2_500_000
        time.sleep(0)
        assert port.now_ns == 2_500_000_000
    assert not hasattr(time, "ticks_us")


def test_tick_arithmetic_at_its_edges():
    assert ticks_add(WRAP - 1, 1) == 0
    assert ticks_add(0, -1) == WRAP - 1
    assert ticks_diff(0, WRAP - 1) == 1
    assert ticks_diff(WRAP // 2, 0) == -(WRAP // 2)
    assert ticks_diff(WRAP // 2 - 1, 0) == WRAP // 2 - 1
    with pytest.raises(OverflowError):
        ticks_add(0, WRAP // 2)


def test_a_busy_wait_comes_to_its_end():
    with Port("esp32") as port:
        import time

        start = time.ticks_us()
        while time.ticks_diff(time.ticks_us(), start) < 1000:
            pass
    assert 1e6 <= port.now_ns < 1.1e6


def test_a_million_ticks_without_drift_across_wraps():
    """1 kHz for 1000 s with the wrap after 2 s and every 1073.7 s; each expiry on its instant."""
    with Port("rp2") as port:
        import machine

        seen = [0, 0]

        def tick(timer):
            seen[0] += 1
            seen[1] += port.now_ns % 1_000_000

        timer = machine.Timer(freq=1000, callback=tick)
        port.run_ms(1_000_000)
        assert seen == [1_000_000, 0]
        assert timer.ticks == 1_000_000
        assert port.dropped == 0


def test_a_late_callback_does_not_move_the_next_expiry():
    with Port("rp2") as port:
        import time

        import machine

        starts = []

        def tick(timer):
            starts.append(port.now_ns)
            if len(starts) == 2:
                time.sleep_ms(5)

        _timer = machine.Timer(period=4, callback=tick)
        port.run_ms(21)
    assert starts == [4_000_000, 8_000_000, 13_000_000, 16_000_000, 20_000_000]


def test_period_is_whole_milliseconds_and_freq_any_number():
    with Port("rp2") as port:
        import machine

        with pytest.raises(TypeError):
            machine.Timer(period=2.5, callback=print)
        count = []
        _timer = machine.Timer(freq=286.3, callback=count.append)
        port.run_ms(1000)
        assert len(count) == 286
        assert repr(count[0]) == "Timer(mode=PERIODIC, tick_hz=1000000, period=3492)"


def test_the_queue_holds_eight_and_soft_timers_drop_silently():
    with Port("rp2") as port:
        import machine
        import micropython

        ran = []
        _timer = machine.Timer(period=1, callback=lambda timer: ran.append(port.now_ns))
        port.clock.hold(20_000_000)  # one C function of 20 ms: 20 ticks, 8 places
        assert ran == []
        assert port.dropped == 12
        with pytest.raises(RuntimeError, match="schedule queue full"):
            micropython.schedule(print, 0)
        assert port.dropped == 12
        port.clock.breathe()
        assert len(ran) == 1
        port.run_ms(0)
        assert len(ran) == 8


def test_callbacks_do_not_pre_empt_each_other():
    with Port("rp2") as port:
        import time

        import micropython

        trace = []

        def inner(argument):
            trace.append("inner")

        def outer(argument):
            trace.append("outer begins")
            micropython.schedule(inner, 0)
            time.sleep_ms(10)
            trace.append("outer ends")

        micropython.schedule(outer, 0)
        port.run_ms(1)
    assert trace == ["outer begins", "outer ends", "inner"]


def test_soft_exception_is_printed_and_the_timer_goes_on(capsys):
    with Port("esp32") as port:
        import machine

        def tick(timer):
            raise ValueError("soft trouble")

        machine.Timer(0, period=10, callback=tick)
        port.run_ms(35)
    assert [str(error) for error in port.errors] == ["soft trouble"] * 3
    assert capsys.readouterr().err.count("ValueError: soft trouble") == 3


def test_hard_timer_runs_at_once_and_an_exception_ends_it(capsys):
    with Port("rp2", version=(1, 26, 0)) as port:
        import machine

        seen = []

        def tick(timer):
            seen.append(port.now_ns)
            if len(seen) == 3:
                raise ValueError("hard trouble")

        _timer = machine.Timer(period=1, hard=True, callback=tick)
        port.clock.hold(10_000_000)
    assert seen == [1_000_000, 2_000_000, 3_000_000]
    assert capsys.readouterr().err.startswith("uncaught exception in timer callback\n")


def test_hard_and_ids_per_port_and_version():
    with Port("rp2"):
        import machine

        with pytest.raises(TypeError, match="extra keyword"):
            _timer = machine.Timer(period=1, hard=True)
        with pytest.raises(ValueError, match="Timer doesn't exist"):
            machine.Timer(0)
        assert machine.Timer() is not machine.Timer()
    with Port("esp32", version=(1, 26, 1)):
        import machine

        with pytest.raises(TypeError, match="extra keyword"):
            machine.Timer(0, period=1, hard=True)
    with Port("esp32", version=(1, 27, 0)):
        import machine

        with pytest.raises(ValueError, match="hard Timers are not implemented"):
            machine.Timer(0, period=1, hard=True)
        with pytest.raises(ValueError, match="invalid Timer number"):
            machine.Timer(4)
        with pytest.raises(ValueError):
            machine.Timer(-1)
        with pytest.raises(TypeError):
            machine.Timer()
        assert machine.Timer(3) is machine.Timer(3)


def test_one_shot_deinit_and_init_again():
    with Port("rp2") as port:
        import machine

        count = []
        timer = machine.Timer(mode=machine.Timer.ONE_SHOT, period=5, callback=count.append)
        port.run_ms(50)
        assert len(count) == 1
        timer.init(period=10, callback=count.append)
        port.run_ms(25)
        timer.deinit()
        port.run_ms(100)
        assert len(count) == 3


def test_a_timer_that_is_not_kept_ends_on_rp2():
    """Its finaliser stops it; the ESP32 port keeps its timers itself."""
    for platform, ident, runs in (("rp2", -1, 0), ("esp32", 0, 5)):
        with Port(platform) as port:
            import machine

            count = []
            machine.Timer(ident, period=1, callback=count.append)
            port.run_ms(5)
            assert len(count) == runs


def test_a_timer_without_callback_is_an_error_each_time():
    with Port("rp2") as port:
        import machine

        timer = machine.Timer(period=1)
        port.run_ms(3)
        timer.deinit()
    assert [type(error) for error in port.errors] == [TypeError] * 3


def test_irqs_off_hold_everything_back():
    with Port("rp2") as port:
        import machine

        count = []
        _timer = machine.Timer(period=1, callback=count.append)
        state = machine.disable_irq()
        port.run_ms(3)
        assert count == []
        machine.enable_irq(state)
        port.run_ms(0)
        assert len(count) == 3


def test_watchdog_starves_inside_a_loop_that_catches_everything():
    with Port("esp32") as port:
        import time

        import machine

        dog = machine.WDT(timeout=100)
        for _ in range(5):
            time.sleep_ms(90)
            dog.feed()
        with pytest.raises(VirtualReset) as caught:
            while True:
                try:
                    time.sleep_ms(7)
                except Exception:
                    continue
        assert caught.value.cause == machine.WDT_RESET == 3
        assert port.now_ns == pytest.approx(550e6)
    with Port("rp2", reset_cause=3):
        import machine

        assert machine.reset_cause() == machine.WDT_RESET
        with pytest.raises(ValueError, match="timeout exceeds 8388"):
            machine.WDT(timeout=9000)
        with pytest.raises(VirtualReset):
            machine.reset()


def test_real_time_pacing():
    import time

    start = time.monotonic()
    with Port("rp2", pace=10.0) as port:
        port.run_ms(500)
    assert 0.04 < time.monotonic() - start < 0.5


class Key:
    """A terminal at which Ctrl-C is pressed."""

    def readinto(self, buffer):
        buffer[0] = 3
        return 1


def test_a_ctrl_c_in_a_soft_callback_is_lost_unless_it_is_pressed_again():
    """As py/scheduler.c prints what a callback raises, and os.dupterm_notify() reads a key."""
    with Port("rp2") as port:
        import micropython

        def loses_it(_):
            raise KeyboardInterrupt

        def presses_again(_):
            before = port.modules["os"].dupterm(Key())
            port.modules["os"].dupterm_notify(None)
            assert before is None
            assert isinstance(port.modules["os"].dupterm(before), Key)

        micropython.schedule(loses_it, None)
        port.run_ms(1)
        assert [type(error) for error in port.errors] == [KeyboardInterrupt]
        micropython.schedule(presses_again, None)
        with pytest.raises(KeyboardInterrupt):
            port.run_ms(1)
        port.run_ms(1)
        assert len(port.errors) == 1

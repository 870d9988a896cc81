# SPDX-License-Identifier: MIT
"""Hard interrupts of the virtual port: when they run, and what ends them.

board/test_hard_equal.py holds the same against the real firmware.
"""

import pytest

from host_tests.virtual.port_rig import ADDRESS, Ram
from tools.virtual.bus import Bus
from tools.virtual.port import Port, VirtualReset

MS = 1_000_000
CALL_NS = 22_000  # an empty hard callback on the chip


@pytest.fixture
def port():
    with Port("rp2", {0: Bus(Ram())}, version=(1, 26, 1)) as board:
        yield board


def every_ms(function):
    import machine

    return machine.Timer(freq=1000, hard=True, callback=function)


@pytest.mark.parametrize("what", ["hold", "sleep", "busy", "collect", "soft callback", "transfer"])
def test_each_tick_has_its_instant_whatever_the_program_does(port, what):
    import machine
    import micropython

    i2c = machine.I2C(0, freq=100_000)
    programs = {
        "hold": lambda: port.clock.hold(10 * MS),
        "sleep": lambda: port.run_ms(10),
        "busy": lambda: port.clock.busy(10 * MS),
        "collect": port.modules["gc"].collect,
        "soft callback": lambda: micropython.schedule(lambda _: port.clock.hold(10 * MS), None),
        "transfer": lambda: i2c.readfrom_mem_into(ADDRESS, 0, bytearray(105)),  # 9.7 ms
    }
    ticks, soft = [], []
    timer = every_ms(lambda _: ticks.append(port.now_ns))
    late = machine.Timer(freq=1000, callback=lambda _: soft.append(port.now_ns))
    port.clock.now_ns += 1  # so that no sleep ends with a tick
    programs[what]()
    port.clock.breathe()
    timer.deinit()
    late.deinit()
    assert len(ticks) >= 9
    assert ticks == [n * MS for n in range(1, len(ticks) + 1)]
    prompt = [t - CALL_NS for t in soft] == ticks  # each behind the hard one
    assert prompt == (what == "sleep")
    assert port.errors == []


def test_a_masked_pause_is_caught_up_back_to_back(port):
    ticks, soft = [], []
    import machine

    _hard = every_ms(lambda _: ticks.append(port.now_ns))
    _soft = machine.Timer(freq=1000, callback=lambda _: soft.append(port.now_ns))
    port.clock.masked(20 * MS + 1)
    assert ticks == [20 * MS + 1 + n * CALL_NS for n in range(20)]
    assert soft == []
    port.run_ms(5)
    assert [t // MS for t in ticks[20:]] == [21, 22, 23, 24, 25]
    assert len(soft) == 8 + 5  # the queue's eight, and one for each tick after the pause
    assert port.dropped == 12


def test_irqs_off_in_the_program_hold_back_hard_ones_and_the_watchdog_bites(port):
    import time

    import machine

    ticks = []
    _timer = every_ms(lambda _: ticks.append(port.now_ns))
    state = machine.disable_irq()
    time.sleep_us(900)
    time.sleep_us(900)
    assert ticks == []
    machine.enable_irq(state)
    assert len(ticks) == 1
    machine.WDT(timeout=50)
    with pytest.raises(VirtualReset):
        port.clock.masked(60 * MS)


def test_one_hard_callback_never_runs_inside_another(port):
    import time

    import machine

    trace = []

    def slow(_):
        trace.append("slow begins")
        time.sleep_us(900)
        time.sleep_us(900)
        trace.append("slow ends")

    _a = machine.Timer(freq=250, hard=True, callback=slow)
    _b = every_ms(lambda _: trace.append("quick"))
    machine.Pin(6, machine.Pin.IN).irq(lambda _: trace.append("pin"), hard=True)
    port.clock.hardware_at(4_500_000, lambda: port.pin(6).drive(1))
    port.clock.hold(6 * MS)
    begun = trace.index("slow begins")
    assert trace[begun + 1] == "slow ends"
    assert sorted(trace[begun + 2 :]) == ["pin", "quick", "quick", "quick"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt, SystemExit])
def test_what_leaves_a_hard_callback_kills_its_timer(port, capsys, error):
    count = []

    def fail(_):
        count.append(port.now_ns)
        raise error("out of the tick")

    timer = every_ms(fail)
    port.run_ms(5)
    assert len(count) == 1
    assert [type(e) for e in port.errors] == [error]
    assert capsys.readouterr().err.startswith("uncaught exception in timer callback\n")
    timer.init(freq=1000, hard=True, callback=count.append)
    port.run_ms(5)
    assert len(count) == 6


def test_what_leaves_a_hard_pin_callback_kills_it(port, capsys):
    import machine

    count = []

    def fail(pin):
        count.append(pin)
        raise OSError(5)

    pin = machine.Pin(6, machine.Pin.IN)
    pin.irq(fail, machine.Pin.IRQ_RISING, hard=True)
    for level in (1, 0, 1):
        port.pin(6).drive(level)
    assert count == [pin]
    assert [type(e) for e in port.errors] == [OSError]
    assert capsys.readouterr().err.startswith("Uncaught exception in IRQ callback handler\n")


def test_edges_while_masked_are_one_interrupt(port):
    import machine

    hard, soft = [], []
    machine.Pin(6, machine.Pin.IN).irq(hard.append, machine.Pin.IRQ_RISING, hard=True)
    machine.Pin(7, machine.Pin.IN).irq(soft.append, machine.Pin.IRQ_RISING)
    state = machine.disable_irq()
    for level in (1, 0) * 3:
        port.pin(6).drive(level)
        port.pin(7).drive(level)
    assert hard == soft == []
    machine.enable_irq(state)
    assert (len(hard), len(soft)) == (1, 1)


def test_a_ninth_schedule_is_an_error_in_a_hard_callback(port):
    import micropython

    ran, full = [], []

    def fill(_):
        for n in range(9):
            try:
                micropython.schedule(ran.append, n)
            except RuntimeError:
                full.append(n)

    timer = every_ms(fill)
    port.clock.hold(MS)
    timer.deinit()
    assert ran == []
    port.run_ms(1)
    assert (ran, full) == (list(range(8)), [8])


def test_what_a_collection_takes_is_the_tests_to_say(tmp_path):
    for gc_ns in (0, 17 * MS):
        with Port("rp2", root=tmp_path, gc_ns=gc_ns) as port:
            port.modules["gc"].collect()
            assert port.now_ns == gc_ns


@pytest.mark.parametrize(
    ("machine", "version", "mpy"),
    [  # py/persistentcode.h: ARMV6M 4, ARMV7EMSP 7, XTENSAWIN 10, RV32IMC 11; version 6, sub 3
        ("RP2040", (1, 26, 1), 4 << 10 | 0x306),
        ("RP2350", (1, 25, 0), 7 << 10 | 0x306),
        ("ESP32S3", (1, 25, 0), 10 << 10 | 0x306),
        ("ESP32C3", (1, 25, 0), 11 << 10 | 0x306),
        ("ESP32C3", (1, 23, 0), 0x306),
    ],
)
def test_what_the_board_says_of_itself(machine, version, mpy):
    platform = "rp2" if machine.startswith("RP") else "esp32"
    with Port(platform, machine_name=machine, version=version) as port:
        about = port.modules["sys"].implementation
        assert about.version[:3] == version
        assert about._mpy == mpy

# SPDX-License-Identifier: MIT
"""What a hard callback of the virtual port may not do, and what it does to a transfer under way.

board/test_hard_equal.py holds the same against the real firmware.
"""

import pytest

from host_tests.virtual.port_rig import ADDRESS, Ram
from tools.virtual.bus import Bus
from tools.virtual.port import Port
from tools.virtual.port.wire import BusInUse

MS = 1_000_000


@pytest.fixture
def port():
    with Port("rp2", {0: Bus(Ram())}, version=(1, 26, 1)) as board:
        yield board


def every_ms(function):
    import machine

    return machine.Timer(freq=1000, hard=True, callback=function)


REFUSED = {
    "print": "print(1)",
    "sys.stdout": "sys.stdout.write('x')",
    "sys.stdout.buffer": "write(b'x')",
    "open": "open('a.txt', 'w')",
    "listdir": "os.listdir('/')",
    "import": "import json",
    "sleep_ms": "time.sleep_ms(1)",
    "gc.collect": "gc.collect()",
    "gc.mem_free": "gc.mem_free()",
    "time": "time.time()",
    "Timer": "machine.Timer()",
    "writeto_mem": "i2c.writeto_mem(0x68, 0x20, b'x')",
    "readfrom_mem": "i2c.readfrom_mem(0x68, 0x20, 1)",
    "readfrom": "i2c.readfrom(0x68, 1)",
    "writevto": "i2c.writevto(0x68, [b'a', b'b'])",
    "scan": "i2c.scan()",
}
ALLOCATES = ("time", "Timer", "writeto_mem", "readfrom_mem", "readfrom", "writevto", "scan")
_REFUSAL = """
import gc, machine, os, sys, time
i2c = machine.I2C(0, freq=400_000)
write = sys.stdout.buffer.write
seen = []
def tick(timer):
    timer.deinit()
    try:
        %s
    except MemoryError:
        seen.append("MemoryError")
    except Exception:
        seen.append("refused")
timer = machine.Timer(freq=1000, hard=True, callback=tick)
time.sleep_ms(5)
"""


@pytest.mark.parametrize("name", REFUSED)
def test_what_a_hard_callback_may_not_do_is_an_error_that_no_except_hides(tmp_path, name):
    program = tmp_path / "program.py"
    program.write_text(_REFUSAL % REFUSED[name])
    with Port("rp2", {0: Bus(Ram())}, version=(1, 26, 1), root=tmp_path) as port:
        names = port.run_file(program)
    assert names["seen"] == ["MemoryError" if name in ALLOCATES else "refused"]
    assert [str(e).partition(" in a ")[2] for e in port.errors] == ["hard interrupt"]
    assert not (tmp_path / "a.txt").exists()


def test_a_hard_transfer_in_the_middle_of_a_read_takes_the_bus(port):
    import machine

    i2c = machine.I2C(0, freq=400_000, timeout=5_000)
    first, second = bytearray(100), bytearray(14)
    timer = every_ms(lambda _: i2c.readfrom_mem_into(ADDRESS, 0x10, second))
    with pytest.raises(OSError) as caught:
        i2c.readfrom_mem_into(ADDRESS, 0, first)
    timer.deinit()
    assert caught.value.errno == 110
    assert port.now_ns > 6 * MS  # it waited for its time-out
    assert second == bytes(range(0x10, 0x1E))
    assert first != bytes(range(100))
    assert [type(e) for e in port.errors] == [BusInUse]
    assert i2c.readfrom_mem(ADDRESS, 0x20, 2) == b"\x20\x21"


def test_a_hard_transfer_in_the_middle_of_a_write_corrupts_it_in_silence(port):
    import machine

    i2c = machine.I2C(0, freq=400_000)
    second = bytearray(14)

    def tick(timer):
        timer.deinit()
        i2c.readfrom_mem_into(ADDRESS, 0x80, second)

    _timer = every_ms(tick)
    i2c.writeto_mem(ADDRESS, 0, bytes([0xEE] * 70))  # 1.6 ms
    assert [type(e) for e in port.errors] == [BusInUse]
    written = i2c.readfrom_mem(ADDRESS, 0, 70)
    assert written.count(0xEE) < 70
    assert i2c.readfrom_mem(ADDRESS, 0xEE, 2) == b"\xee\xee"  # where nobody wanted to write


def test_the_bus_block_works_on_during_a_hard_callback_and_while_masked(port):
    """A burst by the registers: 14 bytes at 400 kHz are there after 390 us."""
    import time

    import machine

    machine.I2C(0, freq=400_000)
    memory, base, found = machine.mem32, 0x40044000, []

    def begin():
        memory[base + 0x6C] = 0
        memory[base + 0x04] = ADDRESS
        memory[base + 0x6C] = 1
        memory[base + 0x10] = 0x3B
        for n in range(14):
            memory[base + 0x10] = 0x100 | (0x400 if n == 0 else 0) | (0x200 if n == 13 else 0)

    def tick(timer):
        timer.deinit()
        begin()
        time.sleep_us(400)
        found.append(memory[base + 0x78])

    _timer = every_ms(tick)
    port.run_ms(3)
    assert found == [14]
    begin()
    port.clock.masked(400_000)
    assert memory[base + 0x78] == 14
    assert port.errors == []

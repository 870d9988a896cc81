# SPDX-License-Identifier: MIT
"""Hard interrupts of the virtual port and of the real firmware have the same consequences.

Where a release has no hard timers (1.25), both must refuse them with the same error.
"""

import io
from contextlib import redirect_stderr, redirect_stdout

import pytest

from host_tests.virtual.port_rig import Ram
from tools.virtual.bus import Bus
from tools.virtual.pico import PicoError
from tools.virtual.port import Port

_HEAD = """
import machine, micropython, sys, time
from array import array
micropython.alloc_emergency_exception_buf(200)
i2c = machine.I2C(0, sda=machine.Pin(4), scl=machine.Pin(5), freq=400_000, timeout=5_000)
seen = array("i", [0] * 40)
buffer = bytearray(14)
def busy(us):
    begun = time.ticks_us()
    while time.ticks_diff(time.ticks_us(), begun) < us:
        pass
"""

# The board prints tracebacks where it prints results, so what is compared begins with "=".
SCRIPTS = {
    "masked": """
@micropython.native
def count(timer):
    seen[0] += 1
timer = machine.Timer(freq=1000, hard=True, callback=count)
state = machine.disable_irq()
busy(5500)
inside = seen[0]
machine.enable_irq(state)
print("=", inside, seen[0])
busy(2000)
timer.deinit()
print("=", seen[0])
""",
    "killed": """
for kind in (ValueError, KeyboardInterrupt):
    seen[0] = 0
    @micropython.native
    def fail(timer, kind=kind):
        seen[0] += 1
        if seen[0] == 3:
            raise kind
    timer = machine.Timer(freq=1000, hard=True, callback=fail)
    time.sleep_ms(10)
    print("=", seen[0])
    timer.init(freq=1000, hard=True, callback=fail)
    time.sleep_ms(5)
    timer.deinit()
    print("=", seen[0] > 5)
""",
    "schedule": """
def note(n):
    seen[1 + n] = 1
@micropython.native
def fill(timer):
    seen[0] += 1
    if seen[0] == 1:
        for n in range(9):
            try:
                micropython.schedule(note, n)
            except RuntimeError:
                seen[20] += 1
timer = machine.Timer(freq=1000, hard=True, callback=fill)
time.sleep_ms(5)
busy(1000)
timer.deinit()
print("=", list(seen[1:10]), seen[20])
""",
    "refused": """
pair = (b"\\x30", b"\\x01")
calls = (
    lambda: i2c.readfrom_mem_into(0x68, 0x3B, buffer),
    lambda: i2c.readfrom_into(0x68, buffer),
    lambda: i2c.writeto(0x68, b"\\x30"),
    lambda: i2c.writeto_mem(0x68, 0x30, b"\\x01"),
    lambda: i2c.readfrom_mem(0x68, 0x30, 2),
    lambda: i2c.readfrom(0x68, 2),
    lambda: i2c.writevto(0x68, pair),
    lambda: i2c.scan(),
    lambda: machine.Timer(),
    lambda: time.time(),
    lambda: time.sleep_us(20),
    lambda: time.ticks_us(),
    lambda: micropython.schedule(abs, 1),
    lambda: i2c.readfrom_mem_into(0x69, 0x3B, buffer),
)
out = [0] * len(calls)
@micropython.native
def each(timer):
    n = seen[0]
    if n < len(calls):
        seen[0] = n + 1
        try:
            calls[n]()
            out[n] = 1
        except MemoryError:
            out[n] = 2
        except OSError:
            out[n] = 3
timer = machine.Timer(freq=500, hard=True, callback=each)
time.sleep_ms(40)
timer.deinit()
print("=", out)
""",
    "nested": """
@micropython.native
def slow(timer):
    seen[0] = 1
    time.sleep_us(1500)
    seen[0] = 0
    seen[1] += 1
@micropython.native
def quick(timer):
    if seen[0]:
        seen[2] += 1
    seen[3] += 1
a = machine.Timer(freq=200, hard=True, callback=slow)
b = machine.Timer(freq=1000, hard=True, callback=quick)
busy(20_500)
a.deinit()
b.deinit()
print("=", seen[1], seen[2], seen[3])
""",
    "collision": """
@micropython.native
def tick(timer):
    seen[0] += 1
    if seen[0] == 1:
        i2c.readfrom_mem_into(0x68, 0x10, buffer)
timer = machine.Timer(freq=1000, hard=True, callback=tick)
big = bytearray(100)
try:
    i2c.readfrom_mem_into(0x68, 0, big)
    print("= fine")
except OSError as error:
    print("=", error.args[0])
timer.deinit()
print("=", buffer)
try:
    print("=", i2c.writeto(0x68, bytes(60)))
except OSError as error:
    print("=", error.args[0])
print("=", i2c.readfrom_mem(0x68, 0x20, 3))
""",
    "collision of a write": """
@micropython.native
def tick(timer):
    seen[0] += 1
    if seen[0] == 1:
        i2c.readfrom_mem_into(0x68, 0x80, buffer)
timer = machine.Timer(freq=1000, hard=True, callback=tick)
print("=", i2c.writeto(0x68, bytes(range(60))))
timer.deinit()
print("=", i2c.readfrom_mem(0x68, 0, 60) == bytes(range(1, 60)) + b";")
""",
}


def _results(printed):
    return [line for line in printed.splitlines() if line.startswith("=")]


def _on_board(board, script):
    try:
        return _results(board.exec(_HEAD + script))
    except PicoError as error:
        return [str(error).splitlines()[-1]]


def _on_host(script, version, tmp_path):
    (tmp_path / "hostscript.py").write_text(_HEAD + script)
    out, err = io.StringIO(), io.StringIO()
    bus = Bus(Ram())
    port = Port("rp2", {0: bus}, version=version, root=tmp_path, paths=[tmp_path])
    with port, redirect_stdout(out), redirect_stderr(err):
        try:
            port.run_file(tmp_path / "hostscript.py")
        except TypeError as error:
            return ["TypeError: %s" % error]
    return _results(out.getvalue())


@pytest.mark.parametrize("name", SCRIPTS)
def test_hard_interrupts_have_the_same_consequences(plain_board, name, tmp_path):
    board, device, _ = plain_board
    device.registers[:] = bytes(range(256))
    real = _on_board(board, SCRIPTS[name])
    assert real == _on_host(SCRIPTS[name], board.version, tmp_path)
    if board.version < (1, 26):
        assert real == ["TypeError: extra keyword arguments given"]
    else:
        assert len(real) >= 1

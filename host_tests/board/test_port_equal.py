# SPDX-License-Identifier: MIT
"""The virtual port and the real firmware on the emulated RP2040 print the same."""

import io
from contextlib import redirect_stdout

import pytest

from host_tests.virtual.port_rig import Ram
from tools.virtual.bus import Bus
from tools.virtual.faults import make
from tools.virtual.port import Port

_HEAD = """
import machine, micropython, time, sys, os
def attempt(name, call, *arguments):
    try:
        result = call(*arguments)
        print(name, result)
    except Exception as error:
        kind = "OSError" if isinstance(error, OSError) else type(error).__name__
        print(name, kind, error.args[0])
i2c = machine.I2C(0, sda=machine.Pin(4), scl=machine.Pin(5), freq=400_000, timeout=5_000)
"""

SCRIPTS = {
    "identity": """
print(sys.platform, sys.implementation.name, sys.implementation.version, sys.maxsize)
print(sys.byteorder, os.uname().sysname, os.uname().release)
print(sys.implementation._mpy, sys.implementation._machine, sys.implementation._build)
""",
    "texts": """
print(i2c, machine.I2C(0) is i2c, machine.I2C(1, freq=100_000, timeout=2000))
print(machine.Pin(14, machine.Pin.IN, machine.Pin.PULL_UP), machine.Pin(15, machine.Pin.OUT))
timer = machine.Timer(-1, freq=250, callback=print)
print(timer, machine.Pin(3) is machine.Pin(3))
timer.deinit()
print(machine.SoftI2C(scl=machine.Pin(17), sda=machine.Pin(16), freq=100_000))
""",
    "constants": """
names = ("IN", "OUT", "OPEN_DRAIN", "PULL_UP", "PULL_DOWN", "IRQ_RISING", "IRQ_FALLING", "ALT")
print([getattr(machine.Pin, name) for name in names])
print(machine.Timer.ONE_SHOT, machine.Timer.PERIODIC, machine.PWRON_RESET, machine.WDT_RESET)
print(machine.freq(), machine.reset_cause())
""",
    "refusals": """
attempt("bus", machine.I2C, 2)
attempt("scl", lambda: machine.I2C(0, sda=machine.Pin(4), scl=machine.Pin(6)))
attempt("sda", lambda: machine.I2C(0, sda=machine.Pin(5), scl=machine.Pin(5)))
attempt("timer", machine.Timer, 0)
attempt("hard", lambda: machine.Timer(period=1, hard=True, callback=print).deinit())
attempt("period", lambda: machine.Timer(period=2.5, callback=print))
attempt("pin name", machine.Pin, "GP99")
attempt("start", i2c.start)
attempt("write", i2c.write, b"")
attempt("addrsize", lambda: i2c.readfrom_mem(0x68, 0, 1, addrsize=12))
attempt("watchdog", machine.WDT, 1)
attempt("watchdog", machine.WDT, 0, 8389)
""",
    "transfers": """
print(i2c.scan())
attempt("read", i2c.readfrom_mem, 0x68, 0x3B, 14)
attempt("write", i2c.writeto_mem, 0x68, 0x10, b"\\x01\\x02")
attempt("writeto", i2c.writeto, 0x68, b"\\x20\\x03\\x04")
attempt("vector", i2c.writevto, 0x68, (b"\\x30", b"", b"\\x05\\x06"))
attempt("no stop", i2c.writeto, 0x68, b"\\x20", False)
attempt("then read", i2c.readfrom, 0x68, 2)
attempt("missing", i2c.readfrom_mem, 0x69, 0x75, 1)
attempt("missing", i2c.writeto, 0x69, b"\\x00")
attempt("missing", i2c.readfrom, 0x69, 1)
attempt("missing", i2c.writeto, 0x69, b"")
attempt("empty", i2c.writeto, 0x68, b"")
soft = machine.SoftI2C(scl=machine.Pin(5), sda=machine.Pin(4), freq=400_000)
print(soft.scan())
attempt("soft", soft.readfrom_mem, 0x68, 0x10, 2)
attempt("soft missing", soft.readfrom_mem, 0x69, 0x10, 2)
soft.start()
attempt("soft acks", soft.write, b"\\xd0\\x22\\x09")
soft.stop()
attempt("soft missing", soft.writeto, 0x69, b"\\x00")
i2c = machine.I2C(0, sda=machine.Pin(4), scl=machine.Pin(5), freq=400_000, timeout=5_000)
attempt("hard again", i2c.readfrom_mem, 0x68, 0x22, 1)
""",
    "schedule": """
order = []
def note(x):
    order.append(x)
def fill():
    for i in range(9):
        micropython.schedule(note, i)
def blocked(x):
    attempt("full", fill)
    order.append("blocked")
micropython.schedule(blocked, 0)
time.sleep_ms(5)
for _ in range(100):  # a sleep runs one callback at each wake, the rest run between bytecodes
    pass
print(order)
""",
    "timers": """
count = 0
def tick(timer):
    global count
    count += 1
timer = machine.Timer(freq=250, callback=tick)
time.sleep_ms(41)
timer.deinit()
at_end = count
time.sleep_ms(20)
print(at_end, count)
timer = machine.Timer(mode=machine.Timer.ONE_SHOT, period=5, callback=tick)
time.sleep_ms(20)
print(count)
""",
    "ticks": """
print(time.ticks_add(0, -1), time.ticks_diff(0, 2**30 - 1), time.ticks_diff(2**29, 0))
attempt("far", time.ticks_add, 0, 2**29)
""",
}


@pytest.fixture(scope="module")
def bench(plain_board):
    plain_board[0].exec(_HEAD)
    return plain_board


def _on_host(script, version, device, bus, tmp_path):
    (tmp_path / "hostscript.py").write_text(_HEAD + script)
    out = io.StringIO()
    port = Port("rp2", {0: bus}, version=version, root=tmp_path, paths=[tmp_path])
    with port, redirect_stdout(out):
        port.run_file(tmp_path / "hostscript.py")
    return out.getvalue()


@pytest.mark.parametrize("name", SCRIPTS)
def test_same_output(bench, name, tmp_path):
    board, _, _ = bench
    device = Ram()
    printed = board.exec(SCRIPTS[name], timeout_s=20).replace("\r\n", "\n")
    assert printed == _on_host(SCRIPTS[name], board.version, device, Bus(device), tmp_path)


_TROUBLE = """
def free():
    scl = machine.Pin(5, machine.Pin.OPEN_DRAIN, value=1)
    sda = machine.Pin(4, machine.Pin.OPEN_DRAIN, value=1)
    clocks = 0
    while not sda.value() and clocks < 20:
        scl.value(0)
        scl.value(1)
        clocks += 1
    sda.value(0)
    sda.value(1)
    return clocks
"""
TROUBLES = {
    "data_nack": (
        None,
        """
attempt("short", i2c.writeto, 0x68, b"\\x01\\x02\\x03\\x04")
""",
    ),
    "held": (
        ("sda_held", {"clocks": 9}),
        """
attempt("held", i2c.readfrom, 0x68, 1)
attempt("clocks", free)
i2c = machine.I2C(0, sda=machine.Pin(4), scl=machine.Pin(5), freq=400_000, timeout=5_000)
attempt("free", i2c.readfrom_mem, 0x68, 0x75, 1)
""",
    ),
    "held_scan": (("sda_held", {"clocks": 20}), "print(i2c.scan())"),
    "arbitration": (
        ("arbitration", {}),
        """
attempt("lost", i2c.readfrom, 0x68, 1)
attempt("lost", i2c.writeto, 0x68, b"\\x01")
""",
    ),
    "stretched": (
        ("timeout", {}),
        """
attempt("stretched", i2c.readfrom_mem, 0x68, 0x75, 1)
attempt("stretched", i2c.writeto, 0x68, b"")
""",
    ),
}


@pytest.mark.parametrize("name", TROUBLES)
def test_same_output_in_trouble(bench, name, tmp_path):
    board, device, bus = bench
    fault, script = TROUBLES[name]
    script = _TROUBLE + script
    host_device = Ram()
    host_bus = Bus(host_device)
    for some_bus, some_device in ((bus, device), (host_bus, host_device)):
        some_bus.faults[:] = [make(fault[0], **fault[1])] if fault else []
        some_device.refuse_at = 2 if name == "data_nack" else None
    printed = board.exec(script, timeout_s=20).replace("\r\n", "\n")
    bus.faults.clear()
    device.refuse_at = None
    assert printed == _on_host(script, board.version, host_device, host_bus, tmp_path)

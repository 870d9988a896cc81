# SPDX-License-Identifier: MIT
"""The virtual Pico's I2C: timing, errors, bit-banging, pins, INT, faults on the wires.

Figures that a real board shows are typed here again, not taken from the emulator's code.
"""

import pytest

from tools.virtual.faults import LostArbitration, SdaHeld, Timeout
from tools.virtual.pico import PicoError, VirtualPico

SETUP = """
import time
from machine import I2C, Pin, SoftI2C
i2c = I2C(0, freq=400_000, timeout=5000)
def burst_us(buffer):
    read, ticks = i2c.readfrom_mem_into, time.ticks_us
    a = ticks(); b = ticks()
    read(0x68, 0x3B, buffer)
    return time.ticks_diff(ticks(), b) - time.ticks_diff(b, a)
"""


@pytest.fixture(scope="module", autouse=True)
def setup(pico):
    pico.exec(SETUP)


@pytest.fixture
def fault(pico, bus):
    """Puts a fault on the bus that begins now; takes it off again."""

    def put(kind, **parameters):
        bus.faults.append(kind(at_s=pico.nanos / 1e9, **parameters))
        return bus.faults[-1]

    yield put
    bus.faults.clear()
    pico.exec("i2c = I2C(0, scl=Pin(5), sda=Pin(4), freq=400_000, timeout=5000)")
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


def test_who_am_i(pico):
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


@pytest.mark.parametrize(("hz", "low", "high"), [(400_000, 390, 450), (100_000, 1560, 1660)])
def test_a_burst_of_14_bytes_takes_the_bus_its_time(pico, hz, low, high):
    """START, 3 bytes, repeated START, 14 bytes, STOP: 156 bit times, and the firmware's share."""
    took = pico.exec(f"i2c = I2C(0, freq={hz}, timeout=5000); print(burst_us(bytearray(14)))")
    assert low <= int(took) <= high


@pytest.mark.parametrize(
    "call",
    [
        "i2c.readfrom_mem(0x50, 0x75, 1)",
        "i2c.writeto(0x50, b'12')",
        "i2c.readfrom(0x69, 2)",
    ],
)
def test_a_missing_address_is_eio(pico, call):
    with pytest.raises(PicoError, match="EIO"):
        pico.exec(call)


def test_a_missing_address_is_enodev_when_the_firmware_bit_bangs(pico):
    """A write of no bytes is what scan() is made of."""
    with pytest.raises(PicoError, match="ENODEV"):
        pico.exec("i2c.writeto(0x50, b'')")
    pico.exec("i2c.writeto(0x68, b'')")


def test_scan_finds_the_chip_alone(pico):
    assert pico.exec("print(i2c.scan())") == "[104]\n"


def test_soft_i2c_reads_and_writes_the_same_registers(pico):
    """0x19 is SMPLRT_DIV, 0x1A CONFIG, 0x6B PWR_MGMT_1: the chip must be awake to keep them."""
    pico.exec("soft = SoftI2C(scl=Pin(5), sda=Pin(4), freq=100_000)")
    pico.exec("soft.writeto_mem(0x68, 0x6B, b'\\x01')")
    pico.exec("soft.writeto_mem(0x68, 0x19, b'\\x12\\x03')")
    assert pico.exec("print(soft.readfrom_mem(0x68, 0x19, 2), soft.scan())") == (
        "b'\\x12\\x03' [104]\n"
    )
    pico.exec("i2c = I2C(0, scl=Pin(5), sda=Pin(4), freq=400_000, timeout=5000)")
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x19, 2))") == "b'\\x12\\x03'\n"


def test_writes_reach_the_chip_in_order(pico, chip):
    pico.exec("i2c.writeto_mem(0x68, 0x6B, b'\\x01'); i2c.writeto_mem(0x68, 0x1A, b'\\x04\\x08')")
    assert (chip.registers[0x1A], chip.registers[0x1B]) == (0x04, 0x08)


def test_the_registers_of_the_i2c_block_can_run_a_burst_alone(pico):
    """A register number and 14 read commands fill 15 of the FIFO's 16 places."""
    printed = pico.exec("""
import machine
i2c.writeto_mem(0x68, 0x6B, bytes([1]))  # awake, so that there is something to read
time.sleep_ms(50)
mem = machine.mem32
I2C0 = 0x40044000
def burst(address, enable=True):
    if enable:
        mem[I2C0 + 0x6C] = 0
        mem[I2C0 + 0x04] = address
        mem[I2C0 + 0x6C] = 1
    mem[I2C0 + 0x10] = 0x3B
    for k in range(14):
        mem[I2C0 + 0x10] = 0x100 | (0x400 if k == 0 else 0) | (0x200 if k == 13 else 0)
    at_once = mem[I2C0 + 0x78]
    time.sleep_ms(1)
    return at_once < 14, mem[I2C0 + 0x78], mem[I2C0 + 0x80] & 0x1FFFF
print(burst(0x68), bytes(mem[I2C0 + 0x10] & 0xFF for _ in range(14)) != bytes(14))
print(burst(0x50))
print(burst(0x50, False))  # the abort is not cleared: nothing is sent
mem[I2C0 + 0x54]
print(mem[I2C0 + 0x80] & 0x1FFFF, burst(0x68))
i2c = I2C(0, freq=400_000, timeout=5000)
print(i2c.readfrom_mem(0x68, 0x75, 1))
""")
    assert printed.splitlines() == [
        "(True, 14, 0) True",
        "(True, 0, 1)",
        "(True, 0, 1)",
        "0 (True, 14, 0)",
        "b'h'",
    ]


def test_the_int_pin_shows_data_ready(pico):
    """SMPLRT_DIV 9 with the filter on: 100 Hz; INT_ENABLE 0x38 bit 0 is DATA_RDY."""
    printed = pico.exec("""
edges = 0
def on_edge(pin):
    global edges
    edges += 1
for register, value in ((0x6B, 1), (0x1A, 3), (0x19, 9), (0x37, 0), (0x38, 1)):
    i2c.writeto_mem(0x68, register, bytes([value]))
pin = Pin(6, Pin.IN)
pin.irq(on_edge, Pin.IRQ_RISING)
time.sleep_ms(200)
pin.irq(None)
i2c.writeto_mem(0x68, 0x38, b'\\x00')
print(edges)
""")
    assert 19 <= int(printed) <= 21


def test_sda_held_low_times_out_and_nine_clocks_free_it(pico, fault):
    fault(SdaHeld, clocks=9)
    with pytest.raises(PicoError, match="ETIMEDOUT"):
        pico.exec("i2c.readfrom(0x68, 1)")
    assert pico.exec("sda = Pin(4, Pin.IN); print(sda.value(), Pin(5, Pin.IN).value())") == "0 1\n"
    levels = pico.exec("""
scl = Pin(5, Pin.OPEN_DRAIN, value=1)
levels = []
for _ in range(9):
    scl.value(0); time.sleep_us(5); scl.value(1); time.sleep_us(5)
    levels.append(sda.value())
sda = Pin(4, Pin.OPEN_DRAIN, value=0); time.sleep_us(5); sda.value(1)
i2c = I2C(0, scl=Pin(5), sda=Pin(4), freq=400_000, timeout=5000)
print(levels, i2c.readfrom_mem(0x68, 0x75, 1))
""")
    assert levels == "[0, 0, 0, 0, 0, 0, 0, 0, 1] b'h'\n"


def test_a_failed_register_read_frees_sda_by_itself(pico, fault):
    """The firmware ends it with a write of no bytes, bit-banged: nine clocks and a STOP."""
    fault(SdaHeld, clocks=9)
    with pytest.raises(PicoError, match="ETIMEDOUT"):
        pico.exec("i2c.readfrom_mem(0x68, 0x75, 1)")
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


def test_a_stretched_clock_times_out_and_the_next_call_works(pico, fault):
    fault(Timeout, for_s=0.020)
    with pytest.raises(PicoError, match="ETIMEDOUT"):
        pico.exec("i2c.readfrom_mem(0x68, 0x75, 1)")
    pico.run_ms(20)
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


def test_a_bus_that_is_busy_for_a_moment_is_waited_for(pico, fault):
    fault(Timeout, for_s=0.004)
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


def test_lost_arbitration_is_eio_and_the_next_call_works(pico, fault):
    fault(LostArbitration, for_s=0.003)
    for call in ("i2c.readfrom(0x68, 1)", "i2c.writeto(0x68, b'u')"):
        with pytest.raises(PicoError, match="EIO"):
            pico.exec(f"{call}")
        pico.run_ms(5)
        fault(LostArbitration, for_s=0.003)
    pico.run_ms(5)
    assert pico.exec("print(i2c.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


@pytest.mark.parametrize(("sda", "scl"), [(5, 4), (8, 9)])
def test_wires_on_other_pins_are_eio_on_the_default_ones(bus, sda, scl):
    with VirtualPico(bus=bus, sda=sda, scl=scl) as board:
        with pytest.raises(PicoError, match="EIO"):
            board.exec("from machine import *; I2C(0).readfrom_mem(0x68, 0x75, 1)")
        line = f"SoftI2C(sda=Pin({sda}), scl=Pin({scl})).scan()"
        assert board.exec(f"print({line})") == "[104]\n"


def test_i2c1_works_on_its_own_pins(bus):
    with VirtualPico(bus=bus, sda=6, scl=7) as board:
        line = "from machine import I2C, Pin; i = I2C(1, sda=Pin(6), scl=Pin(7))"
        assert board.exec(f"{line}; print(i.readfrom_mem(0x68, 0x75, 1))") == "b'h'\n"


def test_without_a_sensor_the_pins_float(pico):
    with VirtualPico() as board:
        levels = board.exec("""
from machine import Pin
print([Pin(p, Pin.IN, pull).value() for p in (4, 5) for pull in (Pin.PULL_UP, Pin.PULL_DOWN)])
""")
    assert levels == "[1, 0, 1, 0]\n"

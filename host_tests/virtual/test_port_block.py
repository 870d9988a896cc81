# SPDX-License-Identifier: MIT
"""The I2C block of RP2040 and RP2350 by its registers (RP2040 datasheet 4.3.17, re-typed)."""

import pytest

from host_tests.virtual.port_rig import ADDRESS, Ram
from tools.virtual.bus import Bus
from tools.virtual.faults import make
from tools.virtual.port import Port
from tools.virtual.port.wire import BusInUse

CON, TAR, DATA_CMD, RAW_INTR, CLR_ABRT = 0x00, 0x04, 0x10, 0x34, 0x54
ENABLE, STATUS, TXFLR, RXFLR, ABRT = 0x6C, 0x70, 0x74, 0x78, 0x80
TIMER = 0x40054000


class Block:
    """Registers by name through machine.mem32."""

    def __init__(self, base):
        import machine

        self.memory, self.base = machine.mem32, base

    def __getitem__(self, offset):
        return self.memory[self.base + offset]

    def __setitem__(self, offset, value):
        self.memory[self.base + offset] = value

    def burst(self, address=ADDRESS, register=0x3B, count=14):
        self[ENABLE] = 0
        self[TAR] = address
        self[ENABLE] = 1
        self[DATA_CMD] = register
        for index in range(count):
            first, last = index == 0, index == count - 1
            self[DATA_CMD] = 0x100 | (0x400 if first else 0) | (0x200 if last else 0)

    def take(self):
        return bytes(self[DATA_CMD] & 0xFF for _ in range(self[RXFLR]))


@pytest.fixture(params=[("RP2040", 0, 0x40044000), ("RP2350", 1, 0x40098000)])
def rig(request):
    """(port, block, device, bus) with machine.I2C made, once on each chip."""
    machine_name, number, base = request.param
    device = Ram()
    bus = Bus(device)
    with Port("rp2", {number: bus}, machine_name=machine_name) as port:
        import machine

        machine.I2C(number, freq=400_000)
        yield port, Block(base), device, bus


def test_burst_in_the_background(rig):
    port, block, device, bus = rig
    before = port.now_ns
    block.burst()
    assert block[TXFLR] == 15 or block[TXFLR] == 14
    assert block[RXFLR] == 0
    assert block[STATUS] & 0x21 == 0x21  # ACTIVITY and MST_ACTIVITY
    started = port.now_ns
    assert started - before < 5_000
    port.clock.sleep(200_000)
    assert 0 < block[RXFLR] < 14
    port.clock.sleep(195_000)
    assert block[RXFLR] == 14
    assert block[STATUS] & 0x20 == 0
    assert block[RAW_INTR] & 0x200  # STOP_DET
    assert block.take() == bytes(range(0x3B, 0x3B + 14))
    assert len(bus.log) == 1 and bus.log[0].outcome == "ok"
    bits = [late - early for early, late in zip(device.reads_ns, device.reads_ns[1:])]
    assert all(abs(step - 22_500) < 100 for step in bits[1:])  # nine bits of 400 kHz


def test_first_byte_is_marked(rig):
    port, block, _, _ = rig
    block.burst(count=2)
    port.run_ms(1)
    assert [block[DATA_CMD], block[DATA_CMD]] == [0x800 | 0x3B, 0x3C]
    assert block[DATA_CMD] == 0
    assert block[RAW_INTR] & 0x01  # RX_UNDER


def test_address_not_acknowledged_aborts_and_flushes(rig):
    port, block, _, _ = rig
    block.burst(address=0x69)
    port.run_ms(1)
    assert block[ABRT] & 0xFFFF == 0x0001  # ABRT_7B_ADDR_NOACK
    assert block[ABRT] >> 23 >= 14  # commands flushed
    assert block[RAW_INTR] & 0x40
    assert (block[TXFLR], block[RXFLR]) == (0, 0)
    block[DATA_CMD] = 0x75  # held empty until the abort is cleared
    assert block[TXFLR] == 0
    assert block[CLR_ABRT] == 0
    assert block[ABRT] == 0
    block.burst()
    port.run_ms(1)
    assert block[RXFLR] == 14


def test_data_not_acknowledged(rig):
    port, block, device, _ = rig
    device.refuse_at = 0
    block.burst()
    port.run_ms(1)
    assert block[ABRT] & 0xFFFF == 0x0008  # ABRT_TXDATA_NOACK


def test_lost_arbitration(rig):
    port, block, _, bus = rig
    bus.faults.append(make("arbitration", at_s=0))
    block.burst()
    port.run_ms(1)
    assert block[ABRT] & 0xFFFF == 0x1000  # ARB_LOST


def test_stuck_bus_waits_and_goes_on(rig):
    port, block, _, bus = rig
    bus.faults.append(make("timeout", at_s=0, for_s=0.003))
    block.burst()
    port.run_ms(2)
    assert block[RXFLR] == 0
    assert block[STATUS] & 0x20
    port.run_ms(2)
    assert block[RXFLR] == 14


def test_fifo_of_sixteen_and_overflow(rig):
    port, block, _, _ = rig
    block[TAR] = ADDRESS
    block[ENABLE] = 1
    for _ in range(20):
        block[DATA_CMD] = 0x100
    assert block[RAW_INTR] & 0x08  # TX_OVER
    port.run_ms(2)
    assert block[RXFLR] == 16
    for _ in range(3):
        block[DATA_CMD] = 0x100
    port.run_ms(1)
    assert block[RAW_INTR] & 0x02  # RX_OVER
    assert block[STATUS] & 0x18 == 0x18  # RFNE, RFF


def test_disabled_or_in_reset_does_nothing(rig):
    port, block, _, bus = rig
    block[ENABLE] = 0
    block[DATA_CMD] = 0x75
    port.run_ms(1)
    assert len(bus.log) == 0 and block[TXFLR] == 0


def test_another_master_object_during_a_burst_is_caught(rig):
    port, block, _, _ = rig
    import machine

    number = next(iter(port.buses))
    block.burst()
    port.clock.sleep(100_000)
    with pytest.raises(BusInUse):
        machine.I2C(number).readfrom_mem(ADDRESS, 0x75, 1)
    port.run_ms(1)
    assert machine.I2C(number).readfrom_mem(ADDRESS, 0x75, 1) == b"\x75"


def test_user_abort_ends_a_burst_with_a_stop(rig):
    port, block, _, bus = rig
    block.burst()
    port.clock.sleep(100_000)
    block[ENABLE] = 3
    port.clock.sleep(50_000)
    assert block[ENABLE] == 1
    assert block[ABRT] & 0x10000  # ABRT_USER_ABRT
    assert bus.log[-1].outcome == "ok"


def test_alias_regions_set_and_clear(rig):
    _, block, _, _ = rig
    import machine

    machine.mem32[block.base + 0x2000 + ENABLE] = 1
    assert block[ENABLE] == 1
    machine.mem32[block.base + 0x3000 + ENABLE] = 1
    assert block[ENABLE] == 0
    block[TAR] = 0x55
    machine.mem32[block.base + 0x1000 + TAR] = 0x0F
    assert block[TAR] == 0x5A


def test_nothing_else_is_at_other_addresses():
    with Port("rp2", {0: Bus(Ram())}):
        import machine

        with pytest.raises(RuntimeError, match="held in reset"):
            block = Block(0x40044000)
            block.burst()
            machine.idle()
        with pytest.raises(ValueError, match="0x40090000"):
            machine.mem32[0x40090000]
    with Port("esp32"):
        import machine

        with pytest.raises(ValueError):
            machine.mem32[0x40044000]


def test_microsecond_counter_agrees_with_ticks():
    with Port("rp2", call_ns=0) as port:
        import time

        import machine

        port.run_ms(1)
        assert machine.mem32[TIMER + 0x28] & (2**30 - 1) == time.ticks_us()
        assert machine.mem32[TIMER + 0x24] == 0

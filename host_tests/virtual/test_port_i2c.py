# SPDX-License-Identifier: MIT
"""machine.I2C and SoftI2C of both ports: signatures, texts, errors and times."""

import pytest

from host_tests.virtual.port_rig import ADDRESS, Ram
from tools.virtual.bus import Bus
from tools.virtual.faults import make
from tools.virtual.port import Port

NACK = {"rp2": 5, "esp32": 19}
TIMED_OUT = {"rp2": 110, "esp32": 116}


@pytest.fixture(params=["rp2", "esp32"])
def rig(request):
    """(port, i2c, device, bus) with one device on bus 0."""
    device = Ram()
    bus = Bus(device)
    with Port(request.param, {0: bus}) as port:
        import machine

        yield port, machine.I2C(0, freq=400_000), device, bus


def failure(call, *arguments, **keywords):
    with pytest.raises(OSError) as caught:
        call(*arguments, **keywords)
    return caught.value.errno


def test_reads_and_writes(rig):
    _, i2c, device, bus = rig
    assert i2c.scan() == [ADDRESS]
    assert i2c.readfrom_mem(ADDRESS, 0x75, 3) == b"\x75\x76\x77"
    buffer = bytearray(14)
    assert i2c.readfrom_mem_into(ADDRESS, 0x3B, buffer, addrsize=8) is None
    assert buffer == bytes(range(0x3B, 0x3B + 14))
    assert i2c.writeto_mem(ADDRESS, 0x10, b"\xaa\xbb") is None
    assert device.registers[0x10:0x12] == b"\xaa\xbb"
    assert i2c.writeto(ADDRESS, b"\x20\x01\x02") == 3
    assert i2c.writevto(ADDRESS, (b"\x30", b"", b"\x05\x06")) == 3
    assert device.registers[0x20:0x22] == b"\x01\x02"
    assert device.registers[0x30:0x32] == b"\x05\x06"
    assert i2c.writeto(ADDRESS, b"\x40", False) == 1
    assert i2c.readfrom(ADDRESS, 2) == b"\x40\x41"
    i2c.readfrom_into(ADDRESS, buffer)
    assert buffer[0] == 0x42
    assert {entry.outcome for entry in bus.log if entry.address == ADDRESS} == {"ok"}


def test_wide_register_numbers(rig):
    _, i2c, device, _ = rig
    i2c.writeto_mem(ADDRESS, 0x5061, b"\x07", addrsize=16)
    assert device.registers[0x50:0x52] == b"\x61\x07"
    with pytest.raises(ValueError, match="invalid addrsize"):
        i2c.readfrom_mem(ADDRESS, 0, 1, addrsize=12)


def test_text_of_the_object():
    with Port("rp2"):
        import machine

        assert repr(machine.I2C(0)) == "I2C(0, freq=399361, scl=5, sda=4, timeout=50000)"
        assert repr(machine.I2C(1, freq=100_000, timeout=2000)) == (
            "I2C(1, freq=100000, scl=7, sda=6, timeout=2000)"
        )
    with Port("rp2", machine_name="RP2350"):
        import machine

        assert repr(machine.I2C(0)) == "I2C(0, freq=400000, scl=5, sda=4, timeout=50000)"
    with Port("esp32"):
        import machine

        assert repr(machine.I2C(0)) == "I2C(0, scl=18, sda=19, freq=400000)"


def test_one_object_for_each_block_and_pins_that_fit():
    with Port("rp2"):
        import machine

        first = machine.I2C(0, freq=100_000)
        assert machine.I2C(0) is first
        assert "freq=100000" in repr(first)
        for pins, text in (((0, 2), "bad SCL pin"), ((3, 1), "bad SDA pin")):
            with pytest.raises(ValueError, match=text):
                machine.I2C(0, sda=machine.Pin(pins[0]), scl=machine.Pin(pins[1]))
        with pytest.raises(ValueError, match=r"I2C\(2\) doesn't exist"):
            machine.I2C(2)
    with Port("esp32", machine_name="ESP32C3"):
        import machine

        with pytest.raises(ValueError, match="doesn't exist"):
            machine.I2C(1)
        with pytest.raises(TypeError):
            machine.I2C(0, 400_000)


def test_hardware_has_no_primitive_operations(rig):
    _, i2c, _, _ = rig
    for call in (i2c.start, i2c.stop):
        with pytest.raises(OSError, match="I2C operation not supported"):
            call()
    for call in (i2c.write, i2c.readinto):
        with pytest.raises(OSError, match="not supported"):
            call(bytearray(1))


def test_errno_of_a_missing_device(rig):
    port, i2c, _, bus = rig
    expected = NACK[port.traits.platform]
    assert failure(i2c.readfrom_mem, 0x69, 0x75, 1) == expected
    assert failure(i2c.writeto, 0x69, b"\0") == expected
    assert failure(i2c.readfrom, 0x69, 1) == expected
    assert failure(i2c.writeto, 0x69, b"") == 19  # bit-banged on rp2: always ENODEV
    assert bus.log[-1].outcome == "nack"


def test_data_not_acknowledged_is_silent_on_rp2(rig):
    port, i2c, device, _ = rig
    device.refuse_at = 2
    if port.traits.platform == "esp32":
        assert failure(i2c.writeto, ADDRESS, b"\x01\x02\x03\x04") == 19
    else:
        assert i2c.writeto(ADDRESS, b"\x01\x02\x03\x04") == 2
        device.refuse_at = 0
        assert i2c.readfrom_mem(ADDRESS, 0x10, 2) == b"\0\0"


def test_lost_arbitration(rig):
    port, i2c, _, bus = rig
    bus.faults.append(make("arbitration", at_s=0))
    expected = {"rp2": 5, "esp32": 116}[port.traits.platform]
    assert failure(i2c.readfrom, ADDRESS, 1) == expected


@pytest.mark.parametrize("fault", ["sda_held", "timeout"])
def test_held_line_times_out_after_the_timeout(rig, fault):
    port, i2c, _, bus = rig
    bus.faults.append(make(fault, at_s=0))
    before = port.now_ns
    assert failure(i2c.readfrom, ADDRESS, 1) == TIMED_OUT[port.traits.platform]
    # the port's own 50 ms; the classic ESP32's block counts to 2^20 at 80 MHz
    waits_ms = 50.0 if port.traits.platform == "rp2" else 13.1
    assert waits_ms <= (port.now_ns - before) / 1e6 < waits_ms + 5


def test_burst_takes_its_time_on_the_bus(rig):
    """Measured on the emulated RP2040: 449 us, 390 of them on the wires."""
    port, i2c, _, _ = rig
    buffer = bytearray(14)
    before = port.now_ns
    i2c.readfrom_mem_into(ADDRESS, 0x3B, buffer)
    assert 440e3 < port.now_ns - before < 460e3


def test_pins_taken_away_stop_the_block_until_a_new_object():
    device = Ram()
    with Port("rp2", {0: Bus(device)}):
        import machine

        i2c = machine.I2C(0, freq=400_000)
        machine.Pin(5, machine.Pin.OPEN_DRAIN)
        assert failure(i2c.writeto, ADDRESS, b"\0") == 110
        i2c = machine.I2C(0, freq=400_000)
        assert i2c.writeto(ADDRESS, b"\0") == 1


def test_soldered_wrongly_finds_nothing():
    """SDA and SCL swapped, or another pair of pins: no acknowledge."""
    with Port("rp2", {0: Bus(Ram())}, wiring={0: (4, 5)}):
        import machine

        assert machine.I2C(0).scan() == [ADDRESS]
        assert machine.I2C(0, sda=machine.Pin(0), scl=machine.Pin(1)).scan() == []
    with Port("esp32", {0: Bus(Ram())}, wiring={0: (21, 22)}):
        import machine

        swapped = machine.I2C(0, sda=machine.Pin(22), scl=machine.Pin(21))
        assert failure(swapped.readfrom_mem, ADDRESS, 0x75, 1) == 19


def test_scan_of_a_held_bus_sees_every_address_until_it_is_free():
    """Bit-banging takes SDA held low for an acknowledge; its nine clocks free the slave."""
    bus = Bus(Ram(), faults=[make("sda_held", clocks=20)])
    with Port("rp2", {0: bus}):
        import machine

        found = machine.I2C(0).scan()
    assert found == [0x08, 0x09, ADDRESS]


def test_soft_i2c_has_the_primitives(rig):
    port, _, device, _ = rig
    import machine

    sda, scl = port.pins.lines[0]
    soft = machine.SoftI2C(scl=machine.Pin(scl), sda=machine.Pin(sda), freq=400_000)
    assert soft.scan() == [ADDRESS]
    assert soft.readfrom_mem(ADDRESS, 0x75, 2) == b"\x75\x76"
    soft.start()
    assert soft.write(bytes((ADDRESS << 1, 0x22, 9))) == 3
    soft.start()
    soft.write(bytes((ADDRESS << 1, 0x21)))
    soft.start()
    soft.write(bytes((ADDRESS << 1 | 1,)))
    buffer = bytearray(2)
    soft.readinto(buffer)
    soft.stop()
    assert buffer == b"\x21\x09"
    assert device.registers[0x22] == 9
    assert failure(soft.readfrom_mem, 0x69, 0, 1) == 19

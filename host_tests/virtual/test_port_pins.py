# SPDX-License-Identifier: MIT
"""Pins: levels, interrupts, the INT line of a chip, nine clocks that free a stuck bus, PWM."""

import itertools

import pytest

from host_tests.virtual.port_rig import ADDRESS, Ram
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.faults import make
from tools.virtual.port import Port


@pytest.mark.parametrize(
    ("platform", "constants"),
    [
        (
            "rp2",
            {"IN": 0, "OUT": 1, "OPEN_DRAIN": 2, "PULL_UP": 1, "IRQ_RISING": 8, "IRQ_FALLING": 4},
        ),
        (
            "esp32",
            {"IN": 1, "OUT": 3, "OPEN_DRAIN": 7, "PULL_UP": 2, "IRQ_RISING": 1, "IRQ_FALLING": 2},
        ),
    ],
)
def test_constants_of_the_port(platform, constants):
    with Port(platform):
        import machine

        assert {name: getattr(machine.Pin, name) for name in constants} == constants
        assert hasattr(machine.Pin, "low") == (platform == "rp2")


def test_output_input_and_log():
    with Port("rp2") as port:
        import machine

        led = machine.Pin("LED", machine.Pin.OUT, value=1)
        assert led.value() == 1
        led.toggle()
        led(1)
        led.off()
        assert [level for _, level in port.pin(25).log] == [1, 0, 1, 0]
        assert machine.Pin(25) is led
        button = machine.Pin(14, machine.Pin.IN, machine.Pin.PULL_UP)
        assert button.value() == 1
        port.pin(14).drive(0)
        assert button() == 0
        assert repr(button) == "Pin(GPIO14, mode=IN, pull=PULL_UP)"
        for wrong in (30, -1, "GP99"):
            with pytest.raises(ValueError):
                machine.Pin(wrong)


def test_soft_and_hard_interrupts_and_their_edges():
    with Port("rp2") as port:
        import machine

        soft, hard = [], []
        pin = machine.Pin(6, machine.Pin.IN)
        pin.irq(soft.append, machine.Pin.IRQ_RISING)
        machine.Pin(7, machine.Pin.IN).irq(hard.append, machine.Pin.IRQ_FALLING, hard=True)
        port.clock.scheduler.running = True  # as in another callback
        for level in (1, 0, 1):
            port.pin(6).drive(level)
            port.pin(7).drive(level)
        assert (len(soft), len(hard)) == (0, 1)
        port.clock.scheduler.running = False
        port.run_ms(0)
        assert soft == [pin, pin]
        pin.irq(None)
        port.pin(6).drive(0)
        port.pin(6).drive(1)
        port.run_ms(0)
        assert len(soft) == 2


def test_esp32_knows_no_hard_pin_interrupt():
    with Port("esp32"):
        import machine

        with pytest.raises(TypeError, match="extra keyword"):
            machine.Pin(4, machine.Pin.IN).irq(print, machine.Pin.IRQ_RISING, hard=True)


def test_data_ready_edges_come_at_the_chips_own_instants():
    """200 Hz sample rate: SMPLRT_DIV 4 with the DLPF on; INT_ENABLE bit 0, 50 us pulses."""
    chip = MPU6050Chip(noise=False)
    with Port("rp2", {0: Bus(chip)}) as port:
        import machine

        port.connect_int(chip, 6)
        edges = []
        machine.Pin(6, machine.Pin.IN).irq(
            lambda pin: edges.append(port.now_ns), machine.Pin.IRQ_RISING
        )
        i2c = machine.I2C(0, freq=400_000)
        for register, value in ((0x6B, 1), (0x1A, 3), (0x19, 4), (0x38, 1)):
            i2c.writeto_mem(ADDRESS, register, bytes((value,)))
        port.run_ms(50)
        edges.clear()
        port.run_ms(1000)
    assert 199 <= len(edges) <= 201
    gaps = {late - early for early, late in itertools.pairwise(edges)}
    assert all(abs(gap - 5_000_000) < 2000 for gap in gaps)


@pytest.mark.parametrize("platform", ["rp2", "esp32"])
def test_nine_clocks_and_a_stop_free_a_stuck_bus(platform):
    bus = Bus(Ram(), faults=[make("sda_held", clocks=9)])
    with Port(platform, {0: bus}) as port:
        import machine

        i2c = machine.I2C(0, freq=400_000)
        port.run_ms(1)
        sda_pin, scl_pin = port.pins.lines[0]
        with pytest.raises(OSError):
            i2c.writeto(ADDRESS, b"\0")
        scl = machine.Pin(scl_pin, machine.Pin.OPEN_DRAIN, value=1)
        sda = machine.Pin(sda_pin, machine.Pin.OPEN_DRAIN, value=1)
        clocks = 0
        while not sda.value():
            scl.value(0)
            scl.value(1)
            clocks += 1
        assert clocks == 9
        sda.value(0)
        assert sda.value() == 0
        sda.value(1)
        assert sda.value() == 1
        i2c = machine.I2C(0, freq=400_000)
        assert i2c.writeto(ADDRESS, b"\0") == 1


def test_pwm_is_recorded():
    with Port("rp2") as port:
        import machine

        pwm = machine.PWM(machine.Pin(15), freq=50, duty_ns=1_500_000)
        port.run_ms(20)
        pwm.duty_ns(2_000_000)
        assert [(t, hz) for t, hz, _ in port.pin(15).pwm.history][-1] == (20_000_000, 50)
        assert pwm.duty_ns() == pytest.approx(2_000_000, abs=400)
        assert pwm.duty_u16() == pytest.approx(6553, abs=1)
        assert pwm.freq() == 50
        pwm.deinit()
        assert port.pin(15).pwm is None


def test_adc_reads_what_the_test_sets():
    with Port("rp2") as port:
        import machine

        port.adc[26] = 12345
        assert machine.ADC(machine.Pin(26)).read_u16() == 12345

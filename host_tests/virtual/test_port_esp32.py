# SPDX-License-Identifier: MIT
"""The ESP32 personality by chip and MicroPython's version: what its sources make it do."""

import pytest

from host_tests.virtual.port_rig import Ram
from tools.virtual import Bus, Port, faults

ENODEV, ETIMEDOUT = 19, 116


def transfer_ms(chip, version, timeout_us, fault="timeout", size=14):
    """(milliseconds, errno or None) of a read from registers with a line held low."""
    bus = Bus(Ram())
    if fault:
        bus.faults.append(faults.make(fault, at_s=0.0))
    with Port("esp32", {0: bus}, machine_name=chip, version=version) as port:
        import machine

        i2c = machine.I2C(0, scl=machine.Pin(9), sda=machine.Pin(8), timeout=timeout_us)
        buffer, began = bytearray(size), port.now_ns
        try:
            i2c.readfrom_mem_into(0x68, 0x3B, buffer)
            code = None
        except OSError as error:
            code = error.args[0]
        return (port.now_ns - began) / 1e6, code


@pytest.mark.parametrize("version", [(1, 24, 0), (1, 25, 0), (1, 26, 0), (1, 27, 0)])
@pytest.mark.parametrize("timeout_us, waits_ms", [(2000, 2), (10000, 10), (50000, 13.1)])
def test_the_classic_chip_waits_as_told_up_to_its_20_bits(version, timeout_us, waits_ms):
    ms, code = transfer_ms("ESP32", version, timeout_us)
    assert ms == pytest.approx(waits_ms, abs=0.3) and code == ETIMEDOUT


@pytest.mark.parametrize("chip", ["ESP32S3", "ESP32C3", "ESP32C6"])
def test_s3_c3_and_c6_are_deaf_before_1_27(chip):
    for version in ((1, 24, 0), (1, 25, 0), (1, 26, 1)):
        ms, code = transfer_ms(chip, version, 2000)
        assert 900 < ms < 1010 and code == ETIMEDOUT
        assert 300 <= transfer_ms(chip, version, 2000, size=1)[0] < 320  # 100 ms for each byte
    ms, code = transfer_ms(chip, (1, 27, 0), 2000)
    assert ms == pytest.approx(2, abs=0.3) and code == ETIMEDOUT


@pytest.mark.parametrize("chip", ["ESP32", "ESP32S3", "ESP32C3"])
def test_the_new_driver_counts_whole_ticks_and_knows_one_error(chip):
    version = (1, 29, 0)
    for timeout_us in (2000, 9999):  # no tick at all: even a good transfer fails at once
        ms, code = transfer_ms(chip, version, timeout_us, fault=None)
        assert ms < 0.2 and code == ENODEV
    ms, code = transfer_ms(chip, version, 20000, fault=None)
    assert code is None
    ms, code = transfer_ms(chip, version, 20000)
    assert ms == pytest.approx(20, abs=0.3) and code == ENODEV
    assert transfer_ms(chip, version, 20000, fault="nack")[1] == ENODEV
    assert transfer_ms(chip, version, 20000, fault="arbitration")[1] == ENODEV


@pytest.mark.parametrize("chip, version, text", [
    ("ESP32", (1, 28, 0), "Generic ESP32 module with ESP32"),
    ("ESP32", (1, 29, 0), "Generic ESP32 module with ESP32"),
    ("ESP32S3", (1, 28, 0), "Generic ESP32S3 module with ESP32S3"),
    ("ESP32S3", (1, 29, 0), "Generic ESP32S3 module with ESP32-S3"),
    ("ESP32C6", (1, 29, 0), "ESP32C6 module with ESP32-C6"),
])  # fmt: skip
def test_the_chips_name_is_esp_idfs_from_1_29_on(chip, version, text):
    with Port("esp32", machine_name=chip, version=version) as port:
        assert port.modules["sys"].implementation._machine == text


def test_a_pwm_begins_with_half_of_its_period_unless_told():
    with Port("esp32") as port:
        import machine

        machine.PWM(machine.Pin(25))
        machine.PWM(machine.Pin(26), freq=400)
        machine.PWM(machine.Pin(27), freq=400, duty_ns=1_000_000)
        machine.PWM(machine.Pin(14), freq=400, duty_u16=0)
        first = {pin: port.pin(pin).pwm.history[0] for pin in (25, 26, 27, 14)}
        assert first[25][1:] == (5000, 32768)
        assert {entry[2] for entry in port.pin(26).pwm.history} == {32768}  # 1250 us at 400 Hz
        assert 32768 not in {entry[2] for entry in port.pin(27).pwm.history}
        assert {entry[2] for entry in port.pin(14).pwm.history} == {0}
    with Port("rp2") as port:
        import machine

        machine.PWM(machine.Pin(16), freq=400)
        assert {entry[2] for entry in port.pin(16).pwm.history} == {0}


def write_ms(chip, reading, count, size=64):
    """Milliseconds of each of so many writes, and what poll() said before each."""
    with Port("rp2" if chip.startswith("RP") else "esp32", machine_name=chip) as port:
        select, sys = port.modules["select"], port.modules["sys"]
        poll = select.poll()
        poll.register(sys.stdout, select.POLLOUT)
        port.console.reading = reading
        times, said = [], []
        for _ in range(count):
            said.append(bool(list(poll.ipoll(0))))
            began = port.now_ns
            sys.stdout.write("x" * size)
            times.append((port.now_ns - began) / 1e6)
        return times, said


def test_a_uart_sends_at_115200_baud_behind_128_bytes(capsys):
    times, said = write_ms("ESP32", True, 4)
    assert times[:2] == [0, 0] and all(said)
    assert times[2:] == [pytest.approx(64 * 10 / 115.2, rel=0.01)] * 2
    assert write_ms("ESP32", False, 4) == (times, said)  # it does not know


def test_the_usb_of_s3_and_c3_waits_for_a_reader_who_went_away(capsys):
    times, said = write_ms("ESP32S3", False, 7)
    assert times == [0, 0, 0, 0, 500, 500, 500] and all(said)
    times, said = write_ms("ESP32C3", False, 4)
    assert times == [200, 0, 0, 0] and all(said)
    assert set(write_ms("ESP32S3", True, 50)[0]) == {0}


def test_the_usb_of_a_pico_says_that_nobody_reads(capsys):
    times, said = write_ms("RP2040", False, 5)
    assert said == [True] * 4 + [False] and times == [0, 0, 0, 0, 500]


def test_one_callback_is_run_at_each_check():
    with Port("esp32") as port:
        import micropython

        ran = []
        for n in range(5):
            micropython.schedule(ran.append, n)
        seen = []
        for _ in range(6):
            port.time.ticks_us()
            seen.append(len(ran))
        assert seen[-1] == 5 and max(b - a for a, b in zip([0, *seen], seen)) == 1
        for n in range(5):
            micropython.schedule(ran.append, n)
        port.time.sleep_ms(1)
        assert len(ran) == 10  # a wait checks many times

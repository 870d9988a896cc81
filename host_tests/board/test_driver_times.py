# SPDX-License-Identifier: MIT
"""The driver under the real firmware on the emulated RP2040: values, microseconds, heap."""

import pytest

from host_tests.board.driver_rig import driver_board, value
from tools.virtual.faults import make


@pytest.fixture(scope="module")
def board(micropython):
    with driver_board(micropython) as pico:
        yield pico


def test_values_are_those_of_the_motion(board):
    accel, gyro, temp = value(board, "imu.read()", "imu.accel_g(), imu.gyro_dps(), imu.temp_c()")
    assert accel == pytest.approx((0.31, -1.07, 1.83), abs=1 / 4096)
    assert gyro == pytest.approx((97.0, -181.0, 239.0), abs=1 / 65.5)
    assert temp == pytest.approx(31.0, abs=1 / 340)


def test_all_ways_to_fetch_agree_in_one_transaction_each(board):
    board.bus.log.clear()
    code = """
way = []
imu.read(); way.append(list(imu.counts))
for i in range(7): imu.counts[i] = 0
imu.start(); time.sleep_ms(3); arrived = imu.collect(); way.append(list(imu.counts))
plain = bytearray(14); i2c.readfrom_mem_into(0x68, 0x3B, plain)
way.append([int.from_bytes(plain[i:i + 2], 'big') for i in range(0, 14, 2)])
way[2] = [w - 65536 if w > 32767 else w for w in way[2]]
"""
    arrived, ways = value(board, code, "(arrived, way)")
    assert arrived
    assert ways[0] == ways[1] == ways[2] != [0] * 7
    assert [(t.written, len(t.read), t.outcome) for t in board.bus.log] == [
        (b"\x3b", 14, "ok")
    ] * 3


def test_times(board):
    """The bus alone takes 386 us at 399 kHz; start() and collect() leave it to the block."""
    code = """
def done():
    time.sleep_us(600)
    imu.collect()
def begun():
    imu.start()
    time.sleep_us(600)
times = us_of(imu.read), us_of(imu.start, done), us_of(imu.collect, begun)
imu.collect()
check = us_of(imu.check)
"""
    (read, start, collect), check = value(board, code, "(times, check)")
    assert 386 < read < 470
    assert start < 13
    assert collect < 24
    assert check < 340


def test_nothing_is_allocated(board):
    code = """
def split():
    imu.start()
    while not imu.collect():
        pass
def check():
    imu.check()
    imu.plausible()
used, locked = (bytes_of(imu.read), bytes_of(split), bytes_of(check)), None
import micropython
micropython.heap_lock()
try:
    split(); imu.read(); check(); imu.start(); imu.check(); locked = imu.collect()
finally:
    micropython.heap_unlock()
"""
    assert value(board, code, "(used, locked)") == ((0, 0, 0), True)


def test_blocking_calls_and_a_burst_under_way(board):
    code = """
imu.start(); imu.start(); imu.check(); first = imu.collect()
imu.start(); imu.read(); second = imu.collect()
third = imu.collect(); time.sleep_ms(3); fourth = imu.collect()
imu.start(); imu.set_range(gyro_dps=1000); fifth = imu.collect()
imu.set_range(gyro_dps=500)
"""
    answers = value(board, code, "(first, second, third, fourth, fifth)")
    assert answers == (True, True, False, True, True)


FAIL = """
def errno_of(function):
    try:
        return function()
    except OSError as error:
        return -error.args[0]
imu.start(); time.sleep_ms(3)
errors = [errno_of(imu.collect), %s]
"""


def _during(board, fault, code, last, ms=40):
    """The same while a fault lasts, which is over when it returns."""
    until = board.nanos + ms * 1e6
    board.bus.faults.append(make(fault, at_s=board.nanos * 1e-9, for_s=ms * 1e-3))
    result = value(board, code, last)
    assert board.nanos < until, "the fault ended too early"
    board.run_ms((until - board.nanos) * 1e-6 + 1)
    board.bus.faults.clear()
    return result


def test_a_nack_is_eio(board):
    assert _during(board, "nack", FAIL % "errno_of(imu.read)", "errors") == [-5, -5]
    assert value(board, "imu.start(); time.sleep_ms(3)", "imu.collect()")


def test_a_stuck_bus_is_etimedout(board):
    assert _during(board, "timeout", FAIL % "", "errors") == [-110]
    assert value(board, "imu.read(); imu.start(); time.sleep_ms(3)", "imu.collect()")


def test_construction_names_what_is_wrong(board):
    code = """
def text_of(**settings):
    try:
        MPU6050(i2c, **settings)
    except (OSError, ValueError) as error:
        return error.args[-1]
"""
    wrong = value(board, code, "text_of(address=0x69)")
    assert "at 0x69" in wrong and "EIO" in wrong
    assert "answers at 0x68: AD0 is wired low" in wrong
    assert "choose one of [250, 500, 1000, 2000]" in value(board, "", "text_of(gyro_dps=300)")
    absent = _during(board, "nack", code, "text_of()", ms=1500)
    assert "Nothing answers on this bus" in absent

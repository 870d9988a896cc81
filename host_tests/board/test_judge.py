# SPDX-License-Identifier: MIT
"""The judge on both instruction sets: the verdicts and the memory of the PC, to the bit.

Thumb is the emulated RP2040, RISC-V the ESP32-C3; integers do not wrap on the PC.
"""

import pytest

from tools.virtual.images import run_rv32
from tools.virtual.port import Port
from tools.virtual.rp2040.flash import ROOT

BURSTS = 1500
# Small ints only, so that all three draw the same bursts: at rest, and now and then each damage.
PROGRAM = """
import binascii
from array import array
from firmware.tick import judge

def bursts(seed, n):
    rest = (30, -20, 4090, -3900, 130, -100, 66)
    counts = array("h", rest)
    for _ in range(n):
        seed = (seed * 7919 + 12345) % 1000003
        what, word, bit = seed % 40, seed // 40 % 7, seed // 280 % 16
        for i in range(7):
            seed = (seed * 7919 + 12345) % 1000003
            counts[i] = rest[i] + seed % 9 - 4
        if what < 4:  # one bit is wrong
            value = counts[word] & 0xFFFF ^ 1 << bit
            counts[word] = value - 65536 if value & 0x8000 else value
        elif what == 4:  # the tail is filled
            for i in range(word, 7):
                counts[i] = -258
        elif what == 5:  # at full scale
            counts[word] = 32767 if bit & 1 else -32768
        yield counts
        if what == 6:  # the same again and again
            for _ in range(4):
                yield counts

def judged(seed, n):
    memory = judge.memory()
    judge.allow(memory, 2)
    answers = bytearray()
    left = 0
    for counts in bursts(seed, n):
        answers.append(judge.judge(counts, memory))
        left = binascii.crc32(counts, left)
    seen = [0] * 7
    for answer in answers:
        seen[answer] += 1
    return seen, binascii.crc32(answers), left, binascii.crc32(memory)
"""


@pytest.fixture(scope="module")
def expected():
    with Port("rp2"):
        space = {}
        exec(PROGRAM, space)
        return space["judged"](5, BURSTS)


def test_every_verdict_is_among_them(expected):
    good, _, _, *faults = expected[0]
    assert good > BURSTS // 2
    assert min(faults) >= 5  # fill, frozen, jump, saturated


def test_the_pico_judges_as_the_pc(pico, expected):
    assert pico.exec(PROGRAM + f"print(judged(5, {BURSTS}))", timeout_s=30) == f"{expected}\n"


def test_risc_v_judges_as_the_pc(expected):
    files = {"firmware/tick/judge.py": ROOT / "firmware" / "tick" / "judge.py"}
    assert run_rv32(files, PROGRAM + f"print(judged(5, {BURSTS}))") == f"{expected}\n"

# SPDX-License-Identifier: MIT
"""Frames, samples out of them, and a line that is damaged, slow, or gone for a while."""

import json
import struct

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tools.link.frames import Splitter, decode, encode
from tools.link.reader import Reader

contents = st.binary(min_size=28, max_size=28)


def crc_ccitt(data):
    """CRC-16 of polynomial 0x1021, bit by bit, start 0xFFFF; words with their high byte first."""
    crc = 0xFFFF
    for at in range(0, len(data), 2):
        for byte in (data[at + 1], data[at]):
            crc ^= byte << 8
            for _ in range(8):
                crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


@given(contents)
def test_a_frame_is_32_bytes_with_one_ff_and_comes_back(content):
    frame = encode(content)
    assert len(frame) == 32 and frame[0] == 0xFF and frame.count(b"\xff") == 1
    assert decode(frame[1:]) == content


@given(contents)
def test_it_is_cobs_inverted_with_its_crc(content):
    packed = bytes(255 - byte for byte in encode(content)[1:])
    data, at = b"", 0
    while at < 31:
        data += packed[at + 1 : at + packed[at]] + b"\0"
        at += packed[at]
    assert at == 31 and data[:28] == content
    assert int.from_bytes(data[28:30], "little") == crc_ccitt(content)


def sample(number, value):
    values = range(value, value + 10)
    return struct.pack("<BBHi10h", 16, 0, number & 0xFFFF, number * 4000, *values)


HEADER = {
    "plumb": 1, "start": 0, "seq": 0, "period_us": 4000, "every": 1, "settings": {"a": 1},
    "channels": [[f"c{i}", "u", 0.5] for i in range(10)],
}  # fmt: skip


def header(fields, number=1):
    text = json.dumps(fields).encode()
    text += b" " * (-len(text) % 24)
    n = len(text) // 24
    return [bytes((1, number, i, n)) + text[24 * i : 24 * i + 24] for i in range(n)]


def read(*contents):
    reader = Reader()
    reader.feed(contents)
    return reader, reader.take()


def test_samples_before_their_header_wait_for_it_and_values_have_units():
    reader, (batch,) = read(sample(0, 100), *header(HEADER), sample(1, 200))
    assert list(batch.number) == [0, 1] and list(batch.t_us) == [0, 4000]
    assert list(batch.value("c0")) == [50.0, 100.0] and reader.lost == 0


def test_a_gap_is_counted_and_numbers_and_times_never_wrap():
    reader, (first,) = read(*header(HEADER), *(sample(n, 5) for n in range(65530, 65534)))
    reader.feed([sample(n, 0) for n in (65535, 65536, 65540)])
    (second,) = reader.take()
    assert list(second.number) == [65535, 65536, 65540] and reader.lost == 1 + 3
    assert list(np.diff(second.t_us)) == [4000, 16000]
    assert first.number[-1] == 65533


def test_one_setting_changes_between_two_samples():
    change = {"start": 0, "seq": 1, "settings": {"b": 2}}
    reader, batches = read(*header(HEADER), sample(0, 0), *header(change, 2), sample(1, 0))
    assert [batch.header["settings"] for batch in batches] == [{"a": 1}, {"a": 1, "b": 2}]
    assert reader.headers == 2


@st.composite
def damaged(draw):
    """A line of text and frames, damaged at one place, and how many frames that can cost."""
    frames = [encode(sample(n, 3 * n)) for n in range(12)]
    text = b">OK text\x04"
    line = b"".join(f + (text if n % 3 == 0 else b"") for n, f in enumerate(frames))
    at = draw(st.integers(0, len(line) - 1))
    kind = draw(st.sampled_from(("cut", "added", "flipped")))
    size = draw(st.integers(1, 20))
    junk = draw(st.binary(min_size=size, max_size=size))
    if kind == "cut":
        return line[:at] + line[at + size :]
    if kind == "added":
        return line[:at] + junk + line[at:]
    middle = bytes(a ^ b for a, b in zip(line[at : at + size], junk))
    return line[:at] + middle + line[at + size :]


@given(damaged(), st.integers(1, 50))
def test_damage_costs_the_frames_it_touches_and_no_wrong_sample_is_taken(line, piece):
    true = {sample(n, 3 * n) for n in range(12)}
    split, got = Splitter(), []
    for at in range(0, len(line), piece):
        got += split.feed(line[at : at + piece])[1]
    assert set(got) <= true
    assert len(got) >= 12 - 3  # 20 bytes touch two frames, and an added mark may take one more
    assert got[-1:] == [sample(11, 33)] or len(got) >= 9


def test_text_goes_through_at_once_and_a_stray_mark_takes_none_of_it():
    split = Splitter()
    text, _ = split.feed(b"raw REPL" + encode(bytes(28))[:10])
    assert text == b"raw REPL"
    text, got = split.feed(encode(bytes(28))[10:] + b">")
    assert text == b">" and got == [bytes(28)]
    words = b"some thirty-one bytes of a text, and more"
    assert split.feed(b"\xff" + words)[0] == words and split.bad == 1

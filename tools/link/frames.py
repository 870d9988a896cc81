# SPDX-License-Identifier: MIT
"""Frames of 32 bytes beside a REPL's text: 0xFF, then 31 bytes without any 0xFF.

The 31 are COBS, each byte inverted, of 28 bytes of content and their CRC-16 (polynomial 0x1021,
start 0xFFFF), over words of 16 bits, low byte first on the line. firmware/stream.py writes them.
Text never holds a 0xFF: it is not in UTF-8, nor in MicroPython's raw REPL.
"""

from binascii import crc_hqx

MARK = b"\xff"
SIZE = 32
CONTENT = 28
_BODY = SIZE - 1
_INVERT = bytes(255 - i for i in range(256))


def encode(content):
    """The frame of 28 bytes."""
    if len(content) != CONTENT:
        raise ValueError(f"content of {len(content)} bytes, not {CONTENT}")
    data = content + _crc(content)
    parts = data.split(b"\0")
    packed = b"".join(bytes([len(part) + 1]) + part for part in parts)
    return MARK + packed.translate(_INVERT)


def decode(body):
    """The 28 bytes in the 31 after a mark; None when they are damaged."""
    packed = body.translate(_INVERT)
    parts, at = [], 0
    while at < len(packed):
        code = packed[at]
        if code == 0 or at + code > len(packed):
            return None
        parts.append(packed[at + 1 : at + code])
        at += code
    data = b"\0".join(parts)
    content = data[:CONTENT]
    return content if len(data) == CONTENT + 2 and data[CONTENT:] == _crc(content) else None


def _crc(content):
    """The CRC takes a word's high byte first."""
    swapped = bytearray(content)
    swapped[::2], swapped[1::2] = content[1::2], content[::2]
    return crc_hqx(swapped, 0xFFFF).to_bytes(2, "little")


class Splitter:
    """Bytes of a line, in pieces of any length, into text and the contents of frames.

    bad: frames that were cut short or damaged; each costs itself, the next mark begins anew.
    """

    def __init__(self):
        self.bad = 0
        self._body = None  # of the frame under way

    def feed(self, data):
        """(text, [content, ...]) of the next bytes."""
        text, contents = bytearray(), []
        at = 0
        while at < len(data):
            if self._body is None:
                mark = data.find(MARK, at)
                end = len(data) if mark < 0 else mark
                text += data[at:end]
                at = end + 1
                if mark >= 0:
                    self._body = bytearray()
                continue
            piece = data[at : at + _BODY - len(self._body)]
            mark = piece.find(MARK)
            if mark >= 0:  # the frame ends too early: here begins another
                self.bad += 1
                self._body = bytearray()
                at += mark + 1
                continue
            self._body += piece
            at += len(piece)
            if len(self._body) == _BODY:
                self._end(text, contents)
        return bytes(text), contents

    def _end(self, text, contents):
        body, self._body = self._body, None
        content = decode(body)
        if content is not None:
            contents.append(content)
            return
        self.bad += 1
        if max(body) < 0x80:  # a stray mark before text: a frame has bytes above that
            text += body

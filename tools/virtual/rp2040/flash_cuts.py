# SPDX-License-Identifier: MIT
"""What a power cut leaves on a flash chip. Runs on CPython and on MicroPython.

A command is (address, bytes programmed, or None: an erase), as FlashChip notes it. A piece is the
part of the flash that one command changes.
"""

BLOCK_SIZE = 4096
ERASED = b"\xff" * BLOCK_SIZE
ERASE_STEP = 512  # bytes from one cut within an erase to the next


def done(before, data):
    """A piece after the whole command: an erase sets every bit, a program only clears bits."""
    if data is None:
        return ERASED
    return bytes([a & b for a, b in zip(before, data)])


def cuts(before, data, noises, step=1):
    """(name, piece) of the ways in which a cut within the command can leave its piece.

    "byte": in order, after each `step` bytes of a program, after each 512 of an erase. "cells": as
    a chip's cells stand after too short a pulse, for each of `noises` (4096 bytes): some bits
    programmed; an erase with some bits done, with some of its first phase (which programs all)
    done, with anything at all. Cuts that differ in nothing from the one before are left out.
    """
    after = done(before, data)
    size = len(before)
    if data is None:
        step = ERASE_STEP
    last = before
    for at in range(step, size, step):
        piece = after[:at] + before[at:]
        if piece not in (last, after):
            last = piece
            yield "byte %d" % at, piece
    cells = []
    if data is None:
        cells = [before[:at] + after[at:] for at in range(step, size, step)]  # from the other end
        cells.append(bytes(size))
    for noise in noises:
        if data is None:
            cells.append(bytes([a | b for a, b in zip(before, noise)]))
            cells.append(bytes([a & b for a, b in zip(before, noise)]))
            cells.append(noise)
        else:
            cells.append(bytes([a & (b | c) for a, b, c in zip(before, data, noise)]))
    for n, piece in enumerate(cells):
        if piece not in (before, after):
            yield "cells %d" % n, piece


class Flash:
    """A chip of `blocks` {number: its 4096 bytes; those that are erased left out}.

    It is a block device for MicroPython's littlefs, with a chip's own rule: a program only clears
    bits. `log` gets the commands, page by page.
    """

    def __init__(self, blocks, count):
        self.blocks = dict(blocks)
        self.count = count
        self.log = []

    def piece(self, address, data):
        """The bytes that the command is going to change."""
        at = address % BLOCK_SIZE
        return self._block(address)[at : at + (BLOCK_SIZE if data is None else len(data))]

    def put(self, address, piece):
        """Set bytes, whatever they were."""
        at = address % BLOCK_SIZE
        block = self._block(address)
        self.blocks[address // BLOCK_SIZE] = block[:at] + piece + block[at + len(piece) :]

    def content(self):
        """All bytes of the chip."""
        return b"".join([self.blocks.get(n, ERASED) for n in range(self.count)])

    def command(self, address, data):
        """Carry out a command; it is not logged."""
        self.put(address, done(self.piece(address, data), data))

    def _block(self, address):
        return self.blocks.get(address // BLOCK_SIZE, ERASED)

    def readblocks(self, n, buffer, at=0):
        buffer[:] = memoryview(self.blocks.get(n, ERASED))[at : at + len(buffer)]

    def writeblocks(self, n, buffer, at=0):
        for page in range(0, len(buffer), 256):
            one = n * BLOCK_SIZE + at + page, bytes(buffer[page : page + 256])
            self.log.append(one)
            self.command(*one)

    def ioctl(self, what, n):
        if what == 6:  # erase a block
            self.log.append((n * BLOCK_SIZE, None))
            self.blocks[n] = ERASED
        return {4: self.count, 5: BLOCK_SIZE}.get(what, 0)

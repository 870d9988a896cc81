# SPDX-License-Identifier: MIT
"""The chip's FIFO, byte by byte."""

from collections import deque


class Fifo:
    """A ring of `size` bytes. Full, it loses its oldest bytes, so packets come out misaligned."""

    def __init__(self, size):
        self.size = size
        self._bytes = deque(maxlen=size)
        self._last = 0

    def __len__(self):
        return len(self._bytes)

    def push(self, data, stop_when_full=False):
        """Append bytes; True when some were lost (the oldest, or the new ones)."""
        room = self.size - len(self._bytes)
        if stop_when_full and len(data) > room:
            return True
        self._bytes.extend(data)
        return len(data) > room

    def pop(self):
        """The oldest byte; an empty FIFO gives its last byte again."""
        if self._bytes:
            self._last = self._bytes.popleft()
        return self._last

    def clear(self):
        """Empty it."""
        self._bytes.clear()

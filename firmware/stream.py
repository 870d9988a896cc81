# SPDX-License-Identifier: MIT
"""Samples as frames of 32 bytes beside the REPL, on the one line that a board has.

    app.stream.start()                  # counts and angles; a program on the PC says this
    app.stream.start(("roll", "rate_x", "late_us"), every=2)
    app.stream.trigger("gyro_z", 2000)  # a slow link: what is around one event, at full rate
    app.stream.keep(3)                  # ends by itself 3 s after the last of these

A frame is 0xFF and 31 bytes without any 0xFF: COBS, inverted, of 28 bytes and their CRC-16. UTF-8
and the raw REPL never send 0xFF, so whatever follows one is a frame and the rest is text. Samples
are put by in the tick (firmware.tick.tap: its layout); header and counts are made here. Always
two frames are written at once, which divides the 256 bytes of the USB buffer: the look before
each write is enough never to wait for a reader that has gone.
"""

import struct
import time

import micropython
from micropython import const

from firmware import channels
from firmware.tick import tap

# places: firmware.tick.tap, firmware.tick.timing, firmware.tick.words
_HEAD = const(0)
_TAIL = const(1)
_LOST = const(3)
_SEQ = const(6)
_LENGTH = const(8)
_MODE = const(9)
_AT = const(17)
_FILL = const(18)
_PART = const(19)
_TICKS_LOST = const(6)
_CAUSE = const(1)

HEADER = const(1)  # kinds of frames beside the samples
COUNTS = const(2)
_PAIRS = const(4)  # written in a row: 256 bytes
_CALL_MS = const(8)  # between two calls of run()
_STATUS_MS = const(500)


@micropython.viper
def frame(out: ptr8, at: int, record: ptr8, first: int):
    """Write the frame of 28 bytes of `record` to out[at:at + 32]."""
    crc = 0xFFFF
    out[at] = 0xFF
    mark = at + 1
    code = 1
    i = 0
    while i < 30:
        if i < 28:
            b = int(record[first + i])
            x = (crc >> 8) ^ b
            x ^= x >> 4
            crc = ((crc << 8) ^ (x << 12) ^ (x << 5) ^ x) & 0xFFFF
        elif i == 28:
            b = crc >> 8
        else:
            b = crc & 0xFF
        if b:
            out[at + 2 + i] = b ^ 0xFF
            code += 1
        else:
            out[mark] = code ^ 0xFF
            mark = at + 2 + i
            code = 1
        i += 1
    out[mark] = code ^ 0xFF


@micropython.viper
def fill(control: ptr32, pair, ring, mask: int) -> int:
    """Frames of what is in the ring until the pair is full; 1 when it is."""
    while control[_FILL] < 2:
        tail = control[_TAIL]
        mode = control[_MODE]
        if tail == control[_HEAD] or mode == 1 or mode == 2:
            return 0
        part = control[_PART]
        frame(pair, control[_FILL] << 5, ring, (tail & mask) * control[_LENGTH] + part)
        control[_FILL] += 1
        part += 28
        if part == control[_LENGTH]:
            part = 0
            control[_TAIL] = (tail + 1) & 0x3FFFFFFF
        control[_PART] = part
    return 1


class Stream:
    """The stream of one App.

    on: whether it runs; written: pairs of frames so far; waits: how often nobody took one.
    """

    def __init__(self, app):
        self._app = app
        self._pair = bytearray(64)
        self._record = bytearray(28)
        self._header = b""
        self._number = self._next = self._chunks = 0
        self._control = self._ring = None
        self._until = self._told = self._starts = 0
        self._row = {}
        self._offered = {}
        self.on = False
        self.calls = 1
        self.written = self.waits = 0

    def offer(self, name, unit, scale, read):
        """A channel of a controller's: read() gives a small integer that times `scale` is the
        value in `unit`; fit for the tick (firmware.outputs)."""
        self._offered[name] = channels.Channel(name, unit, scale, None, 0, 0, read)

    def names(self):
        """Of all channels."""
        return channels.NAMES + tuple(self._offered)

    def start(self, names=channels.DEFAULT, every=1, keep_s=3, seconds=0.25):
        """Send these channels of each `every`-th tick, until keep() is not called for keep_s.

        seconds: of samples that the board holds while nobody reads. ValueError names what is not
        known; MemoryError where they are too many.
        """
        rate_hz = 1000000 / self._app.loop.period_us / every
        self._begin(names, every, max(16, int(rate_hz * seconds)))
        self._row = {}
        self._go(keep_s)

    def trigger(self, name, level, rising=True, before=100, after=400, names=None, keep_s=3):
        """Send only what is around an event: `before` and `after` samples of each tick, when the
        channel `name` crosses `level` (in its unit); then wait for the next.
        """
        names = tuple(names or channels.DEFAULT)
        names = names if name in names else names + (name,)
        self._begin(names, 1, before + after + 1)
        watch = names.index(name)
        level = round(level / self._chosen[watch].scale)
        for place, value in ((10, watch), (11, level), (12, int(rising)), (13, before),
                             (14, after), (16, level), (_MODE, 1)):  # fmt: skip
            self._control[place] = value
        self._row = {"trigger": name, "before": before, "after": after}
        self._go(keep_s)

    def _begin(self, names, every, samples):
        self.stop()
        app = self._app
        chosen = [self._offered.get(name) or channels.find(name, app) for name in names]
        reads = tuple([channel.read for channel in chosen if channel.read])
        self._starts += 1
        parts = 1 if len(chosen) <= 10 else 2 + (len(chosen) - 11) // 12
        size = 16
        while size < samples:
            size *= 2
        control = tap.words()
        for place, value in ((2, size), (4, every), (5, every), (7, len(chosen)),
                             (_LENGTH, 28 * parts), (10, -1), (21, 16 + 4 * (self._starts & 3))):  # fmt: skip
            control[place] = value
        self._control, self._ring = control, bytearray(size * 28 * parts)
        self._mask = size - 1
        self._chosen = chosen
        sources = (app.tick.est, app.tick.memory, app.tick.timing.words, channels.more(reads))
        ring = (control, self._ring, channels.program(chosen))
        self._tap = lambda drive: tap.over(drive, ring, sources, reads)
        self._every = every

    def _go(self, keep_s):
        self.calls = max(1, _CALL_MS * 1000 // self._app.loop.period_us)
        self.keep(keep_s)
        self._told = time.ticks_ms()
        self.changed()
        self.on = True
        self._app.outputs.tap = self._tap
        self._app.outputs.hand_over()

    def keep(self, seconds=3):
        """Go on for so long."""
        self._until = time.ticks_add(time.ticks_ms(), int(1000 * seconds))

    def stop(self):
        """No more frames."""
        if self.on:
            self.on = False
            self._app.outputs.tap = None
            self._app.outputs.hand_over()

    def changed(self):
        """A setting has changed: the header is sent anew."""
        if self._control is None:
            return
        self.calls = max(1, _CALL_MS * 1000 // self._app.loop.period_us)
        self._number = (self._number + 1) & 0xFF
        head = channels.header(self._app, self._chosen, self._every, self._control[_SEQ])
        head["start"] = self._starts  # samples of kind 16 + 4 (start & 3) + part are of it
        head.update(self._row)
        self._header = channels.text(head)
        self._chunks = (len(self._header) + 23) // 24
        self._next = 0

    # ---- after ticks; allocates nothing but for what changed() makes

    def run(self):
        """What the ring holds, as far as somebody takes it."""
        control, pair, ready = self._control, self._pair, self._app.telemetry.console
        now = time.ticks_ms()
        if time.ticks_diff(now, self._until) > 0:
            self.stop()
            return
        n = 0
        while n < _PAIRS:
            n += 1
            if control[_FILL] < 2:
                self._other(control, pair, now)
                if not fill(control, pair, self._ring, self._mask):
                    if control[_MODE] == 3 and control[_TAIL] == control[_HEAD]:
                        self._again(control)
                    return
            if not ready.ready():
                self.waits += 1
                return
            ready.write(pair)
            control[_FILL] = 0
            self.written += 1

    def _other(self, control, pair, now):
        """A frame of the header, or of the counts, when one is due."""
        record = self._record
        if self._next < self._chunks:
            chunk = self._next
            record[0] = HEADER
            record[1] = self._number
            record[2] = chunk
            record[3] = self._chunks
            put(record, self._header, 24 * chunk, len(self._header))
            self._next = chunk + 1
        elif time.ticks_diff(now, self._told) >= 0:
            self._told = time.ticks_add(now, _STATUS_MS)
            self._counts(control, record)
        else:
            return
        frame(pair, control[_FILL] << 5, record, 0)
        control[_FILL] += 1

    def _counts(self, control, record):
        seq = control[_SEQ]
        record[0] = COUNTS
        record[1] = control[_MODE]
        record[2] = seq & 0xFF
        record[3] = seq >> 8
        app = self._app
        backlog = control[_HEAD] - control[_TAIL] & 0x3FFFFFFF
        struct.pack_into(
            "<iiiiii", record, 4, control[_LOST], self.waits, app.tick.timing.words[_TICKS_LOST],
            app.tick.words[_CAUSE], backlog, control[_AT],
        )  # fmt: skip

    def _again(self, control):
        """What was around the event is sent: wait for the next."""
        self._told = time.ticks_ms()
        control[_HEAD] = control[_TAIL] = 0
        control[16] = control[11]
        control[_MODE] = 1


@micropython.viper
def put(record: ptr8, text: ptr8, at: int, size: int):
    """24 bytes of a text from `at` on, blanks after its end, into a record."""
    i = 0
    while i < 24:
        record[4 + i] = text[at + i] if at + i < size else 32
        i += 1

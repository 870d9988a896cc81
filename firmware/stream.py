# SPDX-License-Identifier: MIT
"""Samples as frames of 32 bytes beside the REPL, on the one line that a board has.

    app.stream.start()                  # counts and angles; a program on the PC says this
    app.stream.start(("roll", "rate_x", "late_us"), every=2)
    app.stream.trigger("gyro_z", 2000)  # a slow link: what is around one event, at full rate
    app.stream.keep(3)                  # ends by itself 3 s after the last of these

A frame is 0xFF and 31 bytes without any 0xFF: COBS, inverted, of 28 bytes and their CRC-16. UTF-8
and the raw REPL never send 0xFF, so whatever follows one is a frame and the rest is text. Samples
are put by in the tick (firmware.tick.tap: its layout); header and counts are made here. Always
four frames are written at once, which divides the 256 bytes of the USB buffer: the look before
each write is enough never to wait for a reader that has gone. Counts fill up the four once a
second, so that nothing waits longer in a slow stream.
"""

import gc
import time
from array import array

import micropython
from micropython import const, stack_use

from firmware import channels, ctrl_c
from firmware.tick import tap

# places: firmware.tick.tap, firmware.tick.timing, firmware.tick.words
_HEAD = const(0)
_TAIL = const(1)
_SIZE = const(2)
_LOST = const(3)
_EVERY = const(4)
_LEFT = const(5)
_SEQ = const(6)
_CHANNELS = const(7)
_LENGTH = const(8)
_MODE = const(9)
_WATCH = const(10)
_LEVEL = const(11)
_RISING = const(12)
_BEFORE = const(13)
_AFTER = const(14)
_LAST = const(16)
_AT = const(17)
_PART = const(19)
_KIND = const(21)
_BATCH = const(22)
_WAIT = const(23)
_ASKED = const(24)
_RECORDS = const(26)
_TICKS_LOST = const(6)
_CAUSE = const(1)

HEADER = const(1)  # kinds of frames beside the samples
COUNTS = const(2)
_FRAMES = const(4)  # written at once
_FILL = const(64)  # place in them, after their 128 bytes, of 16 bits: how many are made
_FILLED = const(128)  # the same in bytes
_WRITES = const(2)  # in a row: 256 bytes
_CALL_MS = const(40)  # at most between two calls
_STATUS_MS = const(1000)
# a program that is deeper in calls than so many bytes is let go on first, since a hard tick wants
# 2560 of the same 8 KB (firmware.stack): samples till the ring is half full, and a frame beside
# them, which takes more calls, for so many times
_DEEP = const(4200)
_DEEP_BESIDE = const(3300)
_PUT_OFF = const(200)
_TODO = const(8)  # changes that wait
_LEAST = const(16)  # records in a ring
_ROOM = const(4096)  # bytes in one piece that are left beside it, for a filter's code

# places of a Stream's own words
_UNTIL = const(0)  # ticks_ms of the end
_TOLD = const(1)  # of the next frame of counts
_BESIDE = const(2)  # frames of headers that wait, and changes
_WRITTEN = const(3)
_WAITS = const(4)
_WAITED = const(5)


@micropython.viper
def fill(x: int, crc: int, i: int, ring, frames) -> int:
    """Frames of the records in the ring until there are four; 1 when so. x, crc, i: 0.

    A function's first three names live in registers, so these are arguments; and a call costs a
    third of a frame, so frames are made here. The CRC takes a word's high byte first: 16 bits at
    once, a multiplication by x^16.
    """
    control = ptr32(ring)
    words = ptr16(ring)
    out = ptr16(frames)
    line = ptr8(frames)
    while out[_FILL] < _FRAMES:
        tail = control[_TAIL]
        mode = control[_MODE]
        if tail == control[_HEAD] or mode == 1 or mode == 2:
            return 0
        part = control[_PART]
        i = int(out[_FILL]) << 4
        at = (tail & (control[_SIZE] - 1)) * control[_LENGTH] + part + 4 * _RECORDS >> 1
        at -= i + 1
        end = i + 14
        mark = (i << 1) + 1
        crc = 0xFFFF
        while i < end:
            i += 1
            x = int(words[at + i])
            out[i + 0] = x ^ 0xFFFF
            if x & 255 == 0:  # a byte that is zero becomes the way to the next such one
                line[mark + 0] = 255 + mark - (i << 1)
                mark = i << 1
            if x < 256:
                line[mark + 0] = 254 + mark - (i << 1)
                mark = (i << 1) + 1
            x ^= crc
            x ^= x >> 4 ^ x >> 8 ^ x >> 11 ^ x >> 12
            crc = (x ^ x << 5 ^ x << 12) & 0xFFFF
        i += 1  # and the CRC, out here: an exit inside the loop costs time in each round
        out[i + 0] = crc ^ 0xFFFF
        if crc & 255 == 0:
            line[mark + 0] = 255 + mark - (i << 1)
            mark = i << 1
        if crc < 256:
            line[mark + 0] = 254 + mark - (i << 1)
            mark = (i << 1) + 1
        i = (i << 1) + 2
        line[mark + 0] = 255 + mark - i
        line[i - 32] = 0xFF
        out[_FILL] += 1
        part += 28
        if part == control[_LENGTH]:
            part = 0
            control[_TAIL] = (tail + 1) & 0x3FFFFFFF
        control[_PART] = part
    return 1


@micropython.viper
def due(own: ptr32, frames: ptr16, now: int) -> int:
    """What there is to do first at ticks_ms `now`: 1 the end, 2 a frame that is no sample; 0."""
    if (now - own[_UNTIL] + 0x20000000) & 0x3FFFFFFF > 0x20000000:
        return 1
    if frames[_FILL] < _FRAMES:
        if own[_BESIDE] or (now - own[_TOLD] + 0x20000000) & 0x3FFFFFFF >= 0x20000000:
            return 2
    return 0


class Stream:
    """The stream of one App.

    on: whether it runs; error: what ended it, or None.
    """

    def __init__(self, app):
        self._app = app
        self._frames = bytearray(130)
        self._line = memoryview(self._frames)[:128]
        self._own = tap.ring(1, 28)  # of a header's or the counts' frame
        self._header = channels.Text()
        self._todo = []  # changes that wait until the header before them is sent
        self._number = self._next = self._chunks = 0
        self._ring = self._tap = None
        self._words = _words()
        self._words[_UNTIL] = self._words[_TOLD] = time.ticks_ms()
        self._starts = 0
        self._row = {}
        self._offered = {}
        self.on = False
        self.error = None

    @property
    def written(self):
        """Frames so far."""
        return _FRAMES * self._words[_WRITTEN]

    @property
    def waits(self):
        """How often nobody took them."""
        return self._words[_WAITS]

    def offer(self, name, unit, scale, read):
        """A channel of a controller's: read() gives a small integer that times `scale` is the
        value in `unit`; fit for the tick (firmware.outputs)."""
        self._offered[name] = channels.Channel(name, unit, scale, None, 0, 0, read)

    def names(self):
        """Of all channels."""
        return channels.NAMES + tuple(self._offered)

    def start(self, names=(), every=1, keep_s=3, seconds=0.25):
        """Send each `every`-th tick's burst and angles, and the channels `names`, until keep() is
        not called for keep_s. ValueError where nothing runs, or a name is not known.

        seconds: of samples that the board holds while nobody reads, or as much of it as there is
        memory for. ValueError names what is not known.
        """
        if self._app.loop is None:
            raise ValueError("the loop does not run: app.start()")
        rate_hz = 1000000 / self._app.loop.period_us / every
        self._begin(names, every, max(16, int(rate_hz * seconds)))
        self._row = {}
        self._go(keep_s)

    def trigger(self, name, level, rising=True, before=100, after=400, names=(), keep_s=3):
        """Send only what is around an event: `before` and `after` samples of each tick, when the
        channel `name` crosses `level` (in its unit); then wait for the next.
        """
        if name not in channels.ALWAYS and name not in names:
            names = tuple(names) + (name,)
        self._begin(names, 1, before + after + 1)
        watch = [channel.name for channel in self._chosen].index(name)
        level = round(level / self._chosen[watch].scale)
        place = 4 + watch if watch < 10 else 14 * (1 + (watch - 10) // 12) + 2 + (watch - 10) % 12
        ring = self._ring
        ring[_WATCH], ring[_LEVEL], ring[_RISING] = place, level, int(rising)
        ring[_BEFORE], ring[_AFTER], ring[_LAST], ring[_MODE] = before, after, level, 1
        self._row = {"trigger": name, "before": before, "after": after}
        self._go(keep_s)

    def _begin(self, names, every, samples):
        self.stop()
        app = self._app
        beside = []
        for name in names:
            if name not in channels.ALWAYS:
                beside.append(self._offered.get(name) or channels.find(name, app))
        if len(beside) > 36:
            raise ValueError("more than 36 channels beside %s" % (channels.ALWAYS,))
        reads = tuple([channel.read for channel in beside if channel.read])
        self._starts += 1
        parts = 1 + (len(beside) + 11) // 12
        if self._ring and self._ring[_LENGTH] != 28 * parts:
            self._ring = self._tap = self._run = None  # its room is wanted
        self._ring = ring = _ring(samples, 28 * parts, self._ring)
        kind = 16 + 4 * (self._starts & 3)
        ring[_EVERY], ring[_LEFT], ring[_CHANNELS], ring[_KIND] = every, every, len(beside), kind
        self._chosen = [channels.find(name, app) for name in channels.ALWAYS] + beside
        more, program = channels.more(reads), channels.program(beside)
        tick = app.tick
        self._tap = lambda drive: tap.over(
            drive, self._run, ring, tick.est, tick.memory, tick.timing.words, program, reads, more
        )  # fmt: skip
        self._every = every

    def _go(self, keep_s):
        self.keep(keep_s)
        self._words[_TOLD] = time.ticks_ms()
        self._run = self._make_run()
        self._tell(None)
        self.on = True
        self._app.outputs.tap = self._tap
        self._app.outputs.hand_over()

    def keep(self, seconds=3):
        """Go on for so long."""
        self._words[_UNTIL] = time.ticks_add(time.ticks_ms(), int(1000 * seconds))

    def stop(self):
        """No more frames."""
        if self.on:
            self.on = False
            self._app.outputs.tap = None
            self._app.outputs.hand_over()
            self._header.forget()

    def changed(self, name=None):
        """A setting has changed, one that changes nothing else, or all may have: it is told."""
        if self.on:
            try:
                self._tell(name)
            except MemoryError as error:
                self.error = error
                self.stop()

    def _tell(self, name):
        app = self._app
        parts = self._ring[_LENGTH] // 28
        samples = _CALL_MS * 1000 // (app.loop.period_us * self._every)
        self._ring[_BATCH] = max(1, min(samples, _FRAMES * _WRITES // parts))
        if name is None:
            head = channels.header(app, self._chosen, self._every)
            head.update(self._row)
            self._todo = []
        else:
            head = channels.change(app, name)
        head["start"] = self._starts  # samples of kind 16 + 4 (start & 3) + part are of it
        head["seq"] = self._ring[_SEQ]  # and from this one on it holds
        if name is None or not (self._todo or self._next < self._chunks):
            self._put(head)
        elif len(self._todo) < _TODO:
            self._todo.append(head)
        else:  # they come faster than they are sent: the last one tells the rest
            self._todo[-1]["settings"].update(head["settings"])
            self._todo[-1]["crc"] = head["crc"]
        self._count()

    def _put(self, head):
        """It is sent from now on."""
        self._number = (self._number + 1) & 0xFF
        self._next = self._chunks = 0  # none while it is written
        self._header.make(head)
        self._chunks = (self._header.size + 23) // 24

    def _count(self):
        """What is to be sent beside samples."""
        self._words[_BESIDE] = self._chunks - self._next + len(self._todo)

    # ---- after ticks; allocates nothing but for what changed() makes

    def _make_run(self):
        """What is scheduled after ticks: what the ring holds, as far as somebody takes it."""
        console = self._app.telemetry.console

        @micropython.native
        def run(
            _,
            stream=self,
            own=self._words,
            ring=self._ring,
            frames=self._frames,
            line=self._line,
            ready=console.ready,
            write=console.write,
            due=due,
            fill=fill,
            ticks_ms=time.ticks_ms,
            stack_use=stack_use,
        ):
            ring[_ASKED] = 0
            try:
                used = stack_use()
                if used > _DEEP and not ring[_MODE]:
                    if (ring[_HEAD] - ring[_TAIL] & 0x3FFFFFFF) < ring[_SIZE] >> 1:
                        ring[_WAIT] = 0
                        return
                if used <= _DEEP_BESIDE:
                    own[_WAITED] = 0
                what = due(own, frames, ticks_ms())
                if what == 1:
                    return stream.stop()
                if what and used > _DEEP_BESIDE and own[_WAITED] < _PUT_OFF:
                    own[_WAITED] += 1
                elif what:
                    stream._other(ticks_ms())
                    if own[_BESIDE]:  # a header of seventy frames is not for seventy batches
                        ring[_WAIT] = 0
                n = _WRITES
                while n:
                    n -= 1
                    if frames[_FILLED] < _FRAMES and not fill(0, 0, 0, ring, frames):
                        if ring[_MODE] == 3 and ring[_TAIL] == ring[_HEAD]:
                            stream._again()
                        return
                    if not ready():
                        own[_WAITS] += 1
                        return
                    write(line)
                    frames[_FILLED] = 0
                    own[_WRITTEN] += 1
                if ring[_HEAD] - ring[_TAIL] & 0x3FFFFFFE:  # there is more: not a batch later
                    ring[_WAIT] = 0
            except BaseException as error:
                return stream._raised(error)

        return run

    def _raised(self, error):
        """By the console, or by an app that is being set up anew; or it was a Ctrl-C."""
        if isinstance(error, KeyboardInterrupt):
            return ctrl_c.press()
        self.error = error
        self.stop()

    @micropython.native
    def _other(self, now):
        """A frame of the header, or those of the counts."""
        own = self._own
        if time.ticks_diff(now, self._words[_TOLD]) >= 0:  # first: headers may follow each other
            self._words[_TOLD] = time.ticks_add(now, _STATUS_MS)
            self._counts(own)
            while self._frames[_FILLED] < _FRAMES - 1:  # the same until the four are full
                own[_HEAD] = 1
                own[_TAIL] = 0
                fill(0, 0, 0, own, self._frames)
        elif self._next == self._chunks and not self._todo:  # one is written just now
            self._words[_BESIDE] = 0
            return
        else:
            if self._next == self._chunks:
                self._put(self._todo[0])
                self._todo.pop(0)
            chunk = self._next
            put(own, HEADER, self._number, chunk, self._chunks, self._header.data,
                self._header.size)  # fmt: skip
            self._next = chunk + 1
            self._count()
        own[_HEAD] = 1
        own[_TAIL] = 0
        fill(0, 0, 0, own, self._frames)

    @micropython.native
    def _counts(self, own):
        ring, seq, tick = self._ring, self._ring[_SEQ], self._app.tick
        put(own, COUNTS, ring[_MODE], seq & 0xFF, seq >> 8, b"", 0)
        own[_RECORDS + 1] = ring[_LOST]
        own[_RECORDS + 2] = self._words[_WAITS]
        own[_RECORDS + 3] = tick.timing.words[_TICKS_LOST]
        own[_RECORDS + 4] = tick.words[_CAUSE]
        own[_RECORDS + 5] = ring[_HEAD] - ring[_TAIL] & 0x3FFFFFFF
        own[_RECORDS + 6] = ring[_AT]

    def _again(self):
        """What was around the event is sent: wait for the next."""
        ring = self._ring
        self._words[_TOLD] = time.ticks_ms()
        ring[_HEAD] = ring[_TAIL] = 0
        ring[_LAST] = ring[_LEVEL]
        ring[_MODE] = 1


@micropython.viper
def put(own, kind: int, a: int, b: int, c: int, text: ptr8, size: int):
    """A record of these four bytes and 24 of a text, the b-th ones, blanks after its end."""
    record = ptr8(own)
    record[4 * _RECORDS] = kind
    record[4 * _RECORDS + 1] = a
    record[4 * _RECORDS + 2] = b
    record[4 * _RECORDS + 3] = c
    at = 24 * b
    i = 0
    while i < 24:
        byte = 32
        if at + i < size:
            byte = int(text[at + i])
        record[4 * _RECORDS + 4 + i] = byte
        i += 1


def _words():
    """Of a Stream, all 0."""
    return array("i", [0] * 6)


def _ring(samples, length, old):
    """For so many records, a power of two, or fewer where the heap is in pieces: `old` then, if it
    has as much. A piece of _ROOM bytes is left beside a new one."""
    size = _LEAST
    while size < samples:
        size *= 2
    gc.collect()
    while not old or old[_SIZE] < size:
        try:
            room = bytearray(_ROOM if size > _LEAST else 0)  # noqa: F841 - free again afterwards
            return tap.ring(size, length)
        except MemoryError:
            if size == _LEAST:
                raise
            size //= 2
    return tap.clear(old, old[_SIZE], length)

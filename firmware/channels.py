# SPDX-License-Identifier: MIT
"""What can be streamed: names, units, scales, and where in the tick's arrays each stands."""

import binascii
import gc
import json
import sys
from array import array
from collections import namedtuple

from firmware import filters

# source, place, shift: firmware.tick.tap, but for those that are ALWAYS there; the value is the
# 16-bit number times scale, in unit. read: of a controller's channel, instead.
Channel = namedtuple("Channel", ("name", "unit", "scale", "source", "place", "shift", "read"))

VERSION = 1
_NONE = bytearray()  # made once: a stream may end where nothing can be allocated
ALWAYS = (
    "accel_x", "accel_y", "accel_z", "temp", "gyro_x", "gyro_y", "gyro_z", "roll", "pitch", "yaw",
)  # fmt: skip
NAMES = ALWAYS + (
    "rate_x", "rate_y", "rate_z", "force_x", "force_y", "force_z", "late_us", "step_us", "age_ms",
)  # fmt: skip
_RATE_SHIFT = {250: 3, 500: 4, 1000: 5, 2000: 6}  # so that the range fits in 16 bits
_EST, _TIMING, _MORE, _LATE = range(4)


def find(name, app):
    """The Channel of this name, for the app's ranges. ValueError names those there are."""
    imu = app.imu
    kind, _, axis = name.rpartition("_")
    at = "xyz".find(axis) if kind in ("accel", "gyro", "rate", "force") else -1
    if kind == "accel" and at >= 0:
        return Channel(name, "g", 1 / imu.accel_lsb_per_g, None, at, 0, None)
    if kind == "gyro" and at >= 0:
        return Channel(name, "deg/s", 1 / imu.gyro_lsb_per_dps, None, 4 + at, 0, None)
    if kind == "rate" and at >= 0:
        shift = _RATE_SHIFT[imu.gyro_range_dps]
        return Channel(name, "deg/s", (1 << shift) / 1000, _EST, 5 + at, shift, None)
    if kind == "force" and at >= 0:
        return Channel(name, "g", 1 / imu.accel_lsb_per_g, _EST, 8 + at, 0, None)
    if name in ("roll", "pitch", "yaw"):
        return Channel(name, "deg", 0.008, None, 0, 0, None)
    if name == "temp":  # and the header's temp_c_at_0
        return Channel(name, "degC", 1 / imu.profile.temp_lsb_per_c, None, 3, 0, None)
    if name == "late_us":
        return Channel(name, "us", 1, _LATE, 0, 0, None)
    if name == "step_us":  # of the tick before
        return Channel(name, "us", 1, _TIMING, 9, 0, None)
    if name == "age_ms":
        return Channel(name, "ms", 1.024, _EST, 14, 10, None)
    raise ValueError("no channel %s; there are %s" % (name, ", ".join(app.stream.names())))


def more(reads):
    """Room for what `reads` give."""
    return array("i", [0] * max(1, len(reads)))


def program(chosen):
    """Source, place and shift of each, for firmware.tick.tap."""
    made, read = bytearray(), 0
    for channel in chosen:
        if channel.read:
            made.extend(bytes((_MORE, read, 0)))
            read += 1
        else:
            made.extend(bytes((channel.source, channel.place, channel.shift)))
    return made


def header(app, chosen, every):
    """What a reader has to know, as a dict."""
    imu, config = app.imu, app.config
    calibration = {}
    for name, value in app.calibration.to_dict().items():
        if value not in (None, ""):
            calibration[name] = value
    return {
        "plumb": VERSION,
        "period_us": app.loop.period_us,
        "every": every,
        "channels": [(channel.name, channel.unit, channel.scale) for channel in chosen],
        "tick": app.tick_kind,
        "board": app.board.name,
        "micropython": ".".join([str(part) for part in sys.implementation.version[:3]]),
        "sensor": imu.profile.name,
        "lag_s": filters.lag_s(config, imu),
        "temp_c_at_0": getattr(imu.profile, "temp_offset_c", 0),
        "settings": config.values(),
        "crc": _crc(config),
        "calibration": calibration,
    }


def change(app, name):
    """What one knob changes of it, when that is nothing but its value."""
    return {"settings": {name: getattr(app.config, name)}, "crc": _crc(app.config)}


def _crc(config):
    """Of all settings, in any order."""
    crc = 0
    for item in config.values().items():
        crc ^= binascii.crc32(("%s=%r" % item).encode())
    return "%08x" % crc


class Text:
    """A header as bytes of JSON: `data`, of which `size` count. It is written piece by piece into
    what is there, as the heap of a board that runs may have no such room in one piece; and not by
    json.dump(), in which scheduled calls would run, deep down in the stack that a tick needs.
    """

    def __init__(self):
        self.forget()

    def forget(self):
        """Its room is free."""
        self.data = _NONE
        self.size = 0

    def make(self, head):
        """Of this dict; with room for the longer numbers of later ones. MemoryError."""
        self.size = 0
        self._write(head)
        if self.size > len(self.data):
            gc.collect()  # else it lies behind what the writing has left
            self.data = bytearray(self.size + self.size // 4)
            self.make(head)

    def _write(self, head):
        self._add("{")
        mark = ""
        for key in head:
            self._add('%s"%s": ' % (mark, key))
            if isinstance(head[key], dict):
                self._write(head[key])
            else:
                self._add(json.dumps(head[key]))
            mark = ", "
        self._add("}")

    def _add(self, text):
        piece = text.encode()
        at, self.size = self.size, self.size + len(piece)
        if self.size <= len(self.data):
            self.data[at : self.size] = piece

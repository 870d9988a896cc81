# SPDX-License-Identifier: MIT
"""A board on which the programs of docs/examples run until somebody presses Ctrl-C, and what they
talk to: a display's memory, small stand-ins for Wi-Fi, a browser and a broker."""

import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from tools.virtual import Bus, MPU6050Chip, Port

EXAMPLES = Path(__file__).resolve().parents[2] / "docs" / "examples"
# SDA, SCL, INT of the README's table
WIRES = {"rp2": (4, 5, 6), "esp32": (21, 22, 19)}


class Bench:
    """A board with its sensor, and a program of docs/examples that runs on it."""

    def __init__(self, root, motion, platform="rp2", others=(), version=(1, 27, 0), **settings):
        self.chip = MPU6050Chip(motion, seed=3, gyro_bias_dps=(1.0, -2.0, 0.5))
        self.bus = Bus(self.chip, *others)
        sda, scl, self.int_pin = WIRES[platform]
        self.port = Port(
            platform, {0: self.bus}, wiring={0: (sda, scl)}, version=version, root=root, **settings
        )
        self.names = {}

    def __enter__(self):
        self.port.__enter__()
        return self

    def __exit__(self, kind, *error):
        from firmware.app import App

        if kind is None:
            for app in list(App._running):
                assert app.foreground.error is None and app.outputs.error is None
                app.stop()
            assert self.port.errors == []
        return self.port.__exit__(kind, *error)

    def run(self, name, seconds=None):
        """Run it to its end, or until Ctrl-C that many seconds from now, as a board sees it: in
        the main program, between two bytecodes."""
        if seconds is None:
            self.port.run_file(EXAMPLES / name, self.names)
            return
        clock, end_ns = self.port.clock, self.port.now_ns + int(seconds * 1e9)
        breathe = clock.breathe

        def pressed():
            breathe()
            if clock.now_ns >= end_ns and clock.in_foreground and not clock.scheduler.running:
                raise KeyboardInterrupt

        clock.breathe = pressed
        try:
            with pytest.raises(KeyboardInterrupt):
                self.port.run_file(EXAMPLES / name, self.names)
        finally:
            del clock.breathe


class Oled:
    """What an SSD1306 does with its bus: control byte, commands, a memory of 8 pages."""

    address = 0x3C
    ARGUMENTS = {0x20: 1, 0x21: 2, 0x22: 2, 0x81: 1, 0x8D: 1, 0xA8: 1, 0xD3: 1, 0xDA: 1}

    def __init__(self):
        self.memory, self.at, self.frames = bytearray(1024), 0, 0
        self.told, self.sent = {}, bytearray()

    def start(self, read):
        self.sent.clear()
        return not read

    def write(self, value):
        self.sent.append(value)
        return True

    def stop(self):
        control, body = self.sent[:1], bytes(self.sent[1:])
        if control == b"\x40":
            for value in body:
                self.memory[self.at] = value
                self.at = (self.at + 1) % 1024
            self.frames += len(body) == 1024
        while control == b"\x00" and body:
            code, count = body[0], self.ARGUMENTS.get(body[0], 0)
            self.told[code], body = body[1 : 1 + count], body[1 + count :]
            if code == 0x22:  # the window of pages: the pointer goes to its beginning
                self.at = 0
        self.sent.clear()

    def advance(self, now_ns):
        """Nothing happens by itself."""

    def next_event_ns(self):
        return None


class Wlan:
    """`network.WLAN` that is connected at its fourth look."""

    def __init__(self, interface):
        self.interface, self.on, self.told, self.looks = interface, False, None, 0

    def active(self, on):
        self.on = on

    def connect(self, name, key):
        assert self.on
        self.told = name, key

    def isconnected(self):
        self.looks += self.told is not None
        return self.looks > 3

    def ifconfig(self):
        return "192.168.1.7", "255.255.255.0", "192.168.1.1", "192.168.1.1"


NETWORK = SimpleNamespace(WLAN=Wlan, STA_IF=0)


class Visit:
    """Reader and writer of one request."""

    def __init__(self):
        self.lines = [b"GET / HTTP/1.1\r\n", b"Host: 192.168.1.7\r\n", b"\r\n"]
        self.answer, self.sent, self.closed = b"", b"", False

    async def readline(self):
        return self.lines.pop(0)

    def write(self, data):
        self.answer += data

    async def drain(self):
        self.sent = self.answer

    def close(self):
        self.closed = True

    async def wait_closed(self):
        assert self.closed


class Client:
    """`umqtt.simple.MQTTClient` of a broker that is away at first, and once more."""

    got, connects = [], 0

    def __init__(self, name, server):
        assert (name, server) == (b"plumb", "192.168.1.2")
        self.up = False

    def connect(self):
        Client.connects += 1
        if Client.connects == 1:
            raise OSError(113, "EHOSTUNREACH")
        self.up = True

    def publish(self, topic, message):
        assert self.up
        if len(Client.got) == 3:
            self.up = False
            Client.got.append(None)
            raise OSError(104, "ECONNRESET")
        Client.got.append((topic, json.loads(message)))

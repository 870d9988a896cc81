# SPDX-License-Identifier: MIT
"""A pseudo-terminal in front of the emulated board's console, for mpremote, screen or Thonny."""

import os
import select
import signal
import subprocess
import sys
import time
import tty

from tools.virtual.rp2040.console import CTRL_C, CTRL_D


class Terminal:
    """Bytes between a pty and a Console. `run(until, seconds)` lets emulated time pass."""

    def __init__(self, console, run):
        self._console = console
        self._run = run
        self._to_client = bytearray()
        self._previous = None
        self._master = self._slave = None
        self.path = None

    def __enter__(self):
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        self._previous = self._console.on_serial_data, self._console.on_device_connected
        self._console.on_serial_data = self._to_client.extend
        self._console.on_device_connected = lambda: None  # a host that opens a port types nothing
        return self

    def __exit__(self, *exc_info):
        self._console.on_serial_data, self._console.on_device_connected = self._previous
        os.close(self._master)
        os.close(self._slave)

    def serve_ms(self, ms):
        """Let the board run for `ms` of emulated time, passing bytes both ways each millisecond.

        When nothing moves, a little real time passes too, so that a sleeping board does not run
        hours ahead of the program that talks to it.
        """
        for _ in range(ms):
            moved = self._from_client()
            self._run(None, 0.001)
            moved |= self._flush()
            if not moved and self._console.idle:
                select.select([self._master], [], [], 0.0005)

    def mpremote(self, arguments, timeout_s):
        """Run the real mpremote on this terminal: its exit code and what it printed (bytes)."""
        command = [sys.executable, "-m", "mpremote", "connect", self.path, *arguments]
        return self.program(command, timeout_s)

    def program(self, command, timeout_s, person=None):
        """Run a program beside the board: its exit code and what it printed (bytes).

        After `timeout_s` of real time it is killed. `person(text)` sees what was printed since it
        last typed, and returns what it types now: bytes, CTRL_C, CTRL_D (no more input) or None.
        """
        process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE if person else subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            bufsize=0,
            # a background job ignores Ctrl-C, and so would what it starts
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        )
        os.set_blocking(process.stdout.fileno(), False)
        printed, seen = b"", 0
        end = time.monotonic() + timeout_s
        try:
            while process.poll() is None and time.monotonic() < end:
                self.serve_ms(10)
                printed += process.stdout.read() or b""
                typed = person(printed[seen:]) if person else None
                if typed:
                    seen = len(printed)
                    _type(process, typed)
        finally:
            process.kill()
            process.wait()
        printed += process.stdout.read() or b""
        process.stdout.close()
        if person:
            process.stdin.close()
        return process.returncode, printed

    def _from_client(self):
        try:
            data = os.read(self._master, 4096)
        except BlockingIOError:
            return False
        self._console.send(data)
        return True

    def _flush(self):
        if not self._to_client:
            return False
        try:
            written = os.write(self._master, self._to_client)
        except BlockingIOError:
            return False
        del self._to_client[:written]
        return written > 0


def _type(process, typed):
    """What a terminal makes of keys."""
    if typed == CTRL_C:
        process.send_signal(signal.SIGINT)
    elif typed == CTRL_D:
        process.stdin.close()
    else:
        process.stdin.write(typed)

# SPDX-License-Identifier: MIT
"""A pseudo-terminal in front of the emulated board's console, for mpremote, screen or Thonny."""

import os
import select
import subprocess
import sys
import time
import tty


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
        self._previous = self._console.on_serial_data
        self._console.on_serial_data = self._to_client.extend
        return self

    def __exit__(self, *exc_info):
        self._console.on_serial_data = self._previous
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
        """Run the real mpremote on this terminal: its exit code and what it printed (bytes).

        After `timeout_s` of real time it is killed.
        """
        command = [sys.executable, "-m", "mpremote", "connect", self.path, *arguments]
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )
        end = time.monotonic() + timeout_s
        while process.poll() is None and time.monotonic() < end:
            self.serve_ms(10)
        process.kill()
        printed = process.communicate()[0]
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

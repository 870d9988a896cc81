# SPDX-License-Identifier: MIT
"""The line behind the REPL's output: how long a write takes, and what poll() says before it.

What MicroPython's ports do (shared/tinyusb, ports/esp32/uart.c, usb.c, usb_serial_jtag.c): the
RP2's USB has 256 bytes of buffer, and poll() tells when it is full; on an ESP32 POLLOUT is always
true. A UART sends at 115200 baud behind a FIFO of 128 bytes, whether anybody reads or not. The
S2's and S3's USB waits half a second for a reader who went away, each time; the C3's and C6's
waits 0.2 s once, and drops what comes after.
"""

_BUFFER = 256
_BYTE_NS = 86_806  # of ten bits at 115200 baud
_FIFO = 128
_CDC_NS, _JTAG_NS = 500_000_000, 200_000_000


class Console:
    """`kind`: "rp2", "uart", "cdc" or "jtag"; `reading`: whether somebody takes what is sent."""

    def __init__(self, clock, kind):
        self.clock, self.kind = clock, kind
        self.reading = True
        self.blocked_ns = 0  # so far, in writes that waited
        self._unread = 0
        self._sent_ns = 0  # when a UART has sent all
        self._gone = False

    def ready(self):
        """Whether poll() says that a write would not wait."""
        if self.reading:
            self._unread = 0
        return self.kind != "rp2" or self._unread < _BUFFER

    def write(self, count):
        """Let the time of a write of so many bytes pass."""
        if self.reading:
            self._unread, self._gone = 0, False
        if self.kind == "uart":
            self._sent_ns = max(self._sent_ns, self.clock.now_ns) + count * _BYTE_NS
            self._wait(self._sent_ns - self.clock.now_ns - _FIFO * _BYTE_NS)
        elif not self.reading:
            self._nobody(count)

    def _nobody(self, count):
        if self.kind == "jtag":
            if not self._gone:
                self._wait(_JTAG_NS)
            self._gone = True
            return
        self._unread += count
        if self._unread > _BUFFER:
            self._unread = _BUFFER
            self._wait(_CDC_NS)

    def _wait(self, ns):
        if ns > 0:
            self.blocked_ns += ns
            self.clock.hold(ns)

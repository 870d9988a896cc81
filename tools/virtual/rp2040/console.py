# SPDX-License-Identifier: MIT
"""The host's end of the emulated board's USB serial line, and MicroPython's raw REPL on it."""

from rp2040py.usb.cdc import USBCDC

CTRL_A, CTRL_B, CTRL_C, CTRL_D = b"\x01", b"\x02", b"\x03", b"\x04"
RAW_PROMPT = b"raw REPL; CTRL-B to exit\r\n>"


class Console(USBCDC):
    """USB serial line that sends a packet only when there is something to send.

    rp2040py's own host answers every request of the board with an empty packet, which no real
    host does: the firmware then works on USB for two thirds of its time and never sleeps.
    """

    def __init__(self, usb):
        super().__init__(usb)
        self._outbox = bytearray()
        self._wanted = 0  # bytes that the board's endpoint has room for
        self.on_restart = lambda: None  # called when the board drops off the bus
        self._other_endpoints = usb.on_endpoint_read
        usb.on_endpoint_read = self._on_endpoint_read

    def send(self, data):
        """Queue bytes for the board; they go as fast as it takes them."""
        self._outbox += data
        self._feed()

    @property
    def idle(self):
        """Whether everything sent has been taken."""
        return not self._outbox

    def _on_endpoint_read(self, endpoint, size):
        if endpoint != self._out_endpoint:
            self._other_endpoints(endpoint, size)
            return
        self._wanted = size
        self._feed()

    def _feed(self):
        if self._wanted and self._outbox:
            packet = bytes(self._outbox[: self._wanted])
            del self._outbox[: self._wanted]
            self._wanted = 0
            self.usb.endpoint_read_done(self._out_endpoint, packet)

    def _on_controller_reset(self):
        super()._on_controller_reset()
        self._wanted = 0
        self._outbox = bytearray()
        self.on_restart()

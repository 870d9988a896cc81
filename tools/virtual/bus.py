# SPDX-License-Identifier: MIT
"""One I2C bus at byte level: devices, line levels, faults and a log of transactions.

A host (the fake `machine.I2C`, or the I2C block of the emulated RP2040) tells the time with
`advance()` before every byte and then drives `start`, `write`, `read` and `stop`. A device has
`address`, `start(read) -> bool`, `write(value) -> bool`, `read() -> int`, `stop()`,
`advance(now_ns)` and `next_event_ns() -> int | None`. Faults are objects of tools.virtual.faults.
"""

from collections import deque
from typing import NamedTuple

LOG_LENGTH = 4096
_NEVER = 1 << 62


class BusStuck(Exception):
    """A line is held low, so the master cannot go on; it waits until its time-out.

    `line` is "sda" or "scl".
    """

    def __init__(self, line):
        super().__init__(f"{line} is held low")
        self.line = line


class ArbitrationLost(Exception):
    """The master let SDA go and read it low: somebody else drives the bus."""


class Transaction(NamedTuple):
    """One transaction, START to STOP, repeated STARTs to the same address included.

    `outcome` is "ok", "nack" (address not answered), "data_nack", "sda_stuck", "scl_stuck" or
    "arbitration".
    """

    t_ns: int
    address: int
    written: bytes
    read: bytes
    outcome: str


class Bus:
    """Devices on one pair of wires. `log` is bounded.

    `faults` may be changed at any time; the next `advance` begins and ends what that means.
    """

    def __init__(self, *devices, faults=(), log_length=LOG_LENGTH):
        self.devices = list(devices)
        self.faults = list(faults)
        self.log = deque(maxlen=log_length)
        self.now_ns = 0
        self._known = []  # the faults at the last look
        self._running = []  # those that have begun and not ended
        self._change_ns = _NEVER  # when the next one begins or ends
        self._selected = None
        self._open = None  # [t_ns, address, written, read, outcome] of the current transaction

    # time

    def advance(self, now_ns):
        """Let time pass up to `now_ns`; an earlier instant is ignored (time never goes back)."""
        if now_ns >= self._change_ns or self.faults != self._known:
            self._advance_faults(now_ns)
        if now_ns > self.now_ns:
            self.now_ns = now_ns
        for device in self.devices:
            device.advance(now_ns)

    def next_event_ns(self):
        """The next instant (ns) at which something happens by itself, or None.

        A host that wants INT edges and faults on time calls `advance` no later than this.
        """
        times = [device.next_event_ns() for device in self.devices]
        times += [fault.next_event_ns() for fault in self.faults]
        return min((t for t in times if t is not None), default=None)

    def _advance_faults(self, now_ns):
        """Begin and end faults at their own instants, in order; those taken off the list end."""
        for fault in self._running:
            if fault not in self.faults:
                fault.step(self)
        self._known = list(self.faults)
        changes = [(t_ns, fault) for fault in self._known for t_ns in fault.due(now_ns)]
        changes.sort(key=lambda change: change[0])
        for t_ns, fault in changes:
            self.now_ns = max(self.now_ns, t_ns)
            for device in self.devices:
                device.advance(self.now_ns)
            fault.step(self)
        self._settle_faults()

    def _settle_faults(self):
        self._running = [fault for fault in self._known if fault.active]
        times = [fault.next_event_ns() for fault in self._known]
        self._change_ns = min((t for t in times if t is not None), default=_NEVER)

    # lines

    @property
    def sda(self):
        """Level of SDA as a bit-banging master reads it."""
        return 0 if any(fault.holds_sda for fault in self._running) else 1

    @property
    def scl(self):
        """Level of SCL as a bit-banging master reads it."""
        return 0 if any(fault.holds_scl for fault in self._running) else 1

    def scl_pulse(self):
        """One clock by hand. A slave that holds SDA lets go after enough of them."""
        for fault in self._running:
            fault.on_pulse(self)
        self._settle_faults()

    # transfers

    def start(self, address, read):
        """(Repeated) START and the address byte; True when a device acknowledges.

        Raises BusStuck when a line is held low, ArbitrationLost when a fault says so.
        """
        if not 0 <= address <= 127:
            raise ValueError(f"I2C address {address} is not in 0..127")
        if self._open is None or self._open[1] != address:
            self._close()
            self._open = [self.now_ns, address, bytearray(), bytearray(), "ok"]
        self._check_lines()
        device = self._find(address)
        ack = False
        if device is not None:
            ack = device.start(read)
        for fault in self._concerned():
            ack = self._guard(fault.on_start, device, read, ack)
        if self._selected is not None and self._selected is not device:
            self._selected.stop()
        self._selected = device if ack else None
        if not ack:
            self._open[4] = "nack"
            if device is not None:
                device.stop()
        return ack

    def write(self, value):
        """Send one byte (0..255, else ValueError); True when the device acknowledges."""
        if value.__class__ is not int or not 0 <= value <= 255:
            raise ValueError(f"{value!r} is not a byte (0..255)")
        if self._running:
            self._check_scl()
            if not self.sda and value:  # a one is sent and a zero is seen
                self._fail("arbitration")
                raise ArbitrationLost
        if self._selected is None:
            return False
        ack = self._selected.write(value)
        if self._running:
            for fault in self._concerned():
                ack = self._guard(fault.on_write, value, ack)
        self._open[2].append(value)
        if not ack:
            self._open[4] = "data_nack"
        return ack

    def read(self, last):
        """Receive one byte; `last` is the master's NACK. 0xFF when nobody drives the line."""
        if self._running:
            self._check_scl()
        value = self._selected.read() if self._selected is not None else 0xFF
        if self._running:
            for fault in self._concerned():
                value = self._guard(fault.on_read, value, last)
            if not self.sda:
                value = 0
        if self._open is not None:
            self._open[3].append(value)
        return value

    def stop(self):
        """STOP: the transaction ends and goes to the log."""
        if self._selected is not None:
            self._selected.stop()
            self._selected = None
        self._close()

    def _find(self, address):
        for device in self.devices:
            if device.address == address:
                return device
        return None

    def _guard(self, hook, *arguments):
        try:
            return hook(self, *arguments)
        except ArbitrationLost:
            self._fail("arbitration")
            raise
        except BusStuck as stuck:
            self._fail(stuck.line + "_stuck")
            raise

    def _concerned(self):
        address = self._open[1]
        return [fault for fault in self._running if fault.address in (None, address)]

    def _check_lines(self):
        self._check_scl()
        for fault in self._running:
            if fault.holds_sda:
                fault.hits += 1
                self._fail("sda_stuck")
                raise BusStuck("sda")

    def _check_scl(self):
        for fault in self._running:
            if fault.holds_scl:
                fault.hits += 1
                self._fail("scl_stuck")
                raise BusStuck("scl")

    def _fail(self, outcome):
        if self._open is not None:
            self._open[4] = outcome
        self.stop()

    def _close(self):
        if self._open is not None:
            t_ns, address, written, read, outcome = self._open
            self.log.append(Transaction(t_ns, address, bytes(written), bytes(read), outcome))
            self._open = None

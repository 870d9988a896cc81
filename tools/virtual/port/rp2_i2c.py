# SPDX-License-Identifier: MIT
"""The DW_apb_i2c block of RP2040 and RP2350 as a master, registers and all, on a virtual bus.

RP2040 datasheet section 4.3: two FIFOs of 16, commands in IC_DATA_CMD, aborts in
IC_TX_ABRT_SOURCE. Each byte takes its time on the wire; nothing happens while IC_ENABLE is 0. Set
by `machine.I2C`: clock and pins.
"""

from collections import deque

from tools.virtual.bus import ArbitrationLost, BusStuck

from . import dw_i2c as dw

ACCESS_NS = 60  # a register access over the peripheral bus
_RETRY_NS = 20_000
_PATIENCE = 12  # reads of status registers in a row before a polling loop is assumed
_POLLED = (dw.IC_RXFLR, dw.IC_TXFLR, dw.IC_STATUS, dw.IC_RAW_INTR_STAT, dw.IC_TX_ABRT_SOURCE)


class I2CBlock:
    """One I2C block; `read(offset)` and `write(offset, value)` are what the processor does."""

    def __init__(self, port, number):
        self.port, self.number = port, number
        self.plain = {dw.IC_CON: 0x65, dw.IC_TAR: 0x55, dw.IC_INTR_MASK: 0}
        self.enabled = False
        self.polls = 0  # status reads since something else was read or written
        self._reset()

    def __repr__(self):
        return "the I2C%d block" % self.number

    def _reset(self):
        self.tx, self.rx = deque(), deque()
        self.interrupts = self.abort_source = 0
        self.event = self.byte = None
        self.running = False  # between START and STOP
        self.reading = self.first = self.aborting = False
        self.wire = None

    def disable(self):
        """IC_ENABLE=0 or a new `machine.I2C`: drops everything; the bus gets its STOP."""
        if self.event is not None:
            self.event.cancel()
        if self.running:
            self.wire.bus.advance(self.port.clock.now_ns)
            self.wire.bus.stop()
        if self.wire is not None:
            self.wire.release(self)
        self.enabled = False
        self._reset()

    @property
    def busy(self):
        return self.running or bool(self.tx)

    def read(self, offset):
        self._wait(offset)
        if offset == dw.IC_DATA_CMD:
            return self._pop()
        if offset == dw.IC_CLR_TX_ABRT:
            self.interrupts &= ~dw.TX_ABRT
            self.abort_source = 0
            return 0
        if offset == dw.IC_CLR_INTR:
            self.interrupts, self.abort_source = 0, 0
            return 0
        if offset in dw.CLEARS:
            self.interrupts &= ~dw.CLEARS[offset]
            return 0
        return self._status(offset)

    def _wait(self, offset):
        """The access takes its time; a loop that polls goes from byte to byte, not every turn."""
        wait_ns = ACCESS_NS
        self.polls = self.polls + 1 if offset in _POLLED and self.busy else 0
        if self.polls > _PATIENCE and self.event is not None:
            wait_ns = max(wait_ns, self.event.t_ns - self.port.clock.now_ns)
        self.port.clock.hold(wait_ns)

    def _status(self, offset):
        if offset == dw.IC_RXFLR:
            return len(self.rx)
        if offset == dw.IC_TX_ABRT_SOURCE:
            return self.abort_source
        if offset == dw.IC_STATUS:
            bits = (
                self.busy, len(self.tx) < dw.FIFO, not self.tx,
                bool(self.rx), len(self.rx) == dw.FIFO, self.busy,
            )  # fmt: skip
            return sum(bool(bit) << place for place, bit in enumerate(bits))
        raw = self.interrupts | (dw.TX_EMPTY if self.enabled and not self.tx else 0)
        values = {
            dw.IC_TXFLR: len(self.tx),
            dw.IC_RAW_INTR_STAT: raw, dw.IC_INTR_STAT: raw & self.plain[dw.IC_INTR_MASK],
            dw.IC_ENABLE: int(self.enabled) | self.aborting << 1,
            dw.IC_ENABLE_STATUS: int(self.enabled),
        }  # fmt: skip
        return values[offset] if offset in values else self.plain.get(offset, 0)

    def _pop(self):
        if not self.rx:
            self.interrupts |= dw.RX_UNDER
            return 0
        return self.rx.popleft()

    def write(self, offset, value):
        self.polls = 0
        self.port.clock.hold(ACCESS_NS)
        if offset == dw.IC_ENABLE:
            self._enable(value)
        elif offset == dw.IC_DATA_CMD:
            self._push(value)
        elif offset != dw.IC_TAR or not self.busy:  # the address is locked while a transfer runs
            self.plain[offset] = value

    def _enable(self, value):
        if not value & 1:
            self.disable()
        elif value & 2 and self.busy:
            self.aborting = True
            self._user_abort()
        self.enabled = bool(value & 1)

    def _user_abort(self):
        """The ABORT bit: a STOP as soon as the lines allow, until then the bit stays set."""
        wire = self.wire
        if wire is not None and self.running and not (wire.bus.scl and wire.bus.sda):
            return
        if self.event is not None:
            self.event.cancel()
            self.event = None
        self.aborting = False
        self._abort(dw.ABRT_USER_ABRT)

    def _push(self, value):
        if not self.enabled or self.interrupts & dw.TX_ABRT:
            return  # the FIFO is held empty until IC_CLR_TX_ABRT is read
        if len(self.tx) >= dw.FIFO:
            self.interrupts |= dw.TX_OVER
            return
        self.tx.append(value)
        if self.event is None:
            self._later(0, self._step)

    def _later(self, ns, action):
        clock = self.port.clock
        self.event = clock.hardware_at(clock.now_ns + ns, action)

    def _step(self):
        """Do the next command, or hold the bus when there is none."""
        self.event = None
        if not self.tx:
            return
        frequency, wire = self.port.peripherals.settings(self.number)
        bit_ns = 1_000_000_000 // frequency
        try:
            self._command(wire, bit_ns)
        except BusStuck:
            self._later(_RETRY_NS, self._step)  # it waits for a free bus as long as it must
        except ArbitrationLost:
            self._abort(dw.ARB_LOST)

    def _command(self, wire, bit_ns):
        command = self.tx[0]
        read = bool(command & dw.CMD_READ)
        wire.claim(self, again=True)
        self.wire = wire
        bus = wire.bus
        bus.advance(self.port.clock.now_ns)
        bits = 9
        if not self.running or command & dw.CMD_RESTART or read != self.reading:
            bits += 10
            self.interrupts |= dw.START_DET
            if not bus.start(self.plain[dw.IC_TAR] & 0x7F, read):
                self._later(10 * bit_ns, lambda: self._abort(dw.ABRT_7B_ADDR_NOACK))
                return
            self.running, self.reading, self.first = True, read, True
        if read:
            self.byte = bus.read(bool(command & dw.CMD_STOP))
        elif bus.write(command & 0xFF):
            self.byte = None
        else:
            self._later(bits * bit_ns, lambda: self._abort(dw.ABRT_TXDATA_NOACK))
            return
        self.tx.popleft()
        last = command & dw.CMD_STOP
        self._later(bits * bit_ns, (lambda: self._last(bit_ns)) if last else self._next)

    def _next(self):
        """A byte is complete: into the FIFO; go on."""
        self._keep()
        self._step()

    def _last(self, bit_ns):
        """The last byte is complete: into the FIFO; STOP; go on with another transfer."""
        self._keep()
        self._stop()
        if self.tx:
            self._later(bit_ns, self._step)

    def _keep(self):
        self.event = None
        if self.byte is None:
            return
        if len(self.rx) >= dw.FIFO:
            self.interrupts |= dw.RX_OVER
        else:
            self.rx.append(self.byte | (dw.FIRST_DATA_BYTE if self.first else 0))
        self.first = False

    def _stop(self):
        self.running = False
        if self.wire is None:
            return
        self.wire.bus.advance(self.port.clock.now_ns)
        self.wire.bus.stop()
        self.interrupts |= dw.STOP_DET
        self.wire.release(self)

    def _abort(self, source):
        """The commands are flushed, their number goes to the top bits of the source, the bus gets
        a STOP.
        """
        self.event = None
        self.abort_source |= source | len(self.tx) << 23
        self.tx.clear()
        self.interrupts |= dw.TX_ABRT
        self._stop()

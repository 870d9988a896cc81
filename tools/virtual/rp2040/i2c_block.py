# SPDX-License-Identifier: MIT
"""The RP2040's I2C block, with a virtual bus on its pins (RP2040 datasheet, section 4.3).

rp2040py models the registers and leaves the bus to callbacks. This class puts a
tools.virtual.bus.Bus there, gives every bit its time, and mends what the firmware or a driver
that works the registers itself would notice:

- TX_EMPTY rises when the last byte has left the shift register (TX_EMPTY_CTRL, as the SDK sets
  it) and when an abort flushes the FIFO, so that a NACK is EIO and not a time-out;
- IC_TX_ABRT_SOURCE is cleared by IC_CLR_TX_ABRT and not by looking at it, and until then
  commands are dropped;
- IC_ENABLE = 0 forgets an abort, empties both FIFOs and ends a byte under way with a STOP: so an
  interrupt's transfer in the middle of another one ruins that, as on the chip. Between two bytes
  the bus stays taken: the SDK disables the block between the two halves of a repeated start.
"""

from rp2040py.peripherals import i2c

from tools.virtual.bus import ArbitrationLost, BusStuck

CLOCK_NS = 8  # clk_peri, 125 MHz
BYTE_BITS = 9  # eight bits and the acknowledge
POLL_NS = 20_000  # how often a master that waits for an idle bus looks at it


class I2CBlock(i2c.RPI2C):
    """One block. `wires` is the rp2040.wires.Wires that its pins lead to, or None."""

    def __init__(self, rp2040, index, irq):
        super().__init__(rp2040, f"I2C{index}", irq)
        self.index = index
        self.wires = None
        self._action = None
        self._hung = self._pulling = False
        self._alarm = rp2040.clock.create_alarm(self._fire)
        self.on_start = lambda repeated: self._after(1, self.complete_start)
        self.on_connect = lambda address, mode: self._after(
            BYTE_BITS, lambda: self._connect(address, mode == i2c.I2CMode.READ)
        )
        self.on_write_byte = lambda value: self._after(BYTE_BITS, lambda: self._write(value))
        self.on_read_byte = lambda ack: self._after(BYTE_BITS, lambda: self._read(not ack))
        self.on_stop = lambda: self._after(1, self._stop_bus)

    # time

    @property
    def bit_ns(self):
        """Length of one bit (ns) as the SCL counters are set."""
        return (self.scl_low_period + self.scl_high_period) * CLOCK_NS

    def _after(self, bits, action):
        self._action = action
        self._alarm.schedule(bits * self.bit_ns)

    def _fire(self):
        action, self._action = self._action, None
        action()

    # the bus

    def _bus(self):
        """The bus, when both of its wires lead to this block's SDA and SCL; else None."""
        if self.wires is None or not self.wires.belong_to(self.index):
            return None
        self.wires.advance()
        return self.wires.bus

    def _connect(self, address, read):
        bus = self._bus()
        ack = False
        if bus is not None:
            try:
                ack = bus.start(address, read)
            except BusStuck:
                self._wait_for_idle(address, read)
                return
            except ArbitrationLost:
                self._lose()
                return
        self.complete_connect(ack)

    def _wait_for_idle(self, address, read):
        """A master sends its START only when both lines are high; it waits for ever."""

        def look():
            self.wires.advance()
            if self.wires.bus.sda and self.wires.bus.scl:
                self._hung = False
                self._connect(address, read)
            else:
                self._wait_for_idle(address, read)

        self._hung = True
        self._action = look
        self._alarm.schedule(POLL_NS)

    def _write(self, value):
        bus = self._bus()
        try:
            ack = bus is not None and bus.write(value)
        except BusStuck:
            self._hung = True
        except ArbitrationLost:
            self._lose()
        else:
            self._byte_done()
            self.complete_write(ack)

    def _read(self, last):
        bus = self._bus()
        try:
            value = 0xFF if bus is None else bus.read(last)
        except BusStuck:
            self._hung = True
        except ArbitrationLost:
            self._lose()
        else:
            self._byte_done()
            self.complete_read(value)

    def _stop_bus(self):
        self._end_on_bus()
        self.complete_stop()

    def _end_on_bus(self):
        bus = self._bus()
        if bus is not None:
            bus.stop()
            self.wires.schedule()

    def _lose(self):
        self.arbitration_lost()
        # The winner's STOP is seen by every master; the firmware waits for it.
        self._after(2 * BYTE_BITS, lambda: self._set_interrupts(i2c.R_STOP_DET))

    # registers

    def _next_command(self):
        self._pulling = True
        super()._next_command()
        self._pulling = False

    def _set_interrupts(self, mask):
        if self._pulling:
            mask &= ~i2c.R_TX_EMPTY  # the byte only begins its way to the wire
        super()._set_interrupts(mask)

    def _byte_done(self):
        if self._tx_fifo.item_count <= self.tx_threshold:
            self._set_interrupts(i2c.R_TX_EMPTY)

    def _abort(self, reason):
        super()._abort(reason)
        self._set_interrupts(i2c.R_TX_EMPTY)

    def read_uint32(self, offset):
        if offset == i2c.IC_TX_ABRT_SOURCE:
            return self.abort_source
        return super().read_uint32(offset)

    def write_uint32(self, offset, value):
        if offset == i2c.IC_DATA_CMD and self.int_raw & i2c.R_TX_ABRT:
            return  # the FIFO is held empty until the abort is cleared
        if offset == i2c.IC_ENABLE and not value & i2c.ENABLE:
            self._disable()
        super().write_uint32(offset, value)

    def _disable(self):
        self._tx_fifo.reset()
        self._rx_fifo.reset()
        self._clear_interrupts(i2c.R_RX_FULL)
        if self._hung or self._busy:
            self._give_up()
        if self._state == i2c.I2CState.IDLE:
            self.abort_source = 0
            self._clear_interrupts(i2c.R_TX_ABRT)

    def reset(self):
        self._give_up()
        super().reset()

    def _give_up(self):
        self._alarm.cancel()
        self._end_on_bus()
        self._state = i2c.I2CState.IDLE
        self._hung = self._busy = self._stop = self._pending_restart = False

# SPDX-License-Identifier: MIT
"""SDA, SCL and INT between the emulated RP2040's pins and a virtual bus.

The firmware bit-bangs zero-length writes (`scan()`), `SoftI2C` and a bus recovery's nine clocks
with ordinary GPIO. So the wires are watched: START, STOP and bits are decoded from the levels,
and the levels that the devices drive can be read at the pins.
"""

from rp2040py.gpio_pin import GPIOPinState

from tools.virtual.bus import ArbitrationLost, BusStuck

FUNCTION_I2C = 3  # GPIO function select, RP2040 datasheet table 2
IDLE, RECEIVE, ACK, SEND, MASTER_ACK = range(5)


class Wires:
    """The bus `bus` on GPIO numbers `sda` and `scl`; each device's INT on `int_pin`, or None."""

    def __init__(self, rp2040, bus, sda, scl, int_pin=None):
        self.bus = bus
        self._clock = rp2040.clock
        self._sda_pin, self._scl_pin = rp2040.gpio[sda], rp2040.gpio[scl]
        self._sda, self._scl = 1, 1  # levels on the wires
        self._pull = False  # a device pulls SDA low, in answer to a bit-banging master
        self._state = IDLE
        self._bits, self._byte = 0, 0
        self._address_next = self._reading = False
        self._alarm = rp2040.clock.create_alarm(self._on_event)
        self._sda_pin.add_listener(lambda new, old: self._changed())
        self._scl_pin.add_listener(lambda new, old: self._changed())
        if int_pin is not None:
            self._connect_int(rp2040.gpio[int_pin])
        self._drive()
        self.schedule()

    def _connect_int(self, pin):
        for device in self.bus.devices:
            device.on_int = lambda level: pin.set_input_value(bool(level))
            pin.set_input_value(bool(device.int_level))

    def belong_to(self, block):
        """Whether SDA and SCL lead to the SDA and SCL of I2C block number `block`."""
        sda, scl = self._sda_pin, self._scl_pin
        return (
            sda.function_select == FUNCTION_I2C
            and scl.function_select == FUNCTION_I2C
            and sda.index & 3 == 2 * block
            and scl.index & 3 == 2 * block + 1
        )

    # time

    def advance(self):
        """Tell the bus what time it is."""
        self.bus.advance(int(self._clock.nanos))

    def schedule(self):
        """Be called again when the bus does something by itself (INT edge, fault)."""
        event = self.bus.next_event_ns()
        if event is None:
            self._alarm.cancel()
        else:
            self._alarm.schedule(max(event - self._clock.nanos, 0))

    def _on_event(self):
        self.advance()
        self._changed()
        self.schedule()

    # levels

    def _changed(self):
        """A pin or the bus may have changed a level: decode the edge, show the levels."""
        self._follow()
        self._drive()

    def _follow(self):
        sda, scl = self._levels()
        if (sda, scl) == (self._sda, self._scl):
            return
        old_sda, old_scl = self._sda, self._scl
        self._sda, self._scl = sda, scl
        if old_scl and scl:
            self._start() if old_sda else self._stop()
        elif scl and not old_scl:
            self._rise()
        elif old_scl and not scl:
            self._fall()
        if self._levels() != (self._sda, self._scl):
            self._follow()  # a device answered the edge with SDA

    def _levels(self):
        sda = self._sda_pin.value != GPIOPinState.LOW and not self._pull and self.bus.sda
        scl = self._scl_pin.value != GPIOPinState.LOW and self.bus.scl
        return int(sda), int(scl)

    def _drive(self):
        for pin, level in ((self._sda_pin, self._sda), (self._scl_pin, self._scl)):
            if pin.input_value != bool(level):
                pin.set_input_value(bool(level))

    # a bit-banging master

    def _start(self):
        self.advance()
        self._state, self._bits, self._byte = RECEIVE, 0, 0
        self._address_next = True

    def _stop(self):
        self._state = IDLE
        self.advance()
        self.bus.stop()
        self.schedule()

    def _rise(self):
        if not self.bus.sda:  # somebody hangs in the middle of a byte: a clock moves it on
            self.advance()
            self.bus.scl_pulse()
        elif self._state == RECEIVE:
            self._byte = self._byte << 1 | self._sda
            self._bits += 1
        elif self._state == SEND:
            self._bits += 1
        elif self._state == MASTER_ACK and self._sda:
            self._state = IDLE  # NACK: the master has had enough

    def _fall(self):
        if self._state == RECEIVE and self._bits == 8:
            self._pull = self._received(self._byte)
            self._state = ACK if self._pull else IDLE
        elif self._state == ACK:
            self._pull = False
            self._bits, self._byte = 0, 0
            self._state = RECEIVE
            if self._reading:
                self._send()
        elif self._state == SEND and self._bits == 8:
            self._pull = False
            self._state = MASTER_ACK
        elif self._state == SEND:
            self._pull = not self._byte >> (7 - self._bits) & 1
        elif self._state == MASTER_ACK:
            self._send()

    def _received(self, value):
        """Give a byte to the bus; True when it is acknowledged."""
        self.advance()
        try:
            if not self._address_next:
                return self.bus.write(value)
            self._address_next = False
            self._reading = bool(value & 1)
            return self.bus.start(value >> 1, self._reading)
        except (BusStuck, ArbitrationLost):
            return False

    def _send(self):
        self.advance()
        try:
            self._byte = self.bus.read(False)
        except (BusStuck, ArbitrationLost):
            self._byte = 0xFF
        self._state, self._bits = SEND, 0
        self._pull = not self._byte >> 7

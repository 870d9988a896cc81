# SPDX-License-Identifier: MIT
"""The pins of a virtual board: levels, drivers, interrupts, and the wires of the I2C buses among
them.
"""

from collections import deque

RISING, FALLING = "rising", "falling"
_LOG_LENGTH = 10_000


class PinState:
    """One pin as the outside sees it: `level`, `drive(level)` from outside, `log` of (t_ns, level
    written).
    """

    def __init__(self, pins, number):
        self.pins, self.number = pins, number
        self.mode, self.pull, self.function = "IN", None, "SIO"
        self.latch, self.external = 0, None
        self.line = None  # (bus id, "sda" or "scl") when an I2C bus is wired to this pin
        self.handler, self.triggers, self.hard, self.pending = None, (), False, False
        self.log = deque(maxlen=_LOG_LENGTH)
        self.pwm = None
        self.pin = None  # the board's Pin object

    @property
    def pulls_low(self):
        """True when this pin itself drives a low level."""
        return self.function == "SIO" and self.mode in ("OUT", "OPEN_DRAIN") and not self.latch

    @property
    def level(self):
        """0 or 1, as the input buffer reads it."""
        if self.pulls_low:
            return 0
        if self.function == "SIO" and self.mode == "OUT":
            return 1
        if self.external is not None:  # soldered to something, whatever else the pin could be
            return self.external
        if self.line is not None:
            return self.pins.line_level(self)
        return 1 if self.pull == "PULL_UP" else 0

    def drive(self, level):
        """Let something outside drive the pin to 0 or 1, or let go (None); edges raise the pin's
        interrupt.
        """
        before = self.level
        self.external = None if level is None else int(bool(level))
        self.edge(before, self.level)

    def edge(self, before, after):
        if (
            before != after
            and (RISING if after else FALLING) in self.triggers
            and self.handler is not None
        ):
            self.pins.interrupt(self)

    def write(self, value):
        """The board writes its output latch."""
        value = int(bool(value))
        self.log.append((self.pins.port.clock.now_ns, value))
        before, self_low = self.level, self.pulls_low
        self.latch = value
        if self.line is not None and self.function == "SIO" and self_low and not self.pulls_low:
            self.pins.released(self)
        self.edge(before, self.level)

    def configure(self, mode, pull, value):
        """What `Pin.init` does; takes the pin away from any peripheral."""
        before_low = self.pulls_low
        self.function = "SIO"
        if value is not None:
            self.log.append((self.pins.port.clock.now_ns, int(bool(value))))
            self.latch = int(bool(value))
        if mode is not None:
            self.mode = mode
        self.pull = pull
        if self.line is not None and before_low and not self.pulls_low:
            self.pins.released(self)


class Pins:
    """All pins of one Port; `wiring` {bus id: (sda, scl)} fixes where a bus is connected, else it
    follows the code.
    """

    def __init__(self, port, wiring=None):
        self.port = port
        self.states = {}
        self.wired = dict(wiring or {})
        self.fixed = wiring is not None
        self.lines = {}  # bus id -> (sda, scl)
        for bus_id, default in enumerate(port.traits.i2c_pins):
            if bus_id in port.buses:
                self._connect(bus_id, *self.wired.get(bus_id, default))

    def state(self, number):
        if number not in self.states:
            self.states[number] = PinState(self, number)
        return self.states[number]

    def number(self, pin):
        """Return the GPIO number of a Pin object, an int or a name; ValueError as on the board."""
        if hasattr(pin, "_state"):
            return pin._state.number
        if isinstance(pin, str):
            if pin not in self.port.traits.pin_names:
                raise ValueError('unknown named pin "%s"' % pin)
            return self.port.traits.pin_names[pin]
        if not isinstance(pin, int) or not 0 <= pin < self.port.traits.pin_count:
            raise ValueError("invalid pin")
        return pin

    def _connect(self, bus_id, sda, scl):
        for number in self.lines.get(bus_id, ()):
            self.state(number).line = None
        self.lines[bus_id] = (sda, scl)
        self.state(sda).line = (bus_id, "sda")
        self.state(scl).line = (bus_id, "scl")

    def give_to_i2c(self, bus_id, sda, scl):
        """The I2C block takes its pins. Without a fixed wiring the bus's devices hang on them."""
        if not self.fixed:
            self._connect(bus_id, sda, scl)
        for number in (sda, scl):
            self.state(number).function = "I2C"
            self.state(number).mode = "ALT"

    def wired_bus(self, sda, scl):
        """Id of the bus whose devices hang on these pins, or None."""
        for bus_id, pins in self.lines.items():
            if pins == (sda, scl):
                return bus_id
        return None

    def take_for_soft_i2c(self, sda, scl):
        """Open-drain pins for SoftI2C; returns the id of the bus there (devices move along without
        a fixed wiring).
        """
        bus_id = self.wired_bus(sda, scl)
        if bus_id is None and not self.fixed and len(self.port.buses) == 1:
            bus_id = next(iter(self.port.buses))
            self._connect(bus_id, sda, scl)
        for number in (sda, scl):
            self.state(number).configure("OPEN_DRAIN", None, 1)
        return bus_id

    def interrupt(self, state):
        """An edge at a pin. One interrupt for all that came while it could not be taken."""
        if not state.pending:
            state.pending = True
            self.port.clock.interrupt(lambda: self._call(state))

    def _call(self, state):
        state.pending = False
        if state.handler is None:
            return
        if not state.hard:
            self.port.clock.scheduler.offer(state.handler, state.pin)
        elif not self.port.hard.call(
            state.handler, state.pin, "Uncaught exception in IRQ callback handler"
        ):
            state.handler, state.triggers = None, ()

    def selected(self, number, function):
        return self.state(number).function == function

    def line_level(self, state):
        bus_id, line = state.line
        bus = self.port.wire(bus_id).bus
        bus.advance(self.port.clock.now_ns)
        return getattr(bus, line)

    def released(self, state):
        """A pin that pulled a bus line low lets go: a clock by hand, or with SCL high a STOP."""
        bus_id, line = state.line
        bus = self.port.wire(bus_id).bus
        bus.advance(self.port.clock.now_ns)
        if line == "scl":
            bus.scl_pulse()
        elif not self.state(self.lines[bus_id][1]).pulls_low:
            bus.stop()

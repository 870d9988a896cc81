# SPDX-License-Identifier: MIT
"""The pins of a virtual board: levels, drivers, interrupts, and the wires of the I2C buses among them."""

from collections import deque

RISING, FALLING = "rising", "falling"
_LOG_LENGTH = 10_000


class PinState:
    """One pin as the outside sees it: `level`, `drive(level)` from outside, `log` of (t_ns, level written)."""

    def __init__(self, pins, number):
        self.pins, self.number = pins, number
        self.mode, self.pull, self.function = "IN", None, "SIO"
        self.latch, self.external = 0, None
        self.line = None  # (bus id, "sda" or "scl") when an I2C bus is wired to this pin
        self.handler, self.triggers, self.hard = None, (), False
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
        if self.line is not None:
            return self.pins.line_level(self)
        if self.external is not None:
            return self.external
        return 1 if self.pull == "PULL_UP" else 0

    def drive(self, level):
        """Let something outside drive the pin to 0 or 1, or let go (None); edges raise the pin's interrupt."""
        before = self.level
        self.external = None if level is None else int(bool(level))
        self.edge(before, self.level)

    def edge(self, before, after):
        if (
            before != after
            and (RISING if after else FALLING) in self.triggers
            and self.handler is not None
        ):
            self.pins.port.interrupt(self)

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
    """All pins of one Port; `wiring` {bus id: (sda, scl)} fixes where a bus is connected, else it follows the code."""

    def __init__(self, port, wiring=None):
        self.port = port
        self.states = {}
        self.wired = dict(wiring or {})
        self.fixed = wiring is not None
        self.lines = {}  # bus id -> (sda, scl)
        for bus_id, default in enumerate(port.traits.i2c_pins):
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
        """Open-drain pins for SoftI2C; returns the id of the bus there (devices move along without a fixed wiring)."""
        bus_id = self.wired_bus(sda, scl)
        if bus_id is None and not self.fixed and len(self.port.buses) == 1:
            bus_id = next(iter(self.port.buses))
            self._connect(bus_id, sda, scl)
        for number in (sda, scl):
            self.state(number).configure("OPEN_DRAIN", None, 1)
        return bus_id

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


class Irq:
    """What `Pin.irq()` returns."""

    def __init__(self, state, names):
        self._state, self._names = state, names

    def flags(self):
        return self._state.flags if hasattr(self._state, "flags") else 0

    def trigger(self, *new):
        before = sum(self._names[name] for name in self._state.triggers)
        if new:
            self._state.triggers = tuple(n for n, bit in self._names.items() if new[0] & bit)
        return before

    def __call__(self):
        self._state.pins.port.interrupt(self._state)


class Pin:
    """`machine.Pin`: one object for each number; constants and irq arguments are the port's."""

    _port = None
    _modes = None  # number -> name

    def __new__(cls, id, mode=None, pull=None, *, value=None, alt=None, drive=None):
        pins = cls._port.pins
        state = pins.state(pins.number(id))
        if state.pin is None:
            state.pin = object.__new__(cls)
            state.pin._state = state
        if any(argument is not None for argument in (mode, pull, value, alt, drive)):
            state.pin.init(mode, pull, value=value)
        return state.pin

    def init(self, mode=None, pull=None, *, value=None, alt=None, drive=None):
        constants = self._port.traits.pin_constants
        names = [n for n in ("IN", "OUT", "OPEN_DRAIN", "ALT") if constants.get(n) == mode]
        if mode is not None and not names:
            raise ValueError("invalid pin mode")
        pulls = [n for n in ("PULL_UP", "PULL_DOWN") if constants[n] == pull]
        self._state.configure(names[0] if names else None, pulls[0] if pulls else None, value)

    def __repr__(self):
        if self._port.traits.platform == "esp32":
            return "Pin(%d)" % self._state.number
        mode = "ALT" if self._state.function != "SIO" else self._state.mode
        pull = ", pull=%s" % self._state.pull if self._state.pull else ""
        return "Pin(GPIO%d, mode=%s%s)" % (self._state.number, mode, pull)

    def value(self, *value):
        """Level of the pin, or set its output."""
        if not value:
            return self._state.level
        self._state.write(value[0])
        return None

    __call__ = value

    def on(self):
        self._state.write(1)

    def off(self):
        self._state.write(0)

    def toggle(self):
        self._state.write(not self._state.latch)

    def irq(self, handler=None, trigger=None, **options):
        """`hard=` exists on rp2 only, `wake=` on esp32 only, as in 1.25."""
        rp2 = self._port.traits.platform == "rp2"
        hard = options.pop("hard", False) if rp2 else False
        if not rp2:
            options.pop("wake", None)
        if options:
            raise TypeError("extra keyword arguments given")
        constants = self._port.traits.pin_constants
        names = {RISING: constants["IRQ_RISING"], FALLING: constants["IRQ_FALLING"]}
        irq = Irq(self._state, names)
        if handler is not None or trigger is not None:
            state = self._state
            state.handler, state.hard = handler, bool(hard)
            irq.trigger(sum(names.values()) if trigger is None else trigger)
        return irq


def make_pin(port):
    """Return the Pin class of a Port."""
    extra = {} if port.traits.platform == "esp32" else {"low": Pin.off, "high": Pin.on}
    return type("Pin", (Pin,), {**port.traits.pin_constants, **extra, "_port": port})

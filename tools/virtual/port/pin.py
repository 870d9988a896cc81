# SPDX-License-Identifier: MIT
"""`machine.Pin` of a port, over the states of tools.virtual.port.pins."""

from .pins import FALLING, RISING


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
        self._state.pins.interrupt(self._state)


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

    def irq(self, *arguments, **options):
        """irq(handler=None, trigger=both edges), `hard=` on rp2 and `wake=` on esp32, as in 1.25.

        Without any argument nothing changes.
        """
        rp2 = self._port.traits.platform == "rp2"
        constants = self._port.traits.pin_constants
        names = {RISING: constants["IRQ_RISING"], FALLING: constants["IRQ_FALLING"]}
        irq = Irq(self._state, names)
        if arguments or options:
            given = {**dict(zip(("handler", "trigger"), arguments)), **options}
            if set(given) - {"handler", "trigger", "hard" if rp2 else "wake"}:
                raise TypeError("extra keyword arguments given")
            self._state.handler = given.get("handler")
            self._state.hard = bool(given.get("hard", False))
            irq.trigger(given.get("trigger", sum(names.values())))
        return irq


def make_pin(port):
    """Return the Pin class of a Port."""
    extra = {} if port.traits.platform == "esp32" else {"low": Pin.off, "high": Pin.on}
    return type("Pin", (Pin,), {**port.traits.pin_constants, **extra, "_port": port})

# SPDX-License-Identifier: MIT
"""The `machine` module of a Port, put together from its parts."""

import types

from . import i2c_blocks, outputs, soft_i2c, timers
from .outputs import VirtualReset
from .pin import make_pin

_FOR_EVER_MS = 600_000


class Memory:
    """`machine.mem32` and its like: peripheral registers by address."""

    def __init__(self, port, size):
        self._port, self._size = port, size

    def __getitem__(self, address):
        return self._peripheral(address)[0] & 0xFFFFFFFF

    def __setitem__(self, address, value):
        self._peripheral(address)[0] = value & 0xFFFFFFFF

    def _peripheral(self, address):
        found = (
            self._port.peripherals.find(address & 0xFFFFFFFF, "ptr32") if self._size == 4 else None
        )
        if found is None:
            raise ValueError(
                "no %d-bit register is modelled at 0x%08X" % (8 * self._size, address)
            )
        return found


def make_module(port):
    """Return a new `machine` module for `port`."""
    rp2 = port.traits.platform == "rp2"
    module = types.ModuleType(
        "machine", "The machine module of a virtual %s." % port.traits.machine
    )
    hardware = i2c_blocks.Rp2I2C if rp2 else i2c_blocks.Esp32I2C
    timer = timers.Rp2Timer if rp2 else timers.Esp32Timer
    module.Pin = make_pin(port)
    module.I2C = type("I2C", (hardware,), {"_port": port, "_blocks": {}})
    module.SoftI2C = type("SoftI2C", (soft_i2c.SoftI2C,), {"_port": port})
    module.Timer = type("Timer", (timer,), {"_port": port, "_numbered": {}})
    for name in ("PWM", "ADC", "WDT"):
        setattr(module, name, type(name, (getattr(outputs, name),), {"_port": port}))
    module.mem8, module.mem16, module.mem32 = (Memory(port, size) for size in (1, 2, 4))
    for name, value in port.traits.reset_causes.items():
        setattr(module, name, value)
    _add_functions(module, port)
    return module


def _add_functions(module, port):
    clock = port.clock

    def reset():
        cause = port.traits.reset_causes.get("HARD_RESET", port.traits.reset_causes["WDT_RESET"])
        raise VirtualReset(cause, "machine.reset()")

    def soft_reset():
        cause = port.traits.reset_causes.get("SOFT_RESET", port.reset_cause)
        raise VirtualReset(cause, "machine.soft_reset()")

    def freq(*hz):
        return None if hz else port.traits.cpu_hz

    def idle():
        event_ns = clock.next_event_ns()
        soonest = clock.now_ns + 1_000_000
        clock.sleep_until(soonest if event_ns is None else min(soonest, event_ns))

    def lightsleep(ms=None):
        clock.sleep(1_000_000 if ms is None else ms * 1_000_000)

    def deepsleep(ms=None):
        """Interrupts and callbacks are over; a pin that may wake it, or the time, starts it anew.
        """
        clock.interrupts = False
        end_ns = clock.now_ns + (_FOR_EVER_MS if ms is None else ms) * 1_000_000
        while not port.woken():
            if clock.now_ns >= end_ns:
                if ms is None:
                    raise RuntimeError("it sleeps for ever: nothing wakes it")
                break
            clock.hold(1_000_000)
        causes = port.traits.reset_causes
        raise VirtualReset(causes.get("DEEPSLEEP_RESET", causes["WDT_RESET"]), "deep sleep")

    def disable_irq():
        before, clock.interrupts = clock.interrupts, False
        return before

    def enable_irq(state=True):
        clock.interrupts = bool(state)
        clock.breathe()

    module.reset, module.soft_reset, module.freq, module.idle = reset, soft_reset, freq, idle
    module.lightsleep, module.disable_irq, module.enable_irq = lightsleep, disable_irq, enable_irq
    module.deepsleep = deepsleep
    module.reset_cause = lambda: port.reset_cause
    module.unique_id = lambda: port.unique_id
    module.bootloader = reset

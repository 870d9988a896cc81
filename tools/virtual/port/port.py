# SPDX-License-Identifier: MIT
"""`Port`: a virtual board on CPython. See its docstring."""

import os
import sys
import time as host_time
import traceback
from pathlib import Path

from tools.virtual import viper

from . import async_loop, board_modules, machine, micropython, ticks, traits
from .board_import import ROOT, Importer, board_code
from .clock import Clock
from .console import Console
from .hard import HardInterrupts
from .outputs import VirtualReset
from .peripherals import Peripherals, WakePointer
from .pins import Pins
from .scheduler import Scheduler
from .wire import Wire

_TICK_NAMES = (
    "ticks_us",
    "ticks_ms",
    "ticks_cpu",
    "ticks_add",
    "ticks_diff",
    "sleep_ms",
    "sleep_us",
)


class Port:
    """A board of personality 'rp2' or 'esp32' while its `with` block runs.

    `buses` {id: Bus} are the I2C buses; `machine_name` a chip of traits.MACHINES; `version`
    MicroPython's (rp2 has hard timers from 1.26 on); `before_wrap_s` how long before their wrap
    the ticks start; `pace` None for as fast as possible, 1.0 for real time; `wiring` {id: (sda,
    scl)} fixes the pins a bus is soldered to; `reset_cause` what `machine.reset_cause()` says;
    `gc_ns` the time of a collection. `machine`, `micropython`, `rp2` or `esp32` are importable
    inside; board code is imported afresh and sees the board's `time`, `sys`, `os`, `gc`, `select`,
    `errno`, `asyncio` too; the host's `time` has the ticks functions added.
    `console.reading` is whether somebody reads what the board prints. `errors` are the exceptions
    that left a callback, and what a hard one may not do (hard.py).
    """

    def __init__(
        self, platform, buses=None, *, machine_name=None, version=(1, 25, 0), before_wrap_s=None,
        pace=None, wiring=None, reset_cause=None, root=None, call_ns=1_000, gc_ns=10_000_000,
        paths=(),
    ):  # fmt: skip
        self.traits = traits.find(platform, machine_name)
        self.version = version
        self.clock = Clock(Scheduler(self._report), pace)
        self.console = Console(self.clock, self.traits.console)
        self.buses = dict(buses or {})
        self.root = root
        self.pins = Pins(self, wiring)
        self.hard = HardInterrupts(self)
        self.gc_ns = gc_ns
        self._wires = {None: Wire(self.clock, None)}
        self.peripherals = Peripherals(self)
        self._followed, self._follow_event = set(), None
        self.errors, self.adc, self.stdin = [], {}, ""
        self.wake_levels = {}  # of an ESP32: pin: level
        self.watchdog, self.unique_id = None, bytes.fromhex("e660583883724a32")
        self.reset_cause = (
            self.traits.reset_causes["PWRON_RESET"] if reset_cause is None else reset_cause
        )
        self._before_wrap_s = ticks.START_BEFORE_WRAP_S if before_wrap_s is None else before_wrap_s
        self._make_modules(call_ns, paths)

    def _make_modules(self, call_ns, paths):
        viper.install_types()
        self.time = ticks.make_module(self.clock, self.hard, self._before_wrap_s, call_ns)
        self.machine = machine.make_module(self)
        modules = board_modules.make_modules(self)
        del modules["esp32" if self.traits.platform == "rp2" else "rp2"]
        modules.update(
            time=self.time, machine=self.machine, asyncio=async_loop.make_module(self.clock),
            micropython=micropython.make_module(self.clock.scheduler),
        )  # fmt: skip
        self.modules = modules
        self.importer = Importer(self, modules, paths)

    def __enter__(self):
        self.root = Path(self.root or os.getcwd())
        self._saved_modules = self.importer.install()
        shared = {"machine", "micropython", self.traits.platform}
        self._replaced = {n: sys.modules.get(n) for n in shared}
        sys.modules.update({n: self.modules[n] for n in shared})
        viper.address_space.append(self.peripherals.find)
        for name in _TICK_NAMES:
            setattr(host_time, name, getattr(self.time, name))
        return self

    def __exit__(self, *error):
        for name in _TICK_NAMES:
            delattr(host_time, name)
        viper.address_space.remove(self.peripherals.find)
        for name, module in self._replaced.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module
        self.importer.remove(self._saved_modules)
        return False

    # time

    @property
    def now_ns(self):
        return self.clock.now_ns

    @property
    def dropped(self):
        """Soft callbacks that found the schedule queue full."""
        return self.clock.scheduler.dropped

    def run_ms(self, ms):
        """Let the main program wait: timers, interrupts and soft callbacks run, also those that
        wait at its end.
        """
        self.clock.sleep(int(ms * 1_000_000))
        for _ in range(self.clock.scheduler.depth):
            self.clock.breathe()

    def timer_us(self):
        return self.clock.now_ns // 1000 + ticks.PERIOD - int(self._before_wrap_s * 1e6)

    # pins and buses

    def pin(self, number):
        """State of a pin: `level`, `drive(level)`, `log`, `pwm`."""
        return self.pins.state(self.pins.number(number))

    def connect_int(self, chip, pin_number):
        """Solder a chip's INT output to a pin; its edges come at their own instants."""
        state = self.pin(pin_number)
        state.external = chip.int_level
        chip.on_int = state.drive
        for bus in self.buses.values():
            if chip in bus.devices:
                self._followed.add(bus)
        self._follow()

    def woken(self):
        """Whether a pin is at a level that ends a deep sleep."""
        if self.traits.platform == "rp2":
            return WakePointer.awake(self.peripherals.wake, lambda n: self.pins.state(n).level)
        return any(self.pins.state(n).level == level for n, level in self.wake_levels.items())

    def wire(self, bus_id):
        if bus_id not in self._wires:
            self._wires[bus_id] = Wire(
                self.clock, self.buses.get(bus_id), self._after_transfer, self._report
            )
        return self._wires[bus_id]

    def wire_at(self, sda, scl):
        """The bus that is soldered to these pins, or an empty one."""
        return self.wire(self.pins.wired_bus(sda, scl))

    def _after_transfer(self, wire):
        if wire.bus in self._followed:
            self._follow()

    def _follow(self):
        """Keep one event at the next instant at which a followed bus does something by itself."""
        if self._follow_event is not None:
            self._follow_event.cancel()
            self._follow_event = None
        times = [bus.next_event_ns() for bus in self._followed]
        due = min((t for t in times if t is not None), default=None)
        if due is not None:
            due = max(due, self.clock.now_ns)
            self._follow_event = self.clock.hardware_at(due, self._bus_events)

    def _bus_events(self):
        self._follow_event = None
        for bus in self._followed:
            bus.advance(self.clock.now_ns)
        self._follow()

    def _report(self, error):
        """An exception left a callback: printed, collected, and everything goes on."""
        self.errors.append(error)
        traceback.print_exception(error, file=sys.stderr)

    # files and programs

    def path(self, name):
        """Host path of a file on the board; its root is where the Port was entered."""
        self.hard.refuse("a file")
        if not isinstance(name, (str, os.PathLike)):
            return name
        return Path(self.root) / str(name).lstrip("/")

    def run_file(self, path, variables=None):
        """Run a program as the board would (main.py); returns its globals. A relative path starts
        at the project.
        """
        path = Path(path) if Path(path).is_absolute() else ROOT / path
        variables = {} if variables is None else variables
        variables.update(__name__="__main__", __builtins__=self.importer.builtins)
        exec(board_code(path), variables)
        return variables

    def exec(self, source, variables):
        """Run a line as at the REPL, in the globals that `run_file` returned."""
        variables.setdefault("__builtins__", self.importer.builtins)
        exec(source, variables)
        self.clock.breathe()


__all__ = ["Port", "VirtualReset"]

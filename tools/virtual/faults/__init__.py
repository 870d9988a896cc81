# SPDX-License-Identifier: MIT
"""What goes wrong on a bus and in a chip: objects for Bus.faults, or a scenario file of them.

Each fault begins at `at_s` (bus time, seconds) and lasts `for_s` (None: until the end, or until
its own end); `seed` makes its chances repeatable, `address` picks a device (None: the first).
A scenario is a JSON list of {"at_s": 1.5, "fault": "nack", "for_s": 0.02, ...parameters}.
"""

import inspect
import json

from tools.virtual.faults.bus_faults import (
    BitFlip,
    Filled,
    LostArbitration,
    Nack,
    SdaHeld,
    Timeout,
)
from tools.virtual.faults.chip_faults import (
    BrownOut,
    ClockOff,
    FifoMisaligned,
    FifoOverflow,
    IntDead,
    Saturation,
    StuckData,
    Unplugged,
)
from tools.virtual.faults.fault import Fault

__all__ = [
    "FAULTS",
    "BitFlip",
    "BrownOut",
    "ClockOff",
    "Fault",
    "FifoMisaligned",
    "FifoOverflow",
    "Filled",
    "IntDead",
    "LostArbitration",
    "Nack",
    "Saturation",
    "SdaHeld",
    "StuckData",
    "Timeout",
    "Unplugged",
    "load_scenario",
    "make",
]

FAULTS = {
    "nack": Nack,
    "timeout": Timeout,
    "arbitration": LostArbitration,
    "sda_held": SdaHeld,
    "brown_out": BrownOut,
    "unplugged": Unplugged,
    "stuck_data": StuckData,
    "filled": Filled,
    "bit_flip": BitFlip,
    "int_dead": IntDead,
    "clock_off": ClockOff,
    "fifo_overflow": FifoOverflow,
    "fifo_misaligned": FifoMisaligned,
    "saturation": Saturation,
}
_COMMON = ("at_s", "for_s", "seed", "address")


def make(name, **parameters):
    """A fault by its name in FAULTS; ValueError names what is unknown and what there is."""
    if name not in FAULTS:
        raise ValueError(f"no fault {name!r}; there are {', '.join(FAULTS)}")
    own = list(inspect.signature(FAULTS[name].__init__).parameters)[1:]
    allowed = dict.fromkeys([*_COMMON, *(key for key in own if key != "times")])
    for key in parameters:
        if key not in allowed:
            raise ValueError(f"fault {name!r} has no {key!r}; it takes {', '.join(allowed)}")
    return FAULTS[name](**parameters)


def load_scenario(source):
    """The faults of a scenario: a path to a JSON file, or the list itself.

    ValueError names the entry and what is wrong with it. An entry without "seed" gets its number.
    """
    if not isinstance(source, list):
        with open(source) as file:
            try:
                source = json.load(file)
            except json.JSONDecodeError as error:
                raise ValueError(f"{file.name}: not JSON: {error}") from None
    if not isinstance(source, list):
        raise ValueError("a scenario is a list of faults")
    return [_entry(number, entry) for number, entry in enumerate(source)]


def _entry(number, entry):
    if not isinstance(entry, dict) or "fault" not in entry or "at_s" not in entry:
        raise ValueError(f'entry {number}: {entry!r} needs "fault" and "at_s"')
    parameters = {"seed": number, **entry}
    name = parameters.pop("fault")
    try:
        return make(name, **parameters)
    except (TypeError, ValueError) as error:
        raise ValueError(f"entry {number}: {error}") from None

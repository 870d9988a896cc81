# SPDX-License-Identifier: MIT
"""The fault kinds: what is done to a running app, how long, and which counter has to see it."""

from dataclasses import dataclass, field

from tools.virtual.faults import make

# knobs of the app in the runs whose loop follows the sensor's INT line
_BY_EDGES = {"drive": "data-ready", "sensor_hz": 250}


@dataclass(frozen=True)
class Kind:
    """One kind. Times in seconds; `bar_s` is the longest recovery allowed after its end."""

    name: str
    faults: tuple  # (name, parameters) of tools.virtual.faults, or the name of an Action below
    for_s: tuple  # shortest and longest duration
    sees: tuple  # entries of app.stats(): one of them must move
    bar_s: float = 0.25
    error_deg: float = 5.0  # a claimed angle further off is a silent wrong angle
    after_deg: float = 5.0  # the same one second after its end
    after_s: float = 1.05  # watched after its end
    knobs: dict = field(default_factory=dict)
    motion: str = "free"  # or "swing": 100 deg/s about the roll axis
    fifo: bool = False  # the samples come through the chip's FIFO


def _bus(name, fault, sees, for_s=(0.005, 0.06), **rest):
    parameters = rest.pop("parameters", {})
    return Kind(name, ((fault, parameters),), for_s, sees, **rest)


KINDS = (
    _bus("nack_burst", "nack", ("nack",), (0.004, 0.03), bar_s=0.020),
    _bus("timeout", "timeout", ("timeout",), bar_s=0.050),
    _bus("arbitration_lost", "arbitration", ("nack", "timeout"), bar_s=0.050),
    _bus("sda_held", "sda_held", ("timeout",), (0.2, 0.2), bar_s=0.050, parameters={"clocks": 9}),
    _bus("brown_out", "brown_out", ("nack", "fill"), (0.0005, 0.01), bar_s=0.25),
    _bus("stuck_data", "stuck_data", ("frozen",), (0.08, 0.2), bar_s=0.3),
    _bus("filled_FE", "filled", ("fill",), parameters={"value": 0xFE}),
    _bus("filled_FF", "filled", ("fill",), parameters={"value": 0xFF}),
    _bus("filled_00", "filled", ("fill",), parameters={"value": 0x00}),
    _bus("bit_flips", "bit_flip", ("jump",), (12.0, 12.0), parameters={"p": 0.01},
         error_deg=2.0),
    _bus("saturation", "saturation", ("saturated",), (0.015, 0.05)),
    _bus("unplugged", "unplugged", ("nack",), (0.1, 0.6), after_s=1.6),
    _bus(  # its gyro's bias is unknown, 2.7 deg/s here, and the motion goes on
        "another_part", "unplugged", ("another",), (0.1, 0.3), after_s=1.6, error_deg=8.0,
        parameters={"profile": ("ICM20689", "MPU6500", "MPU6050")},
    ),
    _bus("int_dead", "int_dead", ("edges_missing",), (0.05, 0.3), knobs=_BY_EDGES),
    _bus("clock_2_percent", "clock_off", ("clock",), (2.0, 2.0), knobs=_BY_EDGES),
    Kind("callback_lost", ("lose_callbacks",), (0.01, 0.06), ("lost",)),
    Kind("tick_wrap", ("wrap",), (0.0, 0.0), ("tick_wraps",)),
    Kind("user_exception", ("user_raises",), (0.01, 0.1), ("output_errors",)),
    _bus("fifo_overflow", "fifo_overflow", ("overflows",), (0.0, 0.0), fifo=True,
         parameters={"extra": (1, 5, 9, 13, 2)}),
    _bus("fifo_misaligned", "fifo_misaligned", ("misaligned",), (0.0, 0.0), fifo=True,
         parameters={"lost": (1, 2, 3, 7, 12, 13)}),
    _bus("outage_100ms", "nack", ("nack",), (0.1, 0.1), motion="swing", after_deg=0.5),
)  # fmt: skip


# allowed above bar_s where a stuck bus is waited for 20 ms, firmware.board's time-out: the classic
# ESP32's block stops at 13, and with 1.29 the driver counts in steps of 10 and needs two errors
WAITS_S = 0.02

# of an MPU6050 only: no other part fits a MinIMU-9's place, and it has no such FIFO
ITS_OWN = ("another_part", "fifo_overflow", "fifo_misaligned")
# what happens in a chip, and so in each of a sensor's
_IN_CHIPS = ("brown_out", "unplugged", "stuck_data", "saturation", "clock_off")


def bus_faults(kind, at_s, for_s, number, addresses=(None,)):
    """The kind's fault objects for one injection; a tuple parameter takes turns. addresses: of the
    sensor's chips."""
    made = []
    for name, parameters in kind.faults:
        chosen = {
            key: value[number % len(value)] if isinstance(value, tuple) else value
            for key, value in parameters.items()
        }
        chosen.update(at_s=at_s, for_s=for_s, seed=number)
        if name in _IN_CHIPS:
            made += [make(name, address=address, **chosen) for address in addresses]
        else:
            made.append(make(name, **chosen))
    return made

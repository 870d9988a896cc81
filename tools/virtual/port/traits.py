# SPDX-License-Identifier: MIT
"""What differs between the ports (ports/rp2, ports/esp32), chips and MicroPython's versions."""

from typing import NamedTuple


class Traits(NamedTuple):
    """One port and chip. Times in nanoseconds, errors as errno, pins as (sda, scl)."""

    platform: str
    machine: str
    cpu_hz: int
    pin_count: int
    i2c_pins: tuple  # default (sda, scl) of each hardware bus
    i2c_timeout_us: int
    i2c_overhead_ns: int  # software time of one transfer, beside the bits on the wire
    enodev: int  # address not acknowledged
    etimedout: int
    block_bases: tuple  # addresses of the I2C blocks, for viper and mem32
    timer_base: int
    timer_ids: tuple
    reset_causes: dict
    pin_constants: dict
    pin_names: dict
    wdt_max_ms: int
    native: int  # code of the processor's native .mpy (py/persistentcode.h)
    build: str
    console: str = "rp2"  # see console.py
    i2c_longest_us: int = 1 << 30  # of a time-out that the I2C block can be set to
    i2c_deaf_before: tuple = (0, 0)  # older versions do not set it
    wake_registers: int = 0  # address of DORMANT_WAKE_INTE0
    wake_by: str = ""  # ESP32: "ext0" or "ext1", whichever esp32 has,
    wake_pins: tuple = ()  # and the pins that the RTC reaches

    def machine_text(self, version):
        """What sys.implementation._machine says: ESP-IDF's name of the chip from 1.29 on."""
        board, _, chip = self.machine.rpartition(" with ")
        if version >= (1, 29) and chip[:5] == "ESP32" and len(chip) == 7:
            chip = "ESP32-" + chip[5:]
        return "%s with %s" % (board, chip)


EIO = 5
_ARMV6M, _ARMV7EMSP, _XTENSAWIN, RV32IMC = 4, 7, 10, 11
_RP2_PIN = {
    "IN": 0, "OUT": 1, "OPEN_DRAIN": 2, "ALT": 3, "PULL_UP": 1, "PULL_DOWN": 2,
    "IRQ_FALLING": 4, "IRQ_RISING": 8, "ALT_I2C": 3, "ALT_PWM": 4, "ALT_SIO": 5,
}  # fmt: skip
_ESP32_PIN = {
    "IN": 1, "OUT": 3, "OPEN_DRAIN": 7, "PULL_DOWN": 1, "PULL_UP": 2,
    "IRQ_RISING": 1, "IRQ_FALLING": 2, "WAKE_LOW": 4, "WAKE_HIGH": 5,
    "DRIVE_0": 0, "DRIVE_1": 1, "DRIVE_2": 2, "DRIVE_3": 3,
}  # fmt: skip
_RP2_CAUSES = {"PWRON_RESET": 1, "WDT_RESET": 3}
_ESP32_CAUSES = {
    "PWRON_RESET": 1, "HARD_RESET": 2, "WDT_RESET": 3, "DEEPSLEEP_RESET": 4, "SOFT_RESET": 5,
}  # fmt: skip


def _rp2(
    machine, cpu_hz, pin_count, blocks, timer, native=_ARMV6M, build="RPI_PICO", wake=0x40014160
):
    names = {"GP%d" % n: n for n in range(pin_count)}
    names.update({"GPIO%d" % n: n for n in range(pin_count)}, LED=25)
    return Traits(
        "rp2", machine, cpu_hz, pin_count, ((4, 5), (6, 7)), 50_000, 29_000, EIO, 110,
        blocks, timer, (-1,), _RP2_CAUSES, _RP2_PIN, names, 8388, native, build,
        wake_registers=wake,
    )  # fmt: skip


def _esp32(
    machine, cpu_hz, pin_count, timer_count, pins=((19, 18), (26, 25)), native=_XTENSAWIN,
    build="ESP32_GENERIC", console="uart", longest_us=1 << 30, deaf_before=(0, 0),
    wake_by="ext0", wake_pins=tuple(range(22)),
):  # fmt: skip
    return Traits(
        "esp32", machine, cpu_hz, pin_count, pins, 50_000, 60_000, 19, 116,
        (), None, tuple(range(timer_count)), _ESP32_CAUSES, _ESP32_PIN, {}, 1 << 31, native, build,
        console, longest_us, deaf_before, wake_by=wake_by, wake_pins=wake_pins,
    )  # fmt: skip


MACHINES = {
    "RP2040": _rp2(
        "Raspberry Pi Pico with RP2040", 125_000_000, 30, (0x40044000, 0x40048000), 0x40054000
    ),
    "RP2040W": _rp2(
        "Raspberry Pi Pico W with RP2040", 125_000_000, 30, (0x40044000, 0x40048000), 0x40054000,
        build="RPI_PICO_W",
    ),
    "RP2350": _rp2(
        "Raspberry Pi Pico2 with RP2350", 150_000_000, 30, (0x40090000, 0x40098000), 0x400B0000,
        _ARMV7EMSP, "RPI_PICO2", 0x400282D8,
    ),
    # the classic chip's time-out is 20 bits of 80 MHz
    "ESP32": _esp32(
        "Generic ESP32 module with ESP32", 160_000_000, 40, 4, longest_us=13_107,
        wake_pins=(0, 2, 4, 12, 13, 14, 15, 25, 26, 27, *range(32, 40)),
    ),
    "ESP32S2": _esp32(
        "Generic ESP32S2 module with ESP32S2", 160_000_000, 47, 4, ((19, 18), (8, 9)),
        build="ESP32_GENERIC_S2", console="cdc",
    ),
    "ESP32S3": _esp32(
        "Generic ESP32S3 module with ESP32S3", 160_000_000, 49, 4, ((19, 18), (8, 9)),
        build="ESP32_GENERIC_S3", console="cdc", deaf_before=(1, 27),
    ),
    "ESP32C3": _esp32(
        "ESP32C3 module with ESP32C3", 160_000_000, 22, 2, ((19, 18),), RV32IMC,
        "ESP32_GENERIC_C3", "jtag", deaf_before=(1, 27), wake_by="", wake_pins=(),
    ),
    "ESP32C6": _esp32(
        "ESP32C6 module with ESP32C6", 160_000_000, 31, 2, ((7, 6),), RV32IMC,
        "ESP32_GENERIC_C6", "jtag", deaf_before=(1, 27), wake_by="ext1",
        wake_pins=tuple(range(8)),
    ),
}  # fmt: skip
DEFAULT = {"rp2": "RP2040", "esp32": "ESP32"}


def find(platform, machine=None):
    """Return the Traits of a port, or of a chip named like the keys of MACHINES."""
    if platform not in DEFAULT:
        raise ValueError("no port %r: 'rp2' or 'esp32'" % (platform,))
    key = machine or DEFAULT[platform]
    if key not in MACHINES or MACHINES[key].platform != platform:
        fitting = [name for name, traits in MACHINES.items() if traits.platform == platform]
        raise ValueError("no %s machine %r: %s" % (platform, key, ", ".join(fitting)))
    return MACHINES[key]

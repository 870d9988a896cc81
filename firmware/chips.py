# SPDX-License-Identifier: MIT
"""Which chip this is, what each can do, and which pins a board has for us by default: data.

The exact chip decides, the word after "with" in what sys.implementation._machine says; boards
with something else on those pins are in firmware.pinouts. Pin numbers are GPIO numbers. Loaded
when somebody asks, and forgotten. Sources: data sheets of RP2040, RP2350, ESP32, -S2, -S3, -C3,
-C6; MicroPython's ports/*/boards.
"""

from firmware.row import Row

_PICO = {"sda": 4, "scl": 5, "int_pin": 6, "outputs": (16, 17, 18, 19), "timers": (-1,)}
_RADIO = (23, 24, 25, 29)  # of a Pico W

ROWS = (
    Row("Pico", "rp2", chip="RP2040", pins=30, **_PICO),
    Row("Pico W", "rp2", chip="RP2040", pins=30, gone=_RADIO, **_PICO),
    Row("Pico 2", "rp2", chip="RP2350", pins=48, **_PICO),
    Row("Pico 2 W", "rp2", chip="RP2350", pins=30, gone=_RADIO, **_PICO),
    Row(
        "ESP32", "esp32", chip="ESP32", sda=21, scl=22, int_pin=19, outputs=(25, 26, 27, 14),
        timers=(0, 1, 2, 3), pins=40, gone=(1, 3, 6, 7, 8, 9, 10, 11, 24, 28, 29, 30, 31),
        inputs=(34, 35, 36, 37, 38, 39), straps={0: 1, 12: 0},
    ),
    Row(
        "ESP32-S2", "esp32", chip="ESP32S2", sda=8, scl=9, int_pin=10, outputs=(4, 5, 6, 7),
        timers=(0, 1, 2, 3), pins=47, inputs=(46,), straps={0: 1, 45: 0, 46: 0},
        gone=(19, 20, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32),
    ),
    Row(
        "ESP32-S3", "esp32", chip="ESP32S3", sda=8, scl=9, int_pin=10, outputs=(4, 5, 6, 7),
        timers=(0, 1, 2, 3), pins=49, straps={0: 1, 45: 0, 46: 0}, deaf_before=(1, 27),
        gone=(19, 20, 22, 23, 24, 25, 26, 27, 28, 29, 30, 31, 32),
    ),
    Row(
        "ESP32-C3", "esp32", chip="ESP32C3", sda=6, scl=7, int_pin=10, outputs=(0, 1, 3, 4),
        buses=1, pins=22, straps={2: 1, 8: 1, 9: 1}, least=(1, 24), deaf_before=(1, 27),
        gone=(11, 12, 13, 14, 15, 16, 17, 18, 19),
    ),
    Row(
        "ESP32-C6", "esp32", chip="ESP32C6", sda=6, scl=7, int_pin=3, outputs=(18, 19, 20, 21),
        buses=1, pins=31, straps={8: 1, 9: 1}, least=(1, 24), deaf_before=(1, 27),
        gone=(12, 13, 24, 25, 26, 27, 28, 29, 30),
    ),
)  # fmt: skip

# MicroPython's name of a board: the row's
_NAMES = {
    "Raspberry Pi Pico": "Pico",
    "Raspberry Pi Pico W": "Pico W",
    "Raspberry Pi Pico2": "Pico 2",
    "Raspberry Pi Pico 2": "Pico 2",
    "Raspberry Pi Pico 2 W": "Pico 2 W",
}
_CLASSIC = ("PICO", "D0", "D2", "U4", "S0", "WROOM", "WROVER", "SOLO", "MINI")


def chip_of(machine):
    """(board's name, chip as in ROWS) of sys.implementation._machine; chip None: unknown."""
    board, found, chip = machine.rpartition(" with ")
    if not found:
        return machine, None
    chip = chip.replace("-", "").upper()
    if chip[:6] in ("RP2040", "RP2350"):
        return board, chip[:6]
    rest = chip[5:]
    if chip[:5] != "ESP32":
        return board, None
    if rest[:2] in ("S2", "S3", "C3", "C6") and not rest[2:3].isdigit():
        return board, chip[:7]
    for word in _CLASSIC:
        if rest.startswith(word):
            rest = ""
    return board, None if rest else "ESP32"


def find(platform, machine):
    """The Row of a board; its pins are None where nobody knows them."""
    board, chip = chip_of(machine)
    rows = [row for row in ROWS if (row.platform, row.chip) == (platform, chip)]
    if not rows:
        return Row(machine, platform, timers=(-1,) if platform == "rp2" else (0, 1))
    for row in rows:
        if row.name == _NAMES.get(board):
            return row
    if board.startswith("Generic "):
        return rows[0]
    from firmware.pinouts import pins_of

    other = pins_of(board)
    return rows[0].but(board, **other) if other else rows[0]

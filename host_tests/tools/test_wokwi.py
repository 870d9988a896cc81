# SPDX-License-Identifier: MIT
"""The projects for Wokwi are wired as the firmware expects, with the pins that Wokwi documents."""

import json
import tomllib
from fnmatch import fnmatch
from pathlib import Path

import pytest

from tools.virtual.port import Port

ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "wokwi"

# Wokwi's documentation: pages wokwi-pi-pico and wokwi-mpu6050; wokwi-boards, esp32-devkit-c-v4
PINS = {
    "wokwi-pi-pico": {f"GP{n}" for n in (*range(23), 26, 27, 28)}
    | {f"GND.{n}" for n in range(1, 9)}
    | {"VSYS", "VBUS", "3V3"},
    "board-esp32-devkit-c-v4": {str(n) for n in (0, 2, 4, 5, *range(12, 20), 21, 22, 23, 25, 26,
                                                 27, 32, 33, 34, 35)}
    | {"GND.1", "GND.2", "GND.3", "3V3", "5V", "EN", "VP", "VN", "TX", "RX"},
    "wokwi-mpu6050": {"VCC", "GND", "SCL", "SDA", "XDA", "XCL", "AD0", "INT"},
    "$serialMonitor": {"TX", "RX"},
}  # fmt: skip
NOT_SIMULATED = {"XDA", "XCL", "INT"}
PROJECTS = [
    ("pico", "Pico", "wokwi-pi-pico", "GP%d", (".hex", ".uf2")),
    ("esp32", "ESP32", "board-esp32-devkit-c-v4", "%d", (".bin", ".uf2", ".elf")),
]
projects = pytest.mark.parametrize("folder, row, board, pin, takes", PROJECTS)


def wires(diagram):
    """{(part, pin): {(part, pin), ...}}, both ways."""
    found = {}
    for source, target, *_ in diagram["connections"]:
        ends = [tuple(end.split(":")) for end in (source, target)]
        for one, other in (ends, ends[::-1]):
            found.setdefault(one, set()).add(other)
    return found


@projects
def test_the_sensor_is_wired_as_the_firmwares_row_says(folder, row, board, pin, takes):
    with Port("rp2"):
        from firmware.chips import ROWS
        from firmware.config import KNOBS
    (expected,) = [known for known in ROWS if known.name == row]
    diagram = json.loads((FOLDER / folder / "diagram.json").read_text())
    parts = {part["id"]: part["type"] for part in diagram["parts"]}
    assert len(parts) == len(diagram["parts"]) == 2
    (mcu,) = [part for part, kind in parts.items() if kind == board]
    (imu,) = [part for part, kind in parts.items() if kind == "wokwi-mpu6050"]
    found = wires(diagram)
    assert found[imu, "SDA"] == {(mcu, pin % expected.sda)}
    assert found[imu, "SCL"] == {(mcu, pin % expected.scl)}
    assert found[imu, "VCC"] == {(mcu, "3V3")}
    ((at, ground),) = found[imu, "GND"]
    assert at == mcu and ground.startswith("GND.")
    assert {name for part, name in found if part == imu} == {"SDA", "SCL", "VCC", "GND"}
    # AD0 is open: the address is the knob's default
    assert {knob.name: knob.default for knob in KNOBS}["address"] == 0x68


@projects
def test_every_wire_ends_at_a_pin_that_is_simulated(folder, row, board, pin, takes):
    diagram = json.loads((FOLDER / folder / "diagram.json").read_text())
    kinds = {part["id"]: part["type"] for part in diagram["parts"]}
    kinds["$serialMonitor"] = "$serialMonitor"
    for part, name in wires(diagram):
        assert name in PINS[kinds[part]] - NOT_SIMULATED, (part, name)
    assert diagram["version"] == 1 and diagram["editor"] == "wokwi"


def test_the_esp32_talks_to_the_serial_monitor_crosswise():
    found = wires(json.loads((FOLDER / "esp32" / "diagram.json").read_text()))
    assert found["$serialMonitor", "RX"] == {("esp", "TX")}
    assert found["$serialMonitor", "TX"] == {("esp", "RX")}


@projects
def test_the_page_says_where_the_image_goes(folder, row, board, pin, takes):
    config = tomllib.loads((FOLDER / folder / "wokwi.toml").read_text())["wokwi"]
    image = config["firmware"]
    assert config["version"] == 1 and Path(image).suffix in takes
    page = (ROOT / "docs" / "site" / "virtual.md").read_text()
    assert f"docs/wokwi/{folder}/{image}" in page
    assert f"rfc2217://localhost:{config['rfc2217ServerPort']}" in page
    ignored = (ROOT / ".gitignore").read_text().split()
    assert any(fnmatch(f"docs/wokwi/{folder}/{image}", pattern) for pattern in ignored)

# SPDX-License-Identifier: MIT
"""What the README says of wiring, commands and files is what the project has."""

import re
from pathlib import Path

import pytest

from tools import figures
from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.motion import Still
from tools.virtual.port import Port

ROOT = Path(__file__).resolve().parents[2]
README = (ROOT / "README.md").read_text()


def wiring():
    """{board: {signal: GPIO number}} of the README's table."""
    rows = [re.split(r"\s*\|\s*", line.strip("| \n")) for line in README.splitlines()
            if line.startswith("| ")]  # fmt: skip
    head = next(row for row in rows if row[0].startswith("MPU6050"))
    boards = {name: {} for column in head[1:] for name in column.split(", ")}
    for row in rows:
        for column, cell in zip(head[1:], row[1:]):
            pin = re.match(r"(?:GP|GPIO )(\d+)", cell)
            if pin and row[0][:3] in ("SDA", "SCL", "INT"):
                for name in column.split(", "):
                    boards[name][row[0][:3]] = int(pin[1])
    return boards


def test_the_wiring_table_is_the_one_of_the_firmware():
    with Port("rp2"):
        from firmware.chips import ROWS
    rows = {row.name: {"SDA": row.sda, "SCL": row.scl, "INT": row.int_pin} for row in ROWS}
    assert wiring() == rows


def test_the_message_for_swapped_wires_is_the_one_shown(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Port("rp2", buses={0: Bus(MPU6050Chip())}, wiring={0: (5, 4)}):
        from firmware.app import App

        with pytest.raises(OSError, match="Seen") as caught:
            App().start()
    shown = README.split("    OSError: ", 1)[1].split("\n\n", 1)[0]
    first, second = (line.strip() for line in shown.splitlines())
    said = str(caught.value).splitlines()
    assert said[0].startswith(first.removesuffix("...").strip())
    assert second in said


def test_every_file_and_folder_named_exists():
    for name in re.findall(r"`((?:lib|firmware|host_tests|tools)/[\w/]*|\w+\.py)`", README):
        assert (ROOT / name).exists(), name
    for name in re.findall(r"\]\((?!http)([^)]+)\)", README):
        assert (ROOT / name).exists(), name


def test_the_other_counters_exist(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "site" / "faults.md").read_text()
    rows = page.split("| other counters |", 1)[1].split("\n\n", 1)[0].splitlines()[2:]
    names = {name for row in rows for name in re.findall(r"`(\w+)`", row.split("|")[1])}
    with Port("rp2", {0: Bus(MPU6050Chip(Still(90.0), accel_bias_g=(0.0, 7.5, 0.0)))}) as port:
        from mpu6050.fifo import Fifo

        from firmware.app import App

        app = App()
        app.start()
        port.run_ms(100)
        counters = {**app.stats(), **Fifo(app.imu).__dict__}
    assert names == {"lost", "edges_missing", "tick_wraps", "accel_saturated", "output_errors",
                     "errors", "overflows", "misaligned"}  # fmt: skip
    assert names <= set(counters)


def test_a_section_is_replaced_and_a_missing_one_refused():
    text = "a\n<!-- bench -->\nold\n<!-- end bench -->\nb"
    assert figures.put(text, "bench", "new") == "a\n<!-- bench -->\nnew\n<!-- end bench -->\nb"
    with pytest.raises(ValueError, match="faults"):
        figures.put(text, "faults", "new")

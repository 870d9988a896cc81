# SPDX-License-Identifier: MIT
"""What a user runs once on a real board: on virtual ones, good and bad."""

import pytest

from tools import board_check
from tools.virtual import Bus, MPU6050Chip, Port
from tools.virtual.faults import make
from tools.virtual.motion import Sinusoid, Still


def checked(root, capfd, platform="rp2", motion=None, faults=(), machine=None, wiring=None,
            version=(1, 27, 0), knobs="", **chip):  # fmt: skip
    """(report, whether all is well) on a virtual board."""
    if knobs:
        (root / "config.txt").write_text(knobs)
    chip = MPU6050Chip(motion or Still(), seed=3, **chip)
    port = Port(
        platform, {0: Bus(chip, faults=faults)}, machine_name=machine, version=version,
        wiring=wiring, root=root,
    )  # fmt: skip
    with port:
        capfd.readouterr()
        port.run_file(board_check.SCRIPT)
        printed = capfd.readouterr().out
    return board_check.report(printed, "2026-01-02")


@pytest.mark.parametrize("platform, machine", [
    ("rp2", "RP2040"), ("rp2", "RP2350"), ("esp32", "ESP32"), ("esp32", "ESP32S3"),
])  # fmt: skip
def test_a_good_board_has_nothing_to_complain_of(tmp_path, capfd, platform, machine):
    text, good = checked(tmp_path, capfd, platform, machine=machine,
                         gyro_bias_dps=(1.0, -2.0, 0.5))  # fmt: skip
    assert good, text
    lines = dict(line.split(": ", 1) for line in text.splitlines() if ": " in line)
    assert text.startswith("```\nPlumb board check, 2026-01-02")
    assert machine in lines["board"] and "1.27" in lines["micropython"]
    assert "WHO_AM_I 0x68, MPU6050 at 0x68" in lines["sensor"]
    assert lines["found on the bus"] == "0x68"
    assert lines["gyro bias"].startswith("1.0") and "0 of 500 failed" in lines["burst"]
    assert lines["self-test"].startswith("passed")
    for load in ("idle", "busy"):
        assert " 0 lost" in lines["loop " + load]
        assert ("(hard)" if platform == "rp2" else "(soft)") in lines["loop " + load]
    assert float(lines["noise gx"].split()[0]) == pytest.approx(0.033, abs=0.02)
    assert float(lines["noise az"].split()[0]) == pytest.approx(0.003, abs=0.002)
    assert lines["noise az"].endswith("about 0.998") or "about 1.0" in lines["noise az"]


def test_what_is_wrong_is_said(tmp_path, capfd):
    text, good = checked(tmp_path, capfd, faults=[make("nack", at_s=0.0, p=0.03, seed=2)])
    assert not good and "! transfers fail" in text
    text, good = checked(tmp_path, capfd, wiring={0: (5, 4)})
    assert not good and "SDA and SCL are swapped" in text and "found on the bus: nothing" in text
    text, good = checked(tmp_path, capfd, motion=Sinusoid(20.0, 1.0, "roll"))
    assert not good and "was not at rest" in text and "it moved" in text
    text, good = checked(tmp_path, capfd, self_test_error=0.3)
    assert not good and "NOT passed" in text
    text, good = checked(tmp_path, capfd, "esp32", machine="ESP32C3", version=(1, 26, 0))
    assert not good and "bit-banged" in text


def test_a_check_that_breaks_off_is_no_good_report():
    text, good = board_check.report("board: Pico\nTraceback (most recent call last):\nImportError")
    assert not good and "broke off" in text and "make deploy" in text
    text, good = board_check.report("board: Pico\nend of the check\n", "2026-01-02")
    assert good and text.splitlines()[-2] == "nothing to complain of"


def test_a_port_that_is_none_ends_in_words(capsys):
    assert board_check.main(["--port", "/dev/there_is_none"]) == 1
    assert "/dev/there_is_none" in capsys.readouterr().err

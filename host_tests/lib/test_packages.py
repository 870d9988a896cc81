# SPDX-License-Identifier: MIT
"""What `mpremote mip install` would fetch is what there is."""

import json
from pathlib import Path

import pytest

LIB = Path(__file__).resolve().parents[2] / "lib"


@pytest.mark.parametrize("package", ("mpu6050", "minimu9", "calibration", "attitude", "control"))
def test_package_json_lists_every_file(package):
    """What `mpremote mip install` would fetch is what there is (`python -m tools.packages`)."""
    listed = json.loads((LIB / package / "package.json").read_text())["urls"]
    files = sorted(p.relative_to(LIB / package).as_posix() for p in (LIB / package).rglob("*.py"))
    assert [source for _, source in listed] == files
    assert [target for target, _ in listed] == [f"{package}/{name}" for name in files]

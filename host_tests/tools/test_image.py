# SPDX-License-Identifier: MIT
"""What an image freezes and how it says no; the images themselves run in board/test_image.py."""

import sys

import pytest

from tools.image import __main__ as command
from tools.image.build import Sources, _board_dir, flash_bytes
from tools.image.frozen import frozen_files, packages, write_manifest
from tools.virtual.images import FirmwareError
from tools.virtual.rp2040.flash import ROOT


def test_the_whole_app_is_frozen_and_what_it_imports_and_nothing_of_the_users():
    names = set(frozen_files())
    walked = {p.relative_to(ROOT).as_posix() for p in (ROOT / "firmware").rglob("*.py")}
    own = {n for n in walked if not n.startswith("firmware/image/")}
    assert own - names == {"firmware/names.py"}  # frozen names are heard already
    assert {"mpu6050/__init__.py", "attitude/fixed/__init__.py", "plumb_image.py"} <= names
    assert not {"main.py", "boot.py"} & names  # frozen ones would go before the user's
    assert frozen_files()["plumb_main.py"] == ROOT / "main.py"


def test_packages_are_followed_through_what_they_import(tmp_path, monkeypatch):
    texts = {"a": "def f():\n    from b.c import d\n", "b": "", "e": "import a\n"}
    for name, text in texts.items():
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(text)
    monkeypatch.setattr("tools.image.frozen.LIB", tmp_path)
    (tmp_path / "main.py").write_text("import time, a.x\n")
    assert packages([tmp_path / "main.py"]) == {"a", "b"}


@pytest.fixture
def tree(tmp_path):
    """As little of a checkout of MicroPython as a manifest asks for."""
    texts = {
        "ports/rp2/CMakeLists.txt": "",
        "ports/rp2/modules/_boot.py": "import vfs\nvfs.mount(1)\n",
        "ports/rp2/modules/rp2.py": "",
        "ports/rp2/boards/manifest.py": 'freeze("$(PORT_DIR)/modules")\nrequire("dht")\n',
        "ports/rp2/boards/A/mpconfigboard.cmake": "",
        "ports/rp2/boards/A/mpconfigboard.h": "",
        "ports/rp2/boards/RPI_PICO_W/mpconfigboard.cmake": "set(MICROPY_PY_LWIP ON)\n",
        "ports/rp2/boards/RPI_PICO_W/pins.csv": "GP4,GPIO4\nLED,EXT_GPIO0\n",
        "ports/rp2/boards/RPI_PICO_W/manifest.py": (
            'include("$(PORT_DIR)/boards/manifest.py")\nrequire("bundle-networking")\n'
        ),
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


def manifest(tree, board, ours=True):
    path = write_manifest(tree / "out", tree, "rp2", tree / "ports/rp2/boards" / board, ours)
    return path.read_text().splitlines()


def test_our_start_is_put_behind_the_ports_own(tree):
    lines = manifest(tree, "A")
    assert lines[0] == "freeze(\"$(PORT_DIR)/modules\", ('rp2.py',))"  # its _boot.py is not
    assert (tree / "out/_boot.py").read_text().startswith("import vfs\nvfs.mount(1)\n")
    assert "import plumb_image" in (tree / "out/_boot.py").read_text()
    assert (tree / "out/plumb_main.py").read_bytes() == (ROOT / "main.py").read_bytes()
    assert f"freeze('{ROOT}', ('firmware/app.py',), opt=3)" in lines
    assert f"freeze('{ROOT}/lib', ('mpu6050/ranges.py',), opt=3)" in lines


def test_the_boards_own_manifest_is_followed_where_its_parts_are_there(tree):
    assert not [line for line in manifest(tree, "RPI_PICO_W") if "require" in line]
    (tree / "lib/micropython-lib/micropython").mkdir(parents=True)
    lines = manifest(tree, "RPI_PICO_W")
    assert lines.count('require("dht")') == lines.count('require("bundle-networking")') == 1
    assert not [line for line in lines if line == 'freeze("$(PORT_DIR)/modules")']
    plain = manifest(tree, "RPI_PICO_W", ours=False)
    assert plain[0] == "freeze(\"$(PORT_DIR)/modules\", ('_boot.py', 'rp2.py'))"
    assert not [line for line in plain if "firmware" in line]


def test_a_pico_w_keeps_its_flash_where_the_radios_driver_is_missing(tree, tmp_path):
    sources = Sources("1.26.1", tree)
    made = _board_dir(tmp_path / "made", "RPI_PICO_W", sources)
    assert made.name.endswith("RPI_PICO_W")
    # of the official image: 848 KiB of files, at the same place (its mpconfigboard.h)
    assert "(848 * 1024)" in (made / "mpconfigboard.h").read_text()
    assert "LWIP" not in (made / "mpconfigboard.cmake").read_text()
    assert (made / "pins.csv").read_text() == "GP4,GPIO4\n"
    for name in ("cyw43-driver", "lwip", "btstack"):
        (tree / "lib" / name).mkdir(parents=True)
        (tree / "lib" / name / "some.c").touch()
    assert _board_dir(tmp_path, "RPI_PICO_W", sources) == tree / "ports/rp2/boards/RPI_PICO_W"


def test_an_unknown_board_and_no_checkout_end_in_words(tree, tmp_path, monkeypatch, capsys):
    with pytest.raises(FirmwareError, match=r"knows no board B; it has A"):
        _board_dir(tmp_path, "B", Sources("1.26.1", tree))
    monkeypatch.setattr(sys, "argv", ["image", "--source", str(tmp_path / "nowhere")])
    assert command.main() == 1
    assert "no checkout of MicroPython" in capsys.readouterr().err


def test_the_manifest_of_another_port_is_written(tree, monkeypatch, capsys):
    (tree / "ports/rp2").rename(tree / "ports/esp32")
    (tree / "ports/rp2").mkdir()
    (tree / "ports/rp2/CMakeLists.txt").touch()
    words = f"image --manifest {tree}/m --port esp32 --board A --source {tree}"
    monkeypatch.setattr(sys, "argv", words.split())
    assert command.main() == 0
    assert capsys.readouterr().out == f"{tree}/m/manifest.py\n"
    assert (tree / "m" / "_boot.py").exists()


def test_bytes_on_the_flash_are_those_that_the_blocks_carry(tmp_path):
    path = tmp_path / "two.uf2"
    path.write_bytes(b"".join(bytes(16) + n.to_bytes(4, "little") + bytes(492) for n in (256, 9)))
    assert flash_bytes(path) == 265

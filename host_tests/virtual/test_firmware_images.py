# SPDX-License-Identifier: MIT
"""The MicroPython images: each runs, and where they come from when they are not there."""

import platform
import subprocess

import pytest

from tools.virtual import images
from tools.virtual.images.packages import find_mirror
from tools.virtual.rp2040.flash import cross_compile

VIPER = """
import micropython
@micropython.viper
def scaled(a: int, b: int) -> int:
    return (a * b) >> 3
print(scaled(-70_000, 30_000), scaled(70_000, 70_000))
"""


# 70000 squared is 4.9e9: 605 032 704 is left of it in 32 bits.
IN_32_BITS = f"{-70_000 * 30_000 >> 3} {605_032_704 >> 3}\n"
IN_64_BITS = f"{-70_000 * 30_000 >> 3} {70_000 * 70_000 >> 3}\n"


def unix(script):
    command = [images.unix_micropython(), "-c", script]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def test_the_unix_port_runs_a_line():
    assert unix("import sys; print(sys.implementation.name)") == "micropython\n"


def test_the_unix_port_runs_viper_in_32_bits_where_the_machine_can():
    assert unix(VIPER) == (IN_32_BITS if platform.machine() == "x86_64" else IN_64_BITS)


def test_the_riscv_port_runs_viper_in_32_bits():
    assert images.run_rv32({}, VIPER) == IN_32_BITS


def test_the_riscv_port_imports_files_text_compiled_and_in_folders():
    source = b"import micropython\n@micropython.viper\ndef f(x: int) -> int:\n    return x << 1\n"
    files = {
        "pack/__init__.py": "from pack.deep import X\n",
        "pack/deep.py": "X = 21\n",
        "fast.mpy": cross_compile(source, "fast.py", "rv32imc"),
    }
    assert images.run_rv32(files, "import pack, fast; print(fast.f(pack.X))") == "42\n"


def test_the_riscv_port_hands_on_an_exception():
    with pytest.raises(RuntimeError, match="ZeroDivisionError"):
        images.run_rv32({}, "1 // 0")


def test_a_script_without_end_is_stopped():
    with pytest.raises(images.FirmwareError, match="no end within"):
        images.run_rv32({}, "while True: pass", timeout_s=2)


def test_the_rp2040_image_is_a_uf2_for_its_flash():
    """Magic numbers and the RP2040's family id, from the UF2 specification and Raspberry Pi."""
    data = images.rp2040_image().read_bytes()
    assert data[:4] == b"UF2\n"
    assert data[28:32] == (0xE48BFF56).to_bytes(4, "little")
    assert data[12:16] == (0x10000000).to_bytes(4, "little")


def test_an_image_named_by_the_environment_comes_first(monkeypatch, tmp_path):
    mine = tmp_path / "mine.uf2"
    mine.write_bytes(b"UF2\n\x57\x51\x5d\x9e" + bytes(504))
    monkeypatch.setenv("PLUMB_FIRMWARE", str(mine))
    assert images.rp2040_image() == mine
    mine.write_bytes(b"<html>not found</html>")
    with pytest.raises(images.FirmwareError, match="not a UF2"):
        images.rp2040_image()


def test_without_image_and_internet_it_is_built(monkeypatch, tmp_path):
    monkeypatch.setenv("PLUMB_CACHE", str(tmp_path))
    monkeypatch.delenv("PLUMB_FIRMWARE", raising=False)
    monkeypatch.setattr(images, "OFFICIAL", "http://127.0.0.1:9/none.uf2")
    built = []
    monkeypatch.setattr(images.recipes, "build_rp2", lambda name: built.append(name))
    assert images.rp2040_image() == tmp_path / built[0]


def test_a_download_that_is_no_uf2_is_not_kept(monkeypatch, tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<html>please log in</html>")
    monkeypatch.setenv("PLUMB_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("PLUMB_FIRMWARE", raising=False)
    monkeypatch.setattr(images, "OFFICIAL", page.as_uri())
    built = []
    monkeypatch.setattr(images.recipes, "build_rp2", lambda name: built.append(name))
    images.rp2040_image()
    assert built
    assert not list((tmp_path / "cache").glob("*.uf2"))


@pytest.mark.parametrize(
    ("name", "text"),
    [
        (
            "sources.list.d/debian.sources",
            "Types: deb\nURIs: http://vendor.example/packages\nSuites: x\n\n# comment\n"
            "Types: deb\nURIs: http://mirror.example/debian\nSuites: bookworm\n"
            "Signed-By: /keys/a.gpg\n\n"
            "Types: deb\nURIs: http://mirror.example/debian-security\nSuites: s\n",
        ),
        (
            "sources.list",
            "# deb http://old.example/debian sid main\n"
            "deb http://mirror.example/debian-security bookworm-security main\n"
            "deb [arch=amd64 signed-by=/keys/a.gpg] http://mirror.example/debian bookworm main\n",
        ),
    ],
)
def test_the_mirror_is_the_one_that_the_machine_uses(tmp_path, name, text):
    path = tmp_path / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    assert find_mirror(tmp_path) == ("http://mirror.example/debian", "/keys/a.gpg")


def test_without_a_mirror_the_error_says_what_to_do(tmp_path):
    with pytest.raises(images.FirmwareError, match="PLUMB_FIRMWARE"):
        find_mirror(tmp_path)

# SPDX-License-Identifier: MIT
"""The MicroPython images: each runs, and where they come from when they are not there."""

import platform
import subprocess
import sys

import pytest

from tools.virtual import images
from tools.virtual.images import packages
from tools.virtual.images.packages import find_mirror
from tools.virtual.images.releases import Release, find
from tools.virtual.rp2040 import build
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


@pytest.mark.parametrize("version", images.VERSIONS)
def test_the_rp2040_image_is_a_uf2_for_its_flash(version):
    """Magic numbers and the RP2040's family id, from the UF2 specification and Raspberry Pi."""
    path = images.rp2040_image(version)
    data = path.read_bytes()
    assert data[:4] == b"UF2\n"
    assert data[28:32] == (0xE48BFF56).to_bytes(4, "little")
    assert data[12:16] == (0x10000000).to_bytes(4, "little")


def test_each_image_is_of_the_release_that_was_asked_for(monkeypatch):
    monkeypatch.delenv("PLUMB_FIRMWARE", raising=False)
    found = [images.image_version(images.rp2040_image(v)) for v in ("1.25.0", "1.26.1")]
    assert found == [(1, 25, 0), (1, 26, 1)]
    with pytest.raises(images.FirmwareError, match=r"no MicroPython 1\.24\.0.*1\.25\.0"):
        images.rp2040_image("1.24.0")


def test_the_banner_is_found_across_two_blocks_of_a_uf2(tmp_path):
    def block(payload):
        head = b"UF2\n\x57\x51\x5d\x9e" + bytes(8) + len(payload).to_bytes(4, "little")
        return head.ljust(32, b"\0") + payload.ljust(480, b"\xa5")

    path = tmp_path / "some.uf2"
    path.write_bytes(block(b"x" * 250 + b"MicroP") + block(b"ython v1.30.12 on 2027"))
    assert images.image_version(path) == (1, 30, 12)
    path.write_bytes(block(b"CircuitPython 9"))
    with pytest.raises(images.FirmwareError, match="no banner"):
        images.image_version(path)


def test_an_image_named_by_the_environment_comes_first(monkeypatch, tmp_path):
    mine = tmp_path / "mine.uf2"
    mine.write_bytes(b"UF2\n\x57\x51\x5d\x9e" + bytes(504))
    monkeypatch.setenv("PLUMB_FIRMWARE", str(mine))
    assert images.rp2040_image() == images.rp2040_image("1.26.1") == mine
    mine.write_bytes(b"<html>not found</html>")
    with pytest.raises(images.FirmwareError, match="not a UF2"):
        images.rp2040_image()


@pytest.fixture
def offered(monkeypatch, tmp_path):
    """An empty cache, an address for the official image, and the builds that are asked for."""
    monkeypatch.setenv("PLUMB_CACHE", str(tmp_path / "cache"))
    monkeypatch.delenv("PLUMB_FIRMWARE", raising=False)
    built = []
    monkeypatch.setattr(
        images.recipes, "build_rp2", lambda name, version: built.append((name, version))
    )

    def official(address):
        monkeypatch.setattr(Release, "official", address)
        return built

    return official


@pytest.mark.parametrize("version", images.VERSIONS)
def test_without_image_and_internet_it_is_built(offered, tmp_path, version):
    built = offered("http://127.0.0.1:9/none.uf2")
    path = images.rp2040_image(version)
    assert built == [(path.name, version)]
    assert path == tmp_path / "cache" / f"micropython-{version}-RPI_PICO.uf2"


def test_a_download_that_is_no_uf2_is_not_kept(offered, tmp_path):
    page = tmp_path / "page.html"
    page.write_text("<html>please log in</html>")
    built = offered(page.as_uri())
    images.rp2040_image()
    assert built
    assert not list((tmp_path / "cache").glob("*.uf2"))


def test_where_the_official_images_are():
    """As the download page of the Raspberry Pi Pico names them."""
    site = "https://micropython.org/resources/firmware/"
    assert [find(v).official for v in images.VERSIONS] == [
        site + "RPI_PICO-20250415-v1.25.0.uf2",
        site + "RPI_PICO-20250911-v1.26.1.uf2",
    ]


def test_a_release_that_no_suite_has_any_more_ends_in_words(monkeypatch, tmp_path):
    """Debian's suites move on; apt is played by scripts, so that it needs no mirror."""
    programs = {"apt-get": "exit 0", "apt-cache": "echo 'Version: 1.25.0+ds-1'"}
    for name, line in programs.items():
        (tmp_path / name).write_text(f"#!/bin/sh\n{line}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/bin:/usr/bin")
    monkeypatch.setattr(packages, "find_mirror", lambda etc: ("http://mirror.example/debian", "k"))
    packages.download_sources(tmp_path, find("1.25.0"))
    gone = Release("1.25", "20300101", ("sid",))
    with pytest.raises(images.FirmwareError, match=r"no sources of MicroPython 1\.25 in") as why:
        packages.download_sources(tmp_path, gone)
    assert "1.25.0+ds-1" in str(why.value)  # what is there instead
    assert "PLUMB_FIRMWARE" in str(why.value)


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


def test_an_emulator_built_for_this_python_and_a_wheel_for_all_are_told_apart():
    tag = f".{sys.implementation.cache_tag}-"
    good = {}
    for path, _, new in build.SOURCES:
        good[path] = good.get(path, b"") + new.encode()
        if path.endswith(".pyx"):
            good[path.removesuffix(".pyx") + tag + "x86_64-linux-gnu.so"] = b""
    assert build.fitting(good)
    for path in good:
        if not path.endswith(".so"):
            assert not build.fitting({**good, path: b"as it was"})
        others = {name: data for name, data in good.items() if name != path}
        assert not build.fitting(others)
        assert not build.fitting({**others, path.replace(tag, ".abi3."): b""})
    assert {path for path, *_ in build.SOURCES} <= build.installed().keys()


@pytest.mark.parametrize("text", ["", "pios, pios"])
def test_sources_of_the_emulator_that_are_others_are_refused(tmp_path, text):
    path = tmp_path / "_simulator.pyx"
    path.write_text(text)
    with pytest.raises(ValueError, match=r"_simulator\.pyx .* no one 'pios'"):
        build.change(path, "pios", "pio")
    assert path.read_text() == text

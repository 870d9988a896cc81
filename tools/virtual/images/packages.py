# SPDX-License-Identifier: MIT
"""Debian packages: compilers from the machine's own suite, sources from newer ones.

MicroPython's sources come from the suites that have the release; they are asked through a private
apt folder with the mirror that the machine already uses, so that its own lists stay as they are.
"""

import os
import platform
import re
import shutil
import subprocess
from pathlib import Path

from tools.virtual.images.releases import SDK_SUITE
from tools.virtual.images.workshop import FirmwareError, run, say

KEYRING = "/usr/share/keyrings/debian-archive-keyring.gpg"
IS_X86_64 = platform.machine() == "x86_64"
COMMON = ("gcc", "g++", "libc6-dev", "make", "python3", "xz-utils", "bzip2")
TOOLS = {
    "unix": (*COMMON, "gcc-multilib") if IS_X86_64 else COMMON,
    "rp2": (
        *COMMON,
        "cmake",
        "gcc-arm-none-eabi",
        "libnewlib-arm-none-eabi",
        "libstdc++-arm-none-eabi-newlib",
    ),
    "rv32": (
        *COMMON,
        "gcc-riscv64-unknown-elf",
        "picolibc-riscv64-unknown-elf",
        "qemu-system-misc",
    ),
}


def ensure_tools(target):
    """Install what building `target` needs and is missing; FirmwareError when that cannot be."""
    if shutil.which("apt-get") is None:
        raise FirmwareError(
            "building an image needs Debian or a relative of it; elsewhere, put a MicroPython UF2 "
            "for the Raspberry Pi Pico somewhere and set PLUMB_FIRMWARE to its path"
        )
    missing = [name for name in TOOLS[target] if not _installed(name)]
    if not missing:
        return
    if os.geteuid() != 0:
        raise FirmwareError(f"please run: sudo apt-get install {' '.join(missing)}")
    say(f"installing {', '.join(missing)}")
    run("reading the package lists", "apt-get", "update", "-q")
    run(
        "installing compilers",
        *("apt-get", "install", "-q", "-y", "--no-install-recommends", *missing),
    )


def _installed(name):
    command = ["dpkg-query", "-W", "-f", "${Status}", name]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return "install ok installed" in done.stdout


def download_sources(folder, release):
    """MicroPython and mbedtls sources, pico-sdk and tinyusb packages, as files in `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    options = _private_apt(folder / "apt", release)
    run(f"reading the lists of {' '.join(release.suites)}", "apt-get", *options, "update", "-q")
    run(
        "downloading MicroPython and mbedtls",
        *("apt-get", *options, "source", "-q", "--download-only"),
        *(f"micropython={_source_version(options, release)}", f"mbedtls/{SDK_SUITE}"),
        cwd=folder,
    )
    run(
        "downloading pico-sdk and tinyusb",
        *("apt-get", *options, "download", "-q", "pico-sdk-source", "tinyusb-source"),
        cwd=folder,
    )


def _source_version(options, release):
    """Debian's version of the release's source package; suites move on, then it is gone."""
    command = ["apt-cache", *options, "showsrc", "micropython"]
    listed = subprocess.run(command, capture_output=True, text=True, check=False).stdout
    there = re.findall(r"^Version: (\S+)$", listed, re.MULTILINE)
    fitting = [v for v in there if re.split(r"[+~-]", v)[0] == release.version]
    if not fitting:
        raise FirmwareError(
            f"the mirror has no sources of MicroPython {release.version} in "
            f"{', '.join(release.suites)} (there: {', '.join(sorted(set(there))) or 'none'}): "
            f"fetch {release.official} and set PLUMB_FIRMWARE to it"
        )
    return fitting[0]


def _private_apt(folder, release):
    """Options that make apt-get use `folder` for its sources, lists and cache."""
    for name in ("lists/partial", "cache/archives/partial"):
        (folder / name).mkdir(parents=True, exist_ok=True)
    mirror, signed_by = find_mirror(Path("/etc/apt"))
    sources = folder / "plumb.sources"
    wanted = dict.fromkeys(release.suites, "deb-src") | {SDK_SUITE: "deb deb-src"}
    sources.write_text(
        "\n".join(
            f"Types: {types}\nURIs: {mirror}\nSuites: {suite}\nComponents: main\n"
            f"Signed-By: {signed_by}\n"
            for suite, types in wanted.items()
        )
    )
    settings = {
        "Dir::Etc::sourcelist": sources,
        "Dir::Etc::sourceparts": "/dev/null",
        "Dir::Etc::preferences": "/dev/null",
        "Dir::Etc::preferencesparts": "/dev/null",
        "Dir::State::lists": folder / "lists",
        "Dir::Cache": folder / "cache",
        "APT::Sandbox::User": "",
    }
    return [part for name, value in settings.items() for part in ("-o", f"{name}={value}")]


def find_mirror(etc_apt):
    """(address, keyring) of the Debian archive in this machine's apt configuration."""
    parts = etc_apt / "sources.list.d"
    for path in sorted(parts.glob("*.sources")):
        for stanza in re.split(r"\n\s*\n", path.read_text()):
            fields = dict(re.findall(r"^([A-Za-z-]+):[ \t]*(.+)$", stanza, re.MULTILINE))
            for address in fields.get("URIs", "").split():
                if _is_archive(address):
                    return address, fields.get("Signed-By", KEYRING)
    for path in [etc_apt / "sources.list", *sorted(parts.glob("*.list"))]:
        text = path.read_text() if path.exists() else ""
        for options, address in re.findall(r"^deb\s+(\[.*?\]\s+)?(\S+)", text, re.MULTILINE):
            if _is_archive(address):
                signed = re.search(r"signed-by=([^\s\]]+)", options)
                return address, signed.group(1) if signed else KEYRING
    raise FirmwareError(f"no Debian mirror in {etc_apt}: set PLUMB_FIRMWARE to a UF2 instead")


def _is_archive(address):
    """The main archive, and not the one of security updates or of another vendor."""
    return address.rstrip("/").endswith("/debian")

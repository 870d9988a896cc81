# SPDX-License-Identifier: MIT
"""The board's half of tools.deploy, sent to it as text: what is there, and the exchange.

New files wait in /plumb.new under names made of their path and content, each whole. The exchange
is short: packages that change go aside as folders, by one rename each, firmware first, get their
new files, and come back, firmware last. So a board that is cut off has the old program, or the
new one, or one that cannot be imported; never a mixture. All paths are absolute.
"""

import binascii
import hashlib
import os
import sys

NEW = "/plumb.new"
ASIDE = "/plumb.old"
SIGN = "/firmware.py"  # found only while the folder is aside; a folder goes before a file
_WORDS = 'raise ImportError("a copy of Plumb was cut short: deploy it again")\n'
_FOLDER = 0x4000
_WATCHDOGS = {"RP2040": 0x40058000, "RP2350": 0x400D8000}  # WATCHDOG CTRL, in the datasheets
_ENABLED = 1 << 30
dog = None


def watchdog():
    """The board's watchdog when one runs, at its longest: nothing can stop it, so it is fed."""
    import machine

    for chip in _WATCHDOGS:
        if chip in sys.implementation._machine:
            if machine.mem32[_WATCHDOGS[chip]] & _ENABLED:
                return machine.WDT(timeout=8388)
            return None
    try:
        with open("/config.txt") as f:  # elsewhere only the app knows
            for line in f:
                if line.startswith("watchdog_ms = ") and line.strip() != "watchdog_ms = 0":
                    return machine.WDT(timeout=30000)
    except OSError:
        pass
    return None


def feed():
    if dog:
        dog.feed()


def kind(path):
    """_FOLDER, another number for a file, 0 when there is nothing."""
    try:
        return os.stat(path)[0] & _FOLDER or 1
    except OSError:
        return 0


def walk(path):
    """Paths of the files in a folder and its folders, or the file itself."""
    if kind(path) == _FOLDER:
        for name in sorted(os.listdir(path)):
            yield from walk(path + "/" + name)
    elif kind(path):
        yield path


def digest(path):
    made = hashlib.sha256()
    block = bytearray(1024)
    view = memoryview(block)
    with open(path, "rb") as f:
        n = f.readinto(block)
        while n:
            made.update(view[:n])
            n = f.readinto(block)
    feed()
    return binascii.hexlify(made.digest()).decode()


def show(places):
    """Print (path, digest) of each file there and aside; then the names of what waits."""
    for place in places:
        for path in walk(place):
            print((path, digest(path)))
    print(os.listdir(NEW) if kind(NEW) else [])


def text(path):
    """What a file says, "" when there is none."""
    if not kind(path):
        return ""
    with open(path) as f:
        return f.read()


def receive():
    """Begin a file that waits: (file, digest); put() all of it, then whole()."""
    if not kind(NEW):
        os.mkdir(NEW)
    return open(NEW + "/part", "wb"), hashlib.sha256()


def put(f, made, text):
    data = binascii.a2b_base64(text)
    made.update(data)
    f.write(data)
    feed()


def whole(f, made, name, expected):
    f.close()
    if binascii.hexlify(made.digest()).decode() != expected:
        raise ValueError("damaged on its way")
    replace(NEW + "/part", NEW + "/" + name)


def replace(source, target):
    try:
        os.rename(source, target)
    except OSError:  # FAT does not replace
        os.remove(target)
        os.rename(source, target)


def folders(path):
    """Make the folders above a path."""
    at = path.find("/", 1)
    while at > 0:
        if not kind(path[:at]):
            os.mkdir(path[:at])
        at = path.find("/", at + 1)


def away(path):
    """Remove a file, or a folder with all in it."""
    if kind(path) == _FOLDER:
        for name in os.listdir(path):
            away(path + "/" + name)
        os.rmdir(path)
    elif kind(path):
        os.remove(path)
    feed()


def prune(path):
    """Remove the folders above a path, as far as they are empty."""
    while path != ASIDE:
        path = path[: path.rfind("/")]
        try:
            os.rmdir(path)
        except OSError:
            return


def exchange(packages, new, gone, last):
    """Packages (firmware last) get new (path, name)s and lose gone; the starters of last follow.

    A name of None in last removes the file. Without packages there is one file in last, and
    nothing that could be mixed up.
    """
    if packages:
        with open(SIGN, "w") as f:
            f.write(_WORDS)
    for package in reversed(packages):
        if kind(package):
            away(ASIDE + package)
            folders(ASIDE + package)
            os.rename(package, ASIDE + package)
        feed()
    for path in gone:
        away(ASIDE + path)
        prune(ASIDE + path)
    for path, name in new:
        folders(ASIDE + path)
        replace(NEW + "/" + name, ASIDE + path)
        feed()
    for path, name in last:
        if name:
            replace(NEW + "/" + name, path)
        else:
            away(path)
    for package in packages:
        if kind(ASIDE + package):
            folders(package)
            os.rename(ASIDE + package, package)
    for path in (SIGN, NEW, ASIDE):
        away(path)

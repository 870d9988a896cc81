# SPDX-License-Identifier: MIT
# On MicroPython's unix port and on CPython (see host_tests/tools/test_fuzz_files_micropython.py):
# loads each set of hostile files in CORPUS, saves over it, loads again. One line of JSON for each:
# values other than the defaults, warnings, whether the save mended it. The last line: the longest
# load in ms. CORPUS and sys.path are set before.
# ruff: noqa: F821

import json
import os
import time

from calibration import Calibration

from firmware.calibration import load_calibration, save_calibration
from firmware.config import KNOBS, Config

DEFAULTS = {
    "config": {row[0]: row[1] for row in KNOBS},
    "calibration": Calibration().to_dict(),
}


def config():
    read = Config()
    warnings = read.load()
    return {row[0]: getattr(read, row[0]) for row in KNOBS}, warnings


def calibration():
    cal, warnings = load_calibration()
    return cal.to_dict(), warnings


def mends(kind, n):
    """Whether a save over these files gives its values, without a warning."""
    if kind == "config":
        made = Config()
        made.set("rate_hz", 80 + n % 900)
        made.save()
        values, warnings = config()
        return values["rate_hz"] == 80 + n % 900 and not warnings
    save_calibration(Calibration(temp_c=n % 100, date=str(n)))
    values, warnings = calibration()
    return (values["temp_c"], values["date"]) == (n % 100, str(n)) and not warnings


def put(path, corpus, size):
    """The next `size` bytes of the corpus become this file; 65535 stands for no file."""
    try:
        os.remove(path)
    except OSError:
        pass  # it was not there
    if size == 65535:
        return
    with open(path, "wb") as f:
        while size:
            size -= f.write(corpus.read(min(size, 256)))


def run():
    n = longest = 0
    with open(CORPUS, "rb") as corpus:
        while True:
            head = corpus.read(7)  # the kind, 0 or 1, and three sizes
            if not head:
                break
            kind = "calibration" if head[0] else "config"
            for i, end in enumerate(("", ".new", ".old")):
                put(kind + ".txt" + end, corpus, head[2 * i + 1] << 8 | head[2 * i + 2])
            began = time.time()
            values, warnings = config() if kind == "config" else calibration()
            longest = max(longest, time.time() - began)
            default = DEFAULTS[kind]
            changed = {name: values[name] for name in values if values[name] != default[name]}
            print(json.dumps([changed, warnings, mends(kind, n)]))
            n += 1
    print(int(longest * 1000))


run()

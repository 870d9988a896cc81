# SPDX-License-Identifier: MIT
"""Hostile files for the store, and what must come of them by rules written down a second time.

A set of files is (NAME, NAME.new, NAME.old), each bytes or None; a kind is "config" or
"calibration", its NAME is kind.txt.
"""

import math
import os
import re
import tempfile
import zlib

ENDS = ("", ".new", ".old")
KINDS = ("config", "calibration")
NAMES = {
    "config": ("rate_hz", "drive", "address", "gyro_dps", "filter", "kalman_q_angle", "rest_s",
               "kalman_q_bias", "kalman_r_measure", "self_test", "watchdog_ms"),
    "calibration": ("gyro_bias_dps", "accel_bias_g", "gyro_matrix", "accel_matrix", "temp_c",
                    "residual_mg", "who_am_i", "date", "accel_slope_g_per_c", "version"),
}  # fmt: skip
ODD_NAMES = ("", "what", "__class__", "_values", "load", "RATE_HZ", "date ", "n" * 235, "\u00e9")
ODD_VALUES = (
    "", " ", "0", "-0", "1", "007", "+5", "--5", "+-5", "- 5", "80", "1000", "1001", "-1", "0.5",
    ".5", "5.", ".", "+.", "e5", "1e5", "1E-6", "1e-6", "9.99e-7", "1e", "1e+", "1e5.5", "0x68",
    "nan", "-nan", "inf", "-inf", "infinity", "1e999", "-1e999", "1e-999", "0e400", "0.0e60",
    "1e" + "9" * 50, "0." + "0" * 200 + "5e199", "1_0", "1__0", "_1", "1_", "1_0.5", "9" * 25,
    "9" * 200, "-" + "9" * 200, "9" * 400, "1j", "True", "None", "attitude", "timer", "kalman2",
    "1 2", "1 2 3", "0  0 0", " 1 2 3", "1 2 81", "1 2 nan", "0 0 1_0", "1 x 3", "0.1 0.1 0.1",
    "1 0 0 0 1 0 0 0 1", "1 0 0 0 1 0 0 0 -1", "1 1 1 1 1 1 1 1 1", "1 " * 110, "x" * 230, " = ",
    "= 5", "%s%d", "5\r", "5\0", "\u0663\u0664", "\u00b2", "2026-03-01", "2026", "\t1",
)  # fmt: skip
ODD_COUNTS = ("0", "1", "2", "5", "007", "999999998", "999999999", "1000000000", "9" * 30, "-1",
              "+1", "1_0", "x", "", "1.0", "\u0665", "\u00b2")  # fmt: skip
CAUSES = (
    r"larger than 4096 bytes|byte 0x[0-9a-f]{2} in a text|truncated: no crc line at its end"
    r"|crc does not fit: damaged or edited|too long|not a \w+ file|not a number: |line without a"
    r" value: |version \d+ is newer than this firmware's 1"
)
# Largest magnitude of each field of a calibration
LIMITS = {"gyro_bias_dps": 80, "accel_bias_g": 0.5, "gyro_matrix": 1.5, "accel_matrix": 1.5,
          "gyro_slope_dps_per_c": 2, "accel_slope_g_per_c": 0.01, "temp_c": 200,
          "residual_mg": 1000, "who_am_i": 255}  # fmt: skip

_HEAD = re.compile(r"plumb (\w+) version ([0-9]{1,9}) generation ([0-9]{1,9})")
_NUMBER = re.compile(r"[+-]?[0-9]+(\.[0-9]*)?([eE][+-]?[0-9]+)?")


def quick_folder():
    """A temporary folder, in memory where there is one: a disk writes each rename out."""
    return tempfile.TemporaryDirectory(dir="/dev/shm" if os.path.isdir("/dev/shm") else None)


def written(body):
    """A file's bytes with the CRC that belongs to them."""
    data = body.encode() if isinstance(body, str) else body
    return data + b"crc %08x\n" % zlib.crc32(data)


def whole(kind, generation, rows, version=1):
    """The bytes of a file with a right header and CRC; rows are (name, text)."""
    head = f"plumb {kind} version {version} generation {generation}\n"
    return written(head + "".join(f"{name} = {text}\n" for name, text in rows))


def good(kind, rng):
    """A file as a save writes it, its values drawn from a random.Random."""
    rows = {}
    if kind == "config":
        rows = {"rate_hz": rng.randint(80, 1000), "gyro_dps": rng.choice((250, 500, 1000, 2000)),
                "filter": rng.choice(("attitude", "kalman2", "float.kalman")),
                "kalman_q_bias": rng.choice((0.0, 1e-05, rng.random())),
                "rest_s": round(rng.uniform(0, 10), 3)}  # fmt: skip
    else:
        bias = [round(rng.uniform(-40, 40), rng.randint(0, 12)) for _ in range(3)]
        matrix = [float(i % 4 == 0) + rng.uniform(-0.05, 0.05) for i in range(9)]
        rows = {"gyro_bias_dps": " ".join(map(repr, bias)), "who_am_i": rng.randint(0, 255),
                "accel_matrix": " ".join(map(repr, matrix)), "temp_c": rng.uniform(-20, 70),
                "date": rng.choice(("2026-03-01", "2026", "1 2", "nan", "a = b"))}  # fmt: skip
    kept = [(name, str(rows[name])) for name in sorted(rows) if rng.random() < 0.8]
    return whole(kind, rng.choice((1, 4, 5, 6, 999999998, 999999999)), kept)


def mutated(data, operation, at, size, extra):
    """The file with one thing done to it; `at` and `size` are any numbers from 0."""
    at %= len(data) + 1
    lines = data.split(b"\n")
    one, other = at % len(lines), size % len(lines)
    if operation == "flip" and at < len(data):
        return data[:at] + bytes([data[at] ^ 1 << size % 8]) + data[at + 1 :]
    if operation == "truncate":
        return data[:at]
    if operation == "remove":
        return data[:at] + data[at + size % 40 :]
    if operation == "swap":
        lines[one], lines[other] = lines[other], lines[one]
    elif operation == "double":
        lines.insert(one, lines[other])
    else:
        return data[:at] + extra + data[at:]
    return b"\n".join(lines)


OPERATIONS = ("flip", "truncate", "remove", "swap", "double", "insert")


def mended(data):
    """The file with a CRC that fits what else it holds."""
    return written(data[: data.rfind(b"\n", 0, max(0, len(data) - 1)) + 1])


def valid(data, kind):
    """(generation, {name: text}) of a valid file, else None."""
    match = re.fullmatch(rb"(.*\n)crc ([0-9a-f]{8})\n", data, re.DOTALL)
    if not match or len(data) > 4096 or not re.fullmatch(rb"[\n -~]*", data):
        return None
    if int(match[2], 16) != zlib.crc32(match[1]):
        return None
    first, *rows = match[1].decode().split("\n")[:-1]
    head = _HEAD.fullmatch(first)
    if not head or head[1] != kind or int(head[2]) > 1 or len(rows) > 62:
        return None
    if max(map(len, [first, *rows])) > 240 or any(row.find(" = ") < 1 for row in rows):
        return None
    return int(head[3]), dict(row.split(" = ", 1) for row in rows)


def edited(data, kind):
    """What valid() gives, for a settings file that is whole but for its CRC, or for what editors
    and people leave: ends of lines, blanks, comments, lines without a value; and whether its CRC
    fits then. None for any other."""
    rows = data.split(b"\n")
    if kind != "config" or len(data) > 4096 or len(rows) > 128 or max(map(len, rows)) > 240:
        return None
    found = _but_for_crc(data, kind)
    if found:
        return found, False
    lines = []
    for line in data.replace(b"\xef\xbb\xbf", b"").replace(b"\t", b" ").split(b"\n"):
        line = line.strip()
        name, sign, value = line.partition(b"=")
        if line and not line.startswith(b"#"):
            if sign or not line.startswith((b"plumb ", b"crc ")):
                line = name.strip() + b" = " + value.strip()
            lines.append(line)
    data = b"\n".join(lines) + b"\n"
    found = _but_for_crc(data, kind)
    return found and (found, bool(valid(data, kind)))


def _but_for_crc(data, kind):
    match = re.fullmatch(rb"(.*\n)crc [ -~]{8}\n", data, re.DOTALL)
    return valid(written(match[1]), kind) if match else None


def _reading(files, kind):
    """What each of the three files says; and of the first, whether it is good but for its ends of
    lines and the like (1), or for its CRC too (2)."""
    main, new, old = (None if data is None else valid(data, kind) for data in files)
    by_hand = 0
    found = None if files[0] is None or main else edited(files[0], kind)
    if found:
        main, by_hand = found[0], 1 if found[1] else 2
    return main, new, old, by_hand


def chosen(files, kind):
    """The names and texts that are in force: {name: text}, or None when no file is valid."""
    main, new, old = _reading(files, kind)[:3]
    if main and new:
        return (new if new[0] > main[0] else main)[1]
    best = main or new or old
    return best[1] if best else None


def _scalar(word):
    """A number of digits only; what overflows or vanishes is a word."""
    match = _NUMBER.fullmatch(word)
    if not match:
        return word
    value = float(word) if match[1] or match[2] else int(word)
    if match[2] and (not value or not math.isfinite(value)):
        return word
    return value


def value_of(text):
    """What the text of one value means: a number, a tuple of them, or the text."""
    if " " not in text:
        return _scalar(text)
    numbers = tuple(_scalar(word) for word in text.split())
    return text if not numbers or any(isinstance(n, str) for n in numbers) else numbers


def outcome(files, kind):
    """(values in force, the words of which each must be in a warning) for a set of files."""
    texts = chosen(files, kind) or {}
    blamed = []
    if kind == "config":
        from firmware.config import KNOBS, checked

        values = {row[0]: row[1] for row in KNOBS}
        for name, text in texts.items():
            try:
                values[name] = checked(name, value_of(text))
            except ValueError:
                blamed.append(name[:40])
        return values, blamed
    from calibration import Calibration

    fields = {name: text if name == "date" else value_of(text) for name, text in texts.items()}
    try:
        return Calibration.from_dict(fields).to_dict(), []
    except ValueError as error:
        return Calibration().to_dict(), [str(error)]


def check_warnings(files, kind, blamed, warnings):
    """Assert that each bad thing is named with its path and cause, and nothing else is."""
    path = kind + ".txt"
    main, new, _, by_hand = _reading(files, kind)
    used = "defaults" if chosen(files, kind) is None else "last good one"
    if by_hand == 2 and new and new[0] > main[0]:
        by_hand = 0  # its edits are not in force
    if by_hand:
        files = (None, *files[1:])
    if by_hand == 2:
        text = path + ": edited by hand (its crc does not fit): taken; app.save() makes it whole"
        assert warnings.count(text) == 1, warnings
        warnings = [warning for warning in warnings if warning != text]
    bad = [path + end for end, data in zip(ENDS, files)
           if data is not None and end != ".new" and not valid(data, kind)]  # fmt: skip
    for name in bad:
        cause = re.compile(re.escape(name) + ": (" + CAUSES + ")")
        assert sum(bool(cause.match(text)) for text in warnings) == 1, (name, warnings)
    told = bad and by_hand != 2
    if told:
        assert warnings[len(bad)] == f"{path}: {used} used", warnings
    for words in blamed:
        assert any(text.startswith(path + ": ") and words in text for text in warnings), warnings
    assert len(warnings) == len(bad) + bool(told) + len(blamed), warnings

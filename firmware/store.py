# SPDX-License-Identifier: MIT
"""Settings on flash that a power cut, a bad edit or a worn block cannot lose.

One text file: a header with kind, version and generation, `name = value` lines, a CRC-32. A save
writes NAME.new whole, keeps the file before as NAME.old and renames the new one into place; so
after a cut at any byte one of them is whole. A load takes the valid file of the highest
generation. Values are ints, floats, words, or tuples of ints and floats.
"""

import binascii
import os

_SIZE_MAX = 4096  # a file larger than this was not written here; it is not read either
_LINE_MAX = 240


def save(path, kind, version, values):
    """Write a dict as the next generation of `path`. OSError when the flash refuses.

    kind: what the file is, a word; version: of the meaning of its names, from 1.
    ValueError for a value that cannot be written.
    """
    current = _read(path, kind, version)
    last = max(_generation(_read(path + end, kind, version)) for end in ("", ".new", ".old"))
    lines = ["plumb %s version %d generation %d" % (kind, version, last + 1)]
    lines.extend("%s = %s" % (name, _text(values[name])) for name in sorted(values))
    body = "\n".join(lines) + "\n"
    text = body + "crc %08x\n" % binascii.crc32(body.encode())
    _check_lines(text)
    with open(path + ".new", "wb") as f:
        f.write(text.encode())
    if isinstance(current, tuple):  # only a good file is worth keeping as the one before
        _move(path, path + ".old")
    _move(path + ".new", path)


def load(path, kind, version):
    """The stored dict, or None when there is no valid one, and a list of warnings (texts).

    A missing file is no warning. Never raises because of what the files hold.
    """
    best = None
    warnings = []
    for end in ("", ".new", ".old"):
        found = _read(path + end, kind, version)
        if isinstance(found, tuple):
            if best is None or found[0] > best[0]:
                best = found
        elif found and end != ".new":  # a half-written .new is a cut save: nothing is lost
            warnings.append("%s%s: %s" % (path, end, found))
    if warnings:
        warnings.append("%s: %s" % (path, "last good one used" if best else "defaults used"))
    return (best[1] if best else None), warnings


def _read(path, kind, version):
    """(generation, values) of a valid file, a text saying what is wrong, or None: no file."""
    try:
        if os.stat(path)[6] > _SIZE_MAX:
            return "larger than %d bytes" % _SIZE_MAX
        with open(path, "rb") as f:
            data = f.read(_SIZE_MAX)
    except OSError as error:
        return None if error.errno == 2 else "cannot be read (%s)" % error
    try:
        return _parse(data, kind, version)
    except ValueError as error:
        return str(error)


def _parse(data, kind, version):
    for byte in data:
        if byte != 10 and not 32 <= byte <= 126:
            raise ValueError("byte 0x%02x in a text" % byte)
    lines = data.decode().split("\n")
    if len(lines) < 3 or lines[-1] or not lines[-2].startswith("crc "):
        raise ValueError("truncated: no crc line at its end")
    body = data[: len(data) - len(lines[-2]) - 1]
    if lines[-2] != "crc %08x" % binascii.crc32(body):
        raise ValueError("crc does not fit: damaged or edited")
    _check_lines(data.decode())
    head = lines[0].split(" ")
    if len(head) != 6 or head[:3] != ["plumb", kind, "version"] or head[4] != "generation":
        raise ValueError("not a %s file" % kind)
    theirs, generation = _number(head[3]), _number(head[5])
    if theirs > version:
        raise ValueError("version %d is newer than this firmware's %d" % (theirs, version))
    values = {}
    for line in lines[1:-2]:
        name, mark, value = line.partition(" = ")
        if not mark or not name:
            raise ValueError("line without a value: %s" % line[:40])
        values[name] = _value(value)
    return generation, values


def _check_lines(text):
    if len(text) > _SIZE_MAX or max(len(line) for line in text.split("\n")) > _LINE_MAX:
        raise ValueError("too long")


def _number(word):
    if not word.isdigit() or len(word) > 9:
        raise ValueError("not a number: %s" % word[:20])
    return int(word)


def _value(text):
    words = text.split(" ")
    if len(words) == 1:
        return _scalar(text)
    values = tuple(_scalar(word) for word in words if word)
    if any(isinstance(value, str) for value in values):
        return text
    return values


def _scalar(word):
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            pass
    return word


def _text(value):
    if isinstance(value, (tuple, list)):
        return " ".join(_text(item) for item in value)
    text = value if isinstance(value, str) else repr(value)
    if "\n" in text or not text:
        raise ValueError("cannot be stored: %s" % text[:40])
    return text


def _generation(found):
    return found[0] if isinstance(found, tuple) else 0


def _move(source, target):
    try:
        os.rename(source, target)
    except OSError:  # FAT does not replace; NAME.new is whole by now, so nothing can be lost
        os.remove(target)
        os.rename(source, target)

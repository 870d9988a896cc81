# SPDX-License-Identifier: MIT
"""Settings on flash that a power cut, a bad edit or a worn block cannot lose.

One text file: a header with kind, version and generation, `name = value` lines, a CRC-32. A save
writes NAME.new whole, keeps the file before as NAME.old and renames the new one into place; so
after a cut at any byte one of them is whole. A load takes the valid one of NAME and NAME.new of
the higher generation, else NAME.old. Values are ints, floats, words, or tuples of ints and floats.
"""

import binascii
import os

_SIZE_MAX = 4096  # a file larger than this was not written here; it is not read either
_LINE_MAX = 240
_LINES_MAX = 64  # short lines cost most: 4096 bytes of them took 130 kB of a board's heap
_GENERATION_MAX = 999999999  # no flash lives to see it; a file that claims it can be saved over


def save(path, kind, version, values):
    """Write a dict as the next generation of `path`. OSError when the flash refuses.

    kind: what the file is, a word; version: of the meaning of its names, from 1.
    ValueError for a value that cannot be written.
    """
    found = [_read(path + end, kind, version) for end in ("", ".new", ".old")]
    generation = min(max([_generation(file) for file in found]) + 1, _GENERATION_MAX)
    lines = ["plumb %s version %d generation %d" % (kind, version, generation)]
    lines.extend("%s = %s" % (name, _text(values[name])) for name in sorted(values))
    body = "\n".join(lines) + "\n"
    text = body + "crc %08x\n" % binascii.crc32(body.encode())
    _check_lines(text)
    with open(path + ".new", "wb") as f:
        f.write(text.encode())
    if isinstance(found[0], tuple):  # only a good file is worth keeping as the one before
        _move(path, path + ".old")
    _move(path + ".new", path)
    if isinstance(found[2], str) and not isinstance(found[0], tuple):
        os.remove(path + ".old")  # a bad one that every load would warn of


def load(path, kind, version, texts=(), by_hand=False):
    """The stored dict, or None when there is no valid one, and a list of warnings (texts).

    texts: names whose values stay text, even where they look like numbers. by_hand: a file that
    is whole but for its CRC has been edited: it is taken, with a warning. A missing file is no
    warning. Never raises because of what the files hold.
    """
    best = None
    warnings = []
    for end in ("", ".new", ".old"):
        found = _read(path + end, kind, version, by_hand and not end)
        if isinstance(found, tuple):
            if found[2]:
                text = "edited by hand (its crc does not fit): taken; app.save() makes it whole"
                warnings.append("%s: %s" % (path, text))
            # .old is older whatever it says: NAME may be a copy from elsewhere, with a low number
            if best is None or (end == ".new" and found[0] > best[0]):
                best = found
        elif found and end != ".new":  # a half-written .new is a cut save: nothing is lost
            warnings.append("%s%s: %s" % (path, end, found))
    if warnings and not (best and best[2]):
        warnings.append("%s: %s" % (path, "last good one used" if best else "defaults used"))
    if best is None:
        return None, warnings
    values = {}
    for line in best[1]:
        name, _, value = line.partition(" = ")
        values[name] = value if name in texts else _value(value)
    return values, warnings


def _read(path, kind, version, by_hand=False):
    """(generation, lines, edited) of a valid file, a text saying what is wrong, or None."""
    try:
        if os.stat(path)[6] > _SIZE_MAX:
            return "larger than %d bytes" % _SIZE_MAX
        with open(path, "rb") as f:
            data = f.read(_SIZE_MAX)
    except OSError as error:
        return None if error.errno == 2 else "cannot be read (%s)" % error
    try:
        return _parse(data, kind, version, by_hand)
    except ValueError as error:
        failure = str(error)
    if by_hand and data.count(b"\n") < 2 * _LINES_MAX:
        try:
            return _parse(_tidied(data), kind, version, True)
        except ValueError:
            pass
    return failure


def _tidied(data):
    """What an editor, or its user, left otherwise than save() writes it: ends of lines, blanks,
    comments; a line without a value becomes one of a name that nobody knows, and is told."""
    lines = []
    for line in data.replace(b"\xef\xbb\xbf", b"").replace(b"\t", b" ").split(b"\n"):
        line = line.strip()
        name, sign, value = line.partition(b"=")
        if line and line[0] != 35:
            if sign or not (line.startswith(b"plumb ") or line.startswith(b"crc ")):
                line = name.strip() + b" = " + value.strip()
            lines.append(line)
    return b"\n".join(lines) + b"\n"


def _parse(data, kind, version, by_hand):
    for byte in data:
        if byte != 10 and not 32 <= byte <= 126:
            raise ValueError("byte 0x%02x in a text" % byte)
    text = data.decode()
    end = text.rfind("\n", 0, len(text) - 1) + 1  # where the last line begins
    if end < 1 or text[-1] != "\n" or not text[end:].startswith("crc "):
        raise ValueError("truncated: no crc line at its end")
    edited = text[end:] != "crc %08x\n" % binascii.crc32(data[:end])
    if edited and not by_hand:
        raise ValueError("crc does not fit: damaged or edited")
    _check_lines(text)
    lines = text[:end].split("\n")
    head = lines[0].split(" ")
    if len(head) != 6 or head[:3] != ["plumb", kind, "version"] or head[4] != "generation":
        raise ValueError("not a %s file" % kind)
    theirs, generation = _number(head[3]), _number(head[5])
    if theirs > version:
        raise ValueError("version %d is newer than this firmware's %d" % (theirs, version))
    lines = lines[1:-1]
    for line in lines:
        if line.find(" = ") < 1:
            raise ValueError("line without a value: %s" % line[:40])
    return generation, lines, edited


def _check_lines(text):
    if len(text) > _SIZE_MAX or text.count("\n") > _LINES_MAX:
        raise ValueError("too long")
    if max([len(line) for line in text.split("\n")]) > _LINE_MAX:
        raise ValueError("too long: a line")


def _number(word):
    if not word.isdigit() or len(word) > 9:
        raise ValueError("not a number: %s" % word[:20])
    return int(word)


def _value(text):
    words = text.split(" ")
    if len(words) == 1:
        return _scalar(text)
    values = tuple(_scalar(word) for word in words if word)
    if not values or any(isinstance(value, str) for value in values):
        return text
    return values


def _scalar(word):
    """The number that the word is on every port and on a PC, else the word.

    Theirs differ in "1__0", ".", "e5", "0e400" and, floats being short or long, in what overflows.
    """
    if "_" not in word and word.lstrip("+-")[:1].isdigit():
        for kind in (int, float):
            try:
                value = kind(word)
            except ValueError:
                continue
            if value - value == 0 and (value or "e" not in word.lower()):
                return value
    return word


def _text(value):
    if isinstance(value, (tuple, list)):
        return " ".join(_text(item) for item in value)
    text = value if isinstance(value, str) else repr(value)
    if not text or not all(32 <= ord(mark) <= 126 for mark in text):  # what _parse() refuses
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

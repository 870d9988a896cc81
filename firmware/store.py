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
_EDITED = "crc does not fit: damaged or edited"
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
    sizes = [len(line) + 1 for line in lines]
    if sum(sizes) + 13 > _SIZE_MAX or len(lines) >= _LINES_MAX or max(sizes) > _LINE_MAX + 1:
        raise ValueError("too long")
    crc = 0
    with open(path + ".new", "wb") as f:
        for line in lines:
            data = (line + "\n").encode()
            crc = binascii.crc32(data, crc)
            f.write(data)
        f.write(_crc_line(crc))
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
    best = edited = None
    warnings = []
    for end in ("", ".new", ".old"):
        found = _read(path + end, kind, version, by_hand and not end)
        if isinstance(found, tuple):
            if found[2]:
                edited = found
                warnings.append("%s: %s" % (path, _EDITED))
            # .old is older whatever it says: NAME may be a copy from elsewhere, with a low number
            if best is None or (end == ".new" and found[0] > best[0]):
                best = found
        elif found and end != ".new":  # a half-written .new is a cut save: nothing is lost
            warnings.append("%s%s: %s" % (path, end, found))
    if edited and best is edited:
        text = "edited by hand (its crc does not fit): taken; app.save() makes it whole"
        warnings[0] = "%s: %s" % (path, text)
    elif warnings:
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
        data = _lines(path)
        try:
            return _parse(data, kind, version, by_hand)
        except ValueError as error:
            failure = str(error)
        if by_hand:
            try:
                return _parse(_tidied(data), kind, version, True)
            except ValueError:
                pass
        return failure
    except OSError as error:
        return None if error.errno == 2 else "cannot be read (%s)" % error
    except ValueError as error:
        return str(error)


def _lines(path):
    """A file's lines, with their ends: a heap in pieces may have no room for it in one."""
    lines = []  # type: list
    with open(path, "rb") as f:
        while True:
            line = f.readline(_LINE_MAX + 2)
            if not line:
                return lines
            if len(line) > _LINE_MAX + 1 or len(lines) == 2 * _LINES_MAX:
                raise ValueError("too long")
            lines.append(line)


def _tidied(data):
    """What an editor, or its user, left otherwise than save() writes it: ends of lines, blanks,
    comments; a line without a value becomes one of a name that nobody knows, and is told."""
    lines = []  # type: list
    for line in data:
        line = line.replace(b"\xef\xbb\xbf", b"").replace(b"\t", b" ").strip()
        name, sign, value = line.partition(b"=")
        if line and line[0] != 35:
            if sign or not (line.startswith(b"plumb ") or line.startswith(b"crc ")):
                line = name.strip() + b" = " + value.strip()
            lines.append(line + b"\n")
    return lines


def _parse(data, kind, version, by_hand):
    crc = last = 0
    for line in data:
        for byte in line:
            if byte != 10 and not 32 <= byte <= 126:
                raise ValueError("byte 0x%02x in a text" % byte)
        last, crc = crc, binascii.crc32(line, crc)
    if len(data) < 2 or len(data[-1]) != 13 or data[-1][:4] != b"crc " or data[-1][-1] != 10:
        raise ValueError("truncated: no crc line at its end")
    edited = data[-1] != _crc_line(last)
    if edited and not by_hand:
        raise ValueError(_EDITED)
    if len(data) > _LINES_MAX or max([len(line) for line in data]) > _LINE_MAX + 1:
        raise ValueError("too long")
    lines = [line[:-1].decode() for line in data[:-1]]
    head = lines[0].split(" ")
    if len(head) != 6 or head[:3] != ["plumb", kind, "version"] or head[4] != "generation":
        raise ValueError("not a %s file" % kind)
    theirs, generation = _number(head[3]), _number(head[5])
    if theirs > version:
        raise ValueError("version %d is newer than this firmware's %d" % (theirs, version))
    lines = lines[1:]
    for line in lines:
        if line.find(" = ") < 1:
            raise ValueError("line without a value: %s" % line[:40])
    return generation, lines, edited


def _crc_line(crc):
    return ("crc %08x\n" % crc).encode()


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

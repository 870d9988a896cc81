# SPDX-License-Identifier: MIT
"""Files survive power cuts, damage, copies from elsewhere and the future."""

import errno

import pytest

from host_tests.firmware.hostile_files import whole, written
from tools.virtual.port import Port


@pytest.fixture
def port(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with Port("rp2") as virtual:
        yield virtual


def test_values_of_all_kinds_survive_the_file(port):
    from firmware import store

    values = {"a": 1, "b": -0.25, "c": "two words", "d": (1.0, 2.5, -3), "e": 1e-9}
    store.save("x.txt", "thing", 3, values)
    assert store.load("x.txt", "thing", 3) == (values, [])


@pytest.mark.parametrize(
    "data, cause",
    [
        (b"", "truncated"),
        (b"plumb thing version 1 generation 9\na = 7\n", "truncated"),
        (written("plumb thing version 1 generation 9\na = 7\n").replace(b"7", b"8"), "crc"),
        (written("plumb thing version 2 generation 9\na = 7\n"), "version 2 is newer"),
        (written("plumb other version 1 generation 9\na = 7\n"), "not a thing file"),
        (written("plumb thing version 1 generation x\na = 7\n"), "not a number"),
        (written("plumb thing version 1 generation 9\na\n"), "line without a value"),
        (written(b"plumb thing version 1 generation 9\na = \xff\n"), "byte 0xff"),
        (written("plumb thing version 1 generation 9\na = " + "7" * 300 + "\n"), "too long"),
        (b"x" * 5000, "larger than"),
    ],
)
def test_a_bad_file_is_named_and_the_last_good_one_used(port, tmp_path, data, cause):
    from firmware import store

    store.save("x.txt", "thing", 1, {"a": 1})
    store.save("x.txt", "thing", 1, {"a": 2})
    (tmp_path / "x.txt").write_bytes(data)
    values, warnings = store.load("x.txt", "thing", 1)
    assert values == {"a": 1}
    assert any(cause in w for w in warnings), warnings
    assert warnings[-1] == "x.txt: last good one used"
    (tmp_path / "x.txt.old").unlink()
    values, warnings = store.load("x.txt", "thing", 1)
    assert values is None and warnings[-1] == "x.txt: defaults used"
    store.save("x.txt", "thing", 1, {"a": 3})  # and the next save mends it
    assert store.load("x.txt", "thing", 1) == ({"a": 3}, [])


class PowerCut(Exception):
    """The power went."""


class Flash:
    """`open` and `os` of the store with a budget of bytes and directory changes until the cut."""

    def __init__(self, store, budget):
        self.budget = budget
        self.os, self.open = store.os, store.__builtins__["open"]
        self.ENOENT = errno.ENOENT

    def spend(self):
        if self.budget == 0:
            raise PowerCut
        self.budget -= 1

    def opened(self, name, mode):
        f = self.open(name, mode)
        return _CutFile(self, f) if "w" in mode else f

    def stat(self, name):
        return self.os.stat(name)

    def rename(self, old, new):
        self.spend()
        self.os.rename(old, new)

    def remove(self, name):
        self.spend()
        self.os.remove(name)


class _CutFile:
    def __init__(self, flash, f):
        self.flash, self.f = flash, f
        flash.spend()

    def write(self, data):
        for i in range(len(data)):
            self.flash.spend()
            self.f.write(data[i : i + 1])

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.f.close()


@pytest.mark.parametrize("generations", [0, 1, 2])
def test_a_power_cut_after_any_byte_leaves_the_old_or_the_new(port, tmp_path, generations):
    from firmware import store

    old, new = {"a": 1, "b": "old"}, {"a": 2, "b": "new"}
    cuts = 0
    while True:
        for leftover in tmp_path.iterdir():
            leftover.unlink()
        for _ in range(generations):
            store.save("x.txt", "thing", 1, old)
        flash = Flash(store, cuts)
        real = store.os
        store.os, store.open = flash, flash.opened
        try:
            store.save("x.txt", "thing", 1, new)
            finished = True
        except PowerCut:
            finished = False
        finally:
            store.os = real
            del store.open
        values, warnings = store.load("x.txt", "thing", 1)
        if finished:
            assert values == new
            break
        assert values == (old if generations else None) or values == new, cuts
        assert warnings == []
        store.save("x.txt", "thing", 1, {"a": 3})  # the remains of the cut are no obstacle
        assert store.load("x.txt", "thing", 1) == ({"a": 3}, [])
        cuts += 1
    assert cuts > 60  # it did cut at every byte


# ---- what the fuzz tests found, each once


def test_a_file_of_the_last_generation_can_be_saved_over(port, tmp_path):
    from firmware import store

    for end in ("", ".new", ".old"):
        (tmp_path / ("x.txt" + end)).write_bytes(whole("thing", 999999999, [("a", "0")]))
    for n in (1, 2, 3):
        store.save("x.txt", "thing", 1, {"a": n})
        assert store.load("x.txt", "thing", 1) == ({"a": n}, [])


def test_a_copy_from_elsewhere_is_used_whatever_its_number(port, tmp_path):
    from firmware import store

    (tmp_path / "x.txt.old").write_bytes(whole("thing", 9, [("a", "1")]))
    (tmp_path / "x.txt").write_bytes(whole("thing", 1, [("a", "2")]))
    assert store.load("x.txt", "thing", 1) == ({"a": 2}, [])


def test_a_save_ends_the_warnings_of_a_bad_file_before(port, tmp_path):
    from firmware import store

    for end in ("", ".new", ".old"):
        (tmp_path / ("x.txt" + end)).write_bytes(b"bad")
    assert store.load("x.txt", "thing", 1) == (
        None,
        [
            "x.txt: truncated: no crc line at its end",
            "x.txt.old: truncated: no crc line at its end",
            "x.txt: defaults used",
        ],
    )
    store.save("x.txt", "thing", 1, {"a": 1})
    assert store.load("x.txt", "thing", 1) == ({"a": 1}, [])
    assert [path.name for path in tmp_path.iterdir()] == ["x.txt"]


@pytest.mark.parametrize("text", ["1 M\u00e4rz", "a\nb", "a\rb", ""])
def test_a_text_that_no_load_would_take_is_not_written(port, text):
    from firmware import store

    store.save("x.txt", "thing", 1, {"a": 1})
    with pytest.raises(ValueError, match="cannot be stored"):
        store.save("x.txt", "thing", 1, {"a": text})
    assert store.load("x.txt", "thing", 1) == ({"a": 1}, [])


@pytest.mark.parametrize("text", ["2026", "007", "1.50", "1 2", "nan", " ", "a = b"])
def test_a_text_stays_the_text_it_was(port, text):
    from firmware import store

    store.save("x.txt", "thing", 1, {"a": text, "b": 2})
    assert store.load("x.txt", "thing", 1, ("a",)) == ({"a": text, "b": 2}, [])


WORDS = ["1_0", "1__0", "_1", "1_", ".", "+.", ".5", "e5", "1_0.5", "1e1_0", "1e", "nan", "-inf"]
WORDS += ["1e999", "-1e999", "1e-999", "0e400", "0e5"]
NUMBERS = [("+5", 5), ("007", 7), ("-0", 0), ("5.", 5.0), ("1E5", 1e5), ("9" * 99, 10**99 - 1)]


@pytest.mark.parametrize("word, value", [(word, word) for word in WORDS] + NUMBERS)
def test_a_word_is_a_number_on_every_port_or_on_none(port, tmp_path, word, value):
    from firmware import store

    (tmp_path / "x.txt").write_bytes(whole("thing", 1, [("a", word)]))
    read = store.load("x.txt", "thing", 1)[0]["a"]
    assert (read, type(read)) == (value, type(value))


def test_many_short_lines_are_refused_before_they_fill_the_heap(port, tmp_path):
    from firmware import store

    (tmp_path / "x.txt").write_bytes(whole("thing", 1, [(f"q{i}", "1") for i in range(63)]))
    assert store.load("x.txt", "thing", 1)[1] == ["x.txt: too long", "x.txt: defaults used"]

# SPDX-License-Identifier: MIT
"""Power cuts at every byte of a save, on the board's own flash, littlefs and firmware.

The emulated board saves; each command that its flash got is known. The power is then cut before
each of them and within: after each byte of a program, half-way in an erase, with bits half
programmed. What is left must mount, load the old or the new values without a warning, have every
other file, and take the next save (which is cut again). Figures show with `pytest -s`.
"""

import binascii
from itertools import pairwise

import pytest

from host_tests.board.power_cut_rig import FILES, save_on, try_cuts, worn
from tools.virtual.pico import VirtualPico
from tools.virtual.rp2040.flash import BLOCK_SIZE, read_image

KINDS = ("config", "short", "calibration")
CARELESS = """
import os
text = open('config.txt').read()
for end in ('.old', ''):
    os.remove('config.txt' + end)
with open('config.txt', 'w') as f:
    f.write(text)
"""


@pytest.fixture(scope="module")
def pico():
    with VirtualPico(files=FILES) as board:
        yield board


@pytest.fixture(scope="module")
def series(pico):
    """Three saves of each kind, over none, one and two earlier generations; and a careless one."""
    found = [save_on(pico, kind, n - 1, n) for n in (1, 2, 3) for kind in KINDS]
    return [*found, save_on(pico, "config", 3, 3, CARELESS)]


@pytest.fixture(scope="module")
def saves(series):
    return series[:-1]


@pytest.fixture(scope="module")
def worn_saves(saves):
    return worn(saves[-1].after(), 4)


def figures(found):
    total = {name: sum(getattr(row, name) for row in found) for name in found[0]._fields[2:]}
    print(
        "\n{commands} commands, {tried} cuts ({new} load the new values), {deep} saved over, "
        "{twice} second cuts; {lost} lost".format(**total)
    )


def test_the_log_is_all_that_happened_to_the_flash(saves):
    for save, following in pairwise(saves):
        assert save.after().content() == following.start.content()
    for save in saves:
        assert len(save.commands) >= (3 if save.kind == "short" else 7)
        assert save.kind == "short" or save.erases() != []
        assert all(address >= 0 for address, _ in save.commands)
    sizes = {path: len(data) for path, data in read_image(saves[-1].after().content()).items()}
    # littlefs keeps files of up to 512 bytes in their directory, larger ones in blocks: both occur
    assert sizes["short.txt"] < 512 < sizes["config.txt"]


def test_no_cut_loses_anything(saves):
    found, losses = try_cuts(saves)
    figures(found)
    assert losses == []
    assert [(row.kind, row.n) for row in found] == [(save.kind, save.n) for save in saves]
    for row in found:
        assert row.lost == 0
        assert row.tried > 50 * row.commands and 0 < row.new < row.tried
        assert row.deep > 5 * row.commands
        assert row.twice > (4 if row.kind == "short" else 10) * row.commands


def test_nor_while_littlefs_moves_a_worn_directory(worn_saves):
    """Once with the superblock left behind, then as ever after; it learns where the root is."""
    for save in worn_saves:
        blocks = [address // BLOCK_SIZE for address, _ in save.commands]
        moves = [number for number in save.erases() if blocks[number] >= 2]
        assert moves != [] and min(blocks[moves[0] :]) < 2
        found, losses = try_cuts([save], step=8)
        figures(found)
        assert losses == []
        assert found[0].lost == 0 and 0 < found[0].new < found[0].tried


def test_another_littlefs_reads_every_cut_between_commands(saves):
    for save in saves:
        before = others(read_image(save.start.content()), save.kind)
        assert len(before) >= len(FILES)
        for number in range(len(save.commands)):
            flash = save._replace(commands=save.commands[:number]).after()
            assert others(read_image(flash.content()), save.kind) == before


# (save, command counted from its last erase, whether to save again): the superblock's sector half
# erased; the last page of a full directory; the first of its rewrite; the first where littlefs
# moves the root to; the superblock's word on where the root is now.
CASES = [(0, 0, True), (2, -1, False), (4, 1, False), (7, 1, False), (6, 1, True)]


@pytest.mark.parametrize(("at", "number", "again"), CASES)
def test_the_board_itself_starts_from_a_cut_flash(pico, saves, worn_saves, at, number, again):
    save = [*saves, *worn_saves][at]
    what, flash = save.cut(save.erases()[-1] + number)
    before = read_image(flash.content())
    assert "main.py has run" in boot_from(pico, flash.content()), what
    printed = pico.exec(f"import saves\nprint(*saves.loaded({save.kind!r}))", timeout_s=60)
    assert printed in [f"{n} []\n" for n in (save.before, save.n)], what
    assert pico.flash.log == [], what  # neither boot nor load had to write, let alone format
    assert pico.files() == before, what
    if again:
        pico.exec(f"saves.save({save.kind!r}, {save.n + 1})", timeout_s=60)
        files = pico.files()
        assert others(files, save.kind) == others(before, save.kind), what
        assert is_number(files[save.kind + ".txt"], save.n + 1), what
    print(f"\n{save.kind} {save.n}, {what}: the board loads {printed}", end="")


def boot_from(pico, content):
    """What the board prints when it starts with this flash."""
    pico.flash.content = content
    pico.flash.log.clear()
    pico.power_cycle()
    return pico.output.decode()


def others(files, kind):
    return {path: data for path, data in files.items() if not path.startswith(kind)}


def is_number(data, n):
    """Whether a configuration is whole and holds number n."""
    body, crc = data[:-13], data[-13:]
    return crc == b"crc %08x\n" % binascii.crc32(body) and b"rate_hz = %d\n" % (100 + n) in body


# ---- that the checks above can fail


def test_a_save_that_deletes_before_it_writes_is_found_out(series):
    """Even though it writes the same values once more."""
    found, losses = try_cuts(series[-1:], step=32)
    figures(found)
    assert 0 < found[0].lost < found[0].tried
    assert "loads 0, not one of (3, 3)" in losses[0]


def test_harm_to_another_file_is_found_out(saves):
    """A save whose first command is an erase that hits a module."""
    save = saves[2]
    module = read_image(save.start.content())["firmware/calibration.mpy"]
    address = save.start.content().index(module[:64])
    found, losses = try_cuts([save._replace(commands=[(address, None)])])
    assert found[0].lost >= found[0].deep - 1  # not lost: the cut before it
    assert any("other files have changed" in line for line in losses)


def test_a_flash_that_does_not_mount_is_formatted_and_found_out(pico, saves):
    superblock = bytes(2 * BLOCK_SIZE)
    printed = boot_from(pico, superblock + saves[-1].after().content()[len(superblock) :])
    assert "main.py has run" not in printed
    assert pico.flash.log != []
    assert pico.files() == {}

# SPDX-License-Identifier: MIT
# Runs on MicroPython's unix port (see host_tests/board/power_cut_rig.py), which has the board's
# littlefs: cuts the power everywhere within saves that a board made, mounts what is left and has
# the firmware load and save there. BLOCKS (the flash before the first save), COUNT (of blocks),
# NOISES, STEP (bytes from cut to cut within a program) and SAVES, a list of (kind, number stored
# before, number saved, commands), are set before. Prints a line for each save.
# ruff: noqa: F821

import os

import saves
import vfs
from flash_cuts import Flash, cuts, done

DEEP_STEP = 32  # every so many cuts within a command, all is checked; at others what loads


class Lost(Exception):
    """What a cut has done to the files."""


def on(flash, function, *arguments):
    """The function's result with the flash mounted, as after a boot."""
    vfs.mount(vfs.VfsLfs2(flash, progsize=256), "/cut")
    os.chdir("/cut")
    try:
        return function(*arguments)
    finally:
        os.chdir("/")
        vfs.umount("/cut")


def other_files(kind, folder=""):
    """{path: bytes} of all files but those of `kind`."""
    found = {}
    for name, what, *_ in os.ilistdir("/cut/" + folder):
        path = folder + name
        if what == 0x4000:
            found.update(other_files(kind, path + "/"))
        elif not path.startswith(kind):
            with open("/cut/" + path, "rb") as file:
                found[path] = file.read()
    return found


def check(flash, kind, allowed):
    """The number that loads, which must be one of `allowed`, without a warning."""
    n, warnings = on(flash, saves.loaded, kind)
    if n not in allowed or warnings:
        raise Lost("loads %s, not one of %s; warnings: %s" % (n, allowed, warnings))
    return n


class Cutter:
    """Cuts one save everywhere and counts: `tried`, of which `new` loaded what was being saved;
    `deep`: those that were saved over; `twice`: cuts within that next save; `lost`.
    """

    def __init__(self, flash, kind, before, n):
        self.flash, self.kind, self.before, self.n = flash, kind, before, n
        self.others = on(flash, other_files, kind)
        self.tried = self.new = self.deep = self.twice = self.lost = 0

    def run(self, commands):
        """Every cut; the flash is then as after the save."""
        flash = self.flash
        either = (self.before, self.n)
        for number, (address, data) in enumerate(commands):
            before = flash.piece(address, data)
            self.cut("before %d" % number, either if number else either[:1], True, True)
            for at, (name, piece) in enumerate(cuts(before, data, NOISES, STEP)):
                deep = not at % DEEP_STEP or name.startswith("cells")
                flash.put(address, piece)
                self.cut("in %d, %s" % (number, name), either, deep)
            flash.put(address, before)
            flash.command(address, data)
        self.cut("after all", either[1:], True)

    def cut(self, name, allowed, deep, twice=False):
        """The power goes now. `deep`: check all; `twice`: also cut the next save."""
        self.tried += 1
        flash = Flash(self.flash.blocks, COUNT)
        try:
            n = check(flash, self.kind, allowed)
            self.new += n == self.n
            if deep:
                self.deep += 1
                self.save_over(flash)
            if twice:
                self.cut_again(flash.log, (n, self.n + 1))
        except (Lost, OSError) as error:
            self.lost += 1
            if self.lost < 4:
                print("lost", self.kind, self.n, name, repr(error))

    def save_over(self, flash):
        for again in range(2):
            if on(flash, other_files, self.kind) != self.others:
                raise Lost("other files have changed")
            if not again:
                on(flash, saves.save, self.kind, self.n + 1)
        check(flash, self.kind, (self.n + 1,))

    def cut_again(self, commands, allowed):
        """The power goes a second time: before and half-way in each command of the next save."""
        flash = Flash(self.flash.blocks, COUNT)
        for address, data in commands:
            before = flash.piece(address, data)
            half = len(before) // 2
            for piece in (before, done(before, data)[:half] + before[half:]):
                flash.put(address, piece)
                self.twice += 1
                check(Flash(flash.blocks, COUNT), self.kind, allowed)
            flash.put(address, before)
            flash.command(address, data)


def main():
    flash = Flash(BLOCKS, COUNT)
    for kind, before, n, commands in SAVES:
        it = Cutter(flash, kind, before, n)
        it.run(commands)
        print("save", kind, n, len(commands), it.tried, it.new, it.deep, it.twice, it.lost)


main()

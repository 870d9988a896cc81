# SPDX-License-Identifier: MIT
# Runs on MicroPython's unix port (see host_tests/board/power_cut_rig.py), which has the board's
# littlefs: wears a flash (BLOCKS, COUNT) until the next rewrite of the root directory moves it to
# other blocks, as littlefs does after every 100, and saves configuration FIRST, FIRST + 1 there.
# Twice, since the first time is unlike all others: the superblock stays behind.
# ruff: noqa: F821

import os

import saves
import vfs
from flash_cuts import BLOCK_SIZE, Flash

CYCLES = 101  # littlefs relocates when the revision after the next is a multiple of this
LATE = BLOCK_SIZE * 3 // 4  # from here in a block, one save fills it


def wear(flash):
    """Write a small file again and again: each time a commit to the root directory."""
    revision = at = 0
    while revision % CYCLES != CYCLES - 1 or at < LATE:
        flash.log = []
        with open("wear.txt", "w") as file:
            file.write("%d" % revision)
        for address, data in flash.log:
            if data is not None:
                at = address % BLOCK_SIZE
                if not at:
                    revision = int.from_bytes(data[:4], "little")


def main():
    flash = Flash(BLOCKS, COUNT)
    vfs.mount(vfs.VfsLfs2(flash, progsize=256), "/cut")
    os.chdir("/cut")
    for n in (FIRST, FIRST + 1):
        wear(flash)
        blocks = dict(flash.blocks)
        flash.log = []
        saves.save("config", n)
        print(repr((blocks, n, flash.log)))


main()

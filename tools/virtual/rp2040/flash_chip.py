# SPDX-License-Identifier: MIT
"""The file system's part of the emulated flash chip: its bytes, and every command that changes it.

A board's flash is written by the RP2040's boot ROM, which sends the chip (datasheet W25Q16JV)
"sector erase" (4 KiB to 0xFF) and "page program" (up to 256 bytes; it can only clear bits).
rp2040py carries out a command when its chip select rises; there each one is noted.
"""

from rp2040py.peripherals.ssi import CMD_BLOCK_ERASE, CMD_PAGE_PROGRAM, CMD_SECTOR_ERASE

from tools.virtual.rp2040 import flash

SIZE = flash.BLOCK_COUNT * flash.BLOCK_SIZE


class FlashChip:
    """`log` is [(address, bytes programmed, or None: an erase)], oldest first; clear it at will.

    Addresses count from the file system's beginning. `content` is all of its bytes; setting them
    is no command.
    """

    def __init__(self, mcu):
        self.log = []
        self._flash = mcu.flash
        self._ssi = mcu.ssi
        self._carry_out = mcu.ssi._apply_command
        mcu.ssi._apply_command = self._command

    @property
    def content(self):
        return bytes(self._flash[flash.OFFSET : flash.OFFSET + SIZE])

    @content.setter
    def content(self, data):
        self._flash[flash.OFFSET : flash.OFFSET + len(data)] = data

    def _command(self):
        """Chip select rises: note what the chip does now, and let it."""
        sent = bytes(self._ssi._tx_buffer)
        if len(sent) >= 4 and self._ssi._write_enabled:
            address = int.from_bytes(sent[1:4], "big") - flash.OFFSET
            if sent[0] == CMD_SECTOR_ERASE:
                self.log.append((address, None))
            elif sent[0] == CMD_PAGE_PROGRAM:
                self.log.append((address, sent[4:]))
            elif sent[0] == CMD_BLOCK_ERASE:
                self.log += [(address + at, None) for at in range(0, 1 << 16, flash.BLOCK_SIZE)]
        self._carry_out()

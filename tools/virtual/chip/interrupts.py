# SPDX-License-Identifier: MIT
"""INT_STATUS and the INT pin: level, latch or 50 us pulse, cleared by reading (RM 4.13-4.16)."""

from tools.virtual.chip.registers import INT_ENABLE, INT_PIN_CFG

PULSE_NS = 50_000
_LEVEL_LOW, _LATCH = 0x80, 0x20
CLEAR_ON_ANY_READ = 0x10


class IntPin:
    """The pin and its status. `on_change(level)` is called at each edge; a dead pin has none."""

    def __init__(self, registers):
        self._registers = registers
        self.status = 0
        self.dead = False
        self.on_change = None
        self._active = False
        self._pulse_end = None
        self._seen = 0

    @property
    def level(self):
        """0 or 1 at the pin (with its pull-up when it is open-drain); idle when dead."""
        low_active = bool(self._registers[INT_PIN_CFG] & _LEVEL_LOW)
        return int((self._active and not self.dead) != low_active)

    @property
    def next_ns(self):
        """When the running pulse ends, or None."""
        return self._pulse_end

    def trigger(self, bit, t_ns):
        """An interrupt source fired at `t_ns`; counted only when it is enabled."""
        if not self._registers[INT_ENABLE] & bit:
            return
        self.advance(t_ns)
        self.status |= bit
        self._active = True
        latched = self._registers[INT_PIN_CFG] & _LATCH
        self._pulse_end = None if latched else t_ns + PULSE_NS
        self.update()

    def advance(self, now_ns):
        """End a pulse whose time is over."""
        if self._pulse_end is not None and now_ns >= self._pulse_end:
            self._pulse_end = None
            self._active = False
            self.update()

    def take(self):
        """The status, cleared; a latched pin goes idle with it."""
        status, self.status = self.status, 0
        if self._pulse_end is None:
            self._active = False
        self.update()
        return status

    def clear(self):
        """As after a reset."""
        self.status = 0
        self._active = False
        self._pulse_end = None
        self.update()

    def update(self):
        """Tell the host when the level is another one than it knows."""
        level = self.level
        if level != self._seen:
            self._seen = level
            if self.on_change is not None:
                self.on_change(level)

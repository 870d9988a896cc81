# SPDX-License-Identifier: MIT
"""What tests, tools and faults may do to a chip behind its bus's back."""

from tools.virtual.chip import registers as reg
from tools.virtual.chip.profiles import find

POWER_ON_NS = 20_000_000


class BackDoor:
    """Motion, supply, clock, INT line and overload of a tools.virtual.chip.part.Part."""

    @property
    def motion(self):
        """The motion source."""
        return self._sampler.motion

    def set_motion(self, motion, restart=False):
        """Another motion source from now on; with `restart` its time 0 is now."""
        self._sync(self.now_ns)
        self._sampler.motion = motion
        if restart:
            self._sampler.motion_start_ns = self.now_ns

    def truth(self, t_s):
        """True attitude (w, x, y, z), sensor to earth, at bus time `t_s` seconds."""
        return self.motion.truth(max(0.0, t_s - self._sampler.motion_start_ns * 1e-9))

    @property
    def clock_error(self):
        """Fraction by which the chip's clock runs fast."""
        return self._sampler.clock_error

    def set_clock_error(self, error):
        """The chip's clock runs fast by the fraction `error` from now on."""
        self._sync(self.now_ns)
        self._sampler.set_clock_error(error, self.now_ns)
        self._announced = 0
        self._plan(self.now_ns)

    def set_overload(self, accel_g=(0, 0, 0), gyro_dps=(0, 0, 0)):
        """Add this to what the sensors feel, ahead of saturation (for faults)."""
        self._sync(self.now_ns)
        self._overload = (tuple(accel_g), tuple(gyro_dps))
        self._configure()

    def set_frozen(self, frozen):
        """Stop or release the output registers, and with them what the FIFO takes."""
        self._sync(self.now_ns)
        self._frozen = frozen

    def overfill_fifo(self, extra):
        """Let the FIFO take `extra` bytes more than it holds (for faults)."""
        if self.fifo.push(bytes(self.fifo.size + extra - len(self.fifo))):
            self._trigger(reg.FIFO_OFLOW, self.now_ns)

    def drop_fifo(self, lost):
        """Take up to `lost` bytes from the FIFO's head; how many there were (for faults)."""
        self._sync(self.now_ns)
        taken = min(lost, len(self.fifo))
        for _ in range(taken):
            self.fifo.pop()
        return taken

    def set_int_dead(self, dead):
        """Cut or mend the INT line."""
        self._pin.dead = dead
        self._pin.update()

    def power_off(self):
        """Cut the supply: nothing answers."""
        self._powered = False
        self._clear_registers()

    def power_on(self, profile=None, silent_ns=POWER_ON_NS):
        """Power-on reset: asleep, default ranges, silent for a while; maybe another part."""
        if profile is not None:
            self.profile = find(profile)
            self._set_profile()
        self._powered = True
        self._silent_until = self.now_ns + silent_ns
        self._clear_registers()

# SPDX-License-Identifier: MIT
"""The chips of a Pololu MinIMU-9 v2 as their bus sees them: L3GD20 and LSM303DLHC (accelerometer).

Devices for tools.virtual.bus, driven by a motion source, with the same sensing chain as the
MPU6050's (tools.virtual.chip.sensing). Sources: L3GD20 DocID022116, LSM303DLHC DocID018771.
Modelled is what a driver of samples touches: power, rate, range, auto-increment (bit 7 of the
register number), little-endian outputs, the gyro's DRDY, saturation, noise. FIFO, other interrupts
and the compass are not.
"""

import numpy as np

from tools.virtual.chip.back_door import POWER_ON_NS
from tools.virtual.chip.sensing import Triad, design
from tools.virtual.motion import Still

_CTRL_REG1, _CTRL_REG3, _CTRL_REG4, _CTRL_REG5 = 0x20, 0x22, 0x23, 0x24
_STATUS, _OUT_X_L = 0x27, 0x28
_BOOT, _I2_DRDY = 0x80, 0x08
_REMEMBER = 100  # samples to catch up at most: many time constants of either filter


class _StChip:
    """One of the two: registers, the pointer with its increment bit, sampling on a grid."""

    int_level = 0
    on_int = None
    fifo = None

    def __init__(self, address, motion, bias, matrix, density, seed, noise):
        self.address = address
        self.motion = motion or Still()
        self._motion_ns = 0
        self.registers = bytearray(128)
        self.now_ns = 0
        self._pointer, self._pointer_next, self._step_bit = 0, False, 0
        self._triad = Triad(bias, (0, 0, 0), matrix, np.random.default_rng(seed))
        self._triad.density = density if noise else 0.0
        self._temp_c = 25.0
        self._powered, self._silent_until = True, 0
        self._frozen = self._int_dead = False
        self.clock_error = 0.0
        self._clear()

    def _clear(self):
        """As after power-on."""
        self.registers[0x20:] = bytes(0x60)
        self.registers[_CTRL_REG1] = 0x07  # powered down, axes enabled
        self._triad.zero()
        self._done = -1
        self._set_int(0)

    # bus

    def start(self, read):
        """Addressed; outputs are those of the last sample before the START."""
        if not self._powered or self.now_ns < self._silent_until:
            return False
        self._pointer_next = not read
        if read:
            self._sample()
        return True

    def write(self, value):
        """The register number first, then values."""
        if not 0 <= value <= 255:
            raise ValueError(f"{value!r} is not a byte (0..255)")
        if self._pointer_next:
            self._pointer_next = False
            self._pointer, self._step_bit = value & 0x7F, value >> 7
        else:
            if self._pointer == _CTRL_REG5 and value & _BOOT:
                self._clear()
            elif 0x20 <= self._pointer <= 0x25:
                self.registers[self._pointer] = value
                self._triad.restart()
                self._done = -1
            self._advance_pointer()
        return True

    def read(self):
        """A byte from the register pointed at."""
        value = self.registers[self._pointer]
        if self._pointer == _OUT_X_L:
            self._set_int(0)
        self._advance_pointer()
        return value

    def stop(self):
        """End of the transfer."""

    def advance(self, now_ns):
        """Let time pass; samples are computed when somebody reads."""
        ready = self.next_event_ns()
        self.now_ns = max(self.now_ns, now_ns)
        if ready is not None and ready <= now_ns:
            self._set_int(1)
            self._told = self._tick()

    def next_event_ns(self):
        """When the next sample raises DRDY, ns; None where it is not asked for."""
        rate = self._rate_hz() if self._signals() else 0
        if not rate or self._frozen or not self._powered:
            return None
        return -int(-(max(self._told, self._tick()) + 1) * 1e9 / rate // 1)

    def _signals(self):
        """Whether fresh samples are signalled."""
        return False

    def _tick(self):
        return int(self.now_ns * self._rate_hz() / 1e9 + 1e-6)

    def _set_int(self, level):
        self._told = -1
        level = 0 if self._int_dead else level
        if level != self.int_level:
            self.int_level = level
            if self.on_int is not None:
                self.on_int(level)

    def _advance_pointer(self):
        if self._step_bit:
            self._pointer = (self._pointer + 1) & 0x7F

    # behind the bus's back: as tools.virtual.chip.back_door

    def truth(self, t_s):
        """True attitude (w, x, y, z), sensor to earth."""
        return self.motion.truth(max(0.0, t_s - self._motion_ns * 1e-9))

    def set_motion(self, motion, restart=False):
        """Another motion source from now on; with `restart` its time 0 is now."""
        self._sample()
        self.motion = motion
        if restart:
            self._motion_ns = self.now_ns

    def power_off(self):
        """Cut the supply: nothing answers."""
        self._powered = False
        self._clear()

    def power_on(self, profile=None, silent_ns=POWER_ON_NS):
        """Power-on reset: powered down, silent for a while."""
        self._powered = True
        self._silent_until = self.now_ns + silent_ns
        self._clear()

    def set_frozen(self, frozen):
        """Stop or release the output registers."""
        self._sample()
        self._frozen = frozen

    def set_overload(self, accel_g=(0, 0, 0), gyro_dps=(0, 0, 0)):
        """Add this to what the sensors feel, ahead of saturation (for faults)."""
        self._sample()
        self._triad.added = tuple((accel_g, gyro_dps)[self.PLACE.start // 3])

    def set_clock_error(self, error):
        """The chip's clock runs fast by the fraction `error` from now on."""
        self._sample()
        self.clock_error = error
        self._done = self._tick()

    def set_int_dead(self, dead):
        """Cut or mend the DRDY line."""
        self._int_dead = dead
        self._set_int(0)

    # samples

    def _sample(self):
        rate = self._rate_hz()
        if not rate or self._frozen or not self._powered:
            return
        bandwidth, limit, per_unit = self._setting()
        self._triad.set_filter(design(bandwidth, None, rate), rate, limit)
        last = self._tick()
        first = max(self._done + 1, last - _REMEMBER)
        for n in range(first, last + 1):
            sample = self.motion.at(max(0.0, n / rate - self._motion_ns * 1e-9))
            self._temp_c = sample[6]
            self._triad.step(*sample[self.PLACE], self._temp_c)
        self._done = max(self._done, last)
        self.registers[_STATUS] = 0x0F  # fresh on all axes
        words = (int(np.clip(round(v * per_unit), -32768, 32767)) for v in self._triad.value)
        for k, word in enumerate(words):
            word &= self.MASK
            at = _OUT_X_L + 2 * k
            self.registers[at : at + 2] = (word & 0xFFFF).to_bytes(2, "little")


class L3GD20Chip(_StChip):
    """The gyro: asleep until CTRL_REG1's PD bit is set. Noise 0.03 deg/s/sqrt(Hz)."""

    PLACE = slice(3, 6)
    MASK = -1
    _RATES = (95.0, 190.0, 380.0, 760.0)
    _BANDWIDTH = ((12.5, 25, 25, 25), (12.5, 25, 50, 70), (20, 25, 50, 100), (30, 35, 50, 100))
    _MDPS = (8.75, 17.5, 70.0, 70.0)

    def __init__(self, motion=None, address=0x6B, seed=0, noise=True, gyro_bias_dps=(0, 0, 0),
                 gyro_matrix=None, who_am_i=0xD4):
        super().__init__(address, motion, gyro_bias_dps, gyro_matrix, 0.03, seed, noise)
        self.registers[0x0F] = who_am_i

    def _rate_hz(self):
        control = self.registers[_CTRL_REG1]
        return self._RATES[control >> 6] * (1 + self.clock_error) if control & 0x08 else 0

    def _signals(self):
        return bool(self.registers[_CTRL_REG3] & _I2_DRDY)

    def _setting(self):
        control, mdps = self.registers[_CTRL_REG1], self._MDPS[self.registers[_CTRL_REG4] >> 4 & 3]
        self.registers[0x26] = round(25.0 - self._temp_c) & 0xFF  # falls by 1 each degree
        return self._BANDWIDTH[control >> 6][control >> 4 & 3], 32.768 * mdps, 1000 / mdps


class LSM303Chip(_StChip):
    """The accelerometer: off while ODR is 0; 12 bits, left-justified. Noise 220 ug/sqrt(Hz)."""

    PLACE = slice(0, 3)
    MASK = ~0xF
    _RATES = (0, 1, 10, 25, 50, 100, 200, 400, 1620, 1344)
    _MG = (1.0, 2.0, 4.0, 12.0)

    def __init__(self, motion=None, address=0x19, seed=0, noise=True, accel_bias_g=(0, 0, 0),
                 accel_matrix=None):
        super().__init__(address, motion, accel_bias_g, accel_matrix, 220e-6, seed + 1, noise)

    def _rate_hz(self):
        code = self.registers[_CTRL_REG1] >> 4
        rate = self._RATES[code] if code < len(self._RATES) else 0
        return rate * (1 + self.clock_error)

    def _setting(self):
        mg = self._MG[self.registers[_CTRL_REG4] >> 4 & 3]
        return self._RATES[self.registers[_CTRL_REG1] >> 4] / 9, 32.768 * mg / 16, 16000 / mg

# SPDX-License-Identifier: MIT
"""The chips of a Pololu MinIMU-9 v2 as their bus sees them: L3GD20 and LSM303DLHC (accelerometer).

Devices for tools.virtual.bus, driven by a motion source, with the same sensing chain as the
MPU6050's (tools.virtual.chip.sensing). Sources: L3GD20 DocID022116, LSM303DLHC DocID018771.
Modelled is what a driver of samples touches: power, rate, range, auto-increment (bit 7 of the
register number), little-endian outputs, saturation, noise. FIFO, interrupts and the compass are
not.
"""

import numpy as np

from tools.virtual.chip.sensing import Triad, design
from tools.virtual.motion import Still

_CTRL_REG1, _CTRL_REG4 = 0x20, 0x23
_REMEMBER = 100  # samples to catch up at most: many time constants of either filter


class _StChip:
    """One of the two: registers, the pointer with its increment bit, sampling on a grid."""

    int_level = 0
    on_int = None

    def __init__(self, address, motion, bias, matrix, density, seed, noise):
        self.address = address
        self.motion = motion or Still()
        self.registers = bytearray(128)
        self.registers[_CTRL_REG1] = 0x07  # powered down, axes enabled
        self.now_ns = 0
        self._pointer, self._pointer_next, self._step_bit = 0, False, 0
        self._triad = Triad(bias, (0, 0, 0), matrix, np.random.default_rng(seed))
        self._triad.density = density if noise else 0.0
        self._done = -1
        self._temp_c = 25.0

    # bus

    def start(self, read):
        """Addressed; outputs are those of the last sample before the START."""
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
            if 0x20 <= self._pointer <= 0x25:
                self.registers[self._pointer] = value
                self._triad.restart()
                self._done = -1
            self._advance_pointer()
        return True

    def read(self):
        """A byte from the register pointed at."""
        value = self.registers[self._pointer]
        self._advance_pointer()
        return value

    def stop(self):
        """End of the transfer."""

    def advance(self, now_ns):
        """Let time pass; samples are computed when somebody reads."""
        self.now_ns = max(self.now_ns, now_ns)

    def next_event_ns(self):
        """Nothing happens by itself."""

    def truth(self, t_s):
        """True attitude (w, x, y, z), sensor to earth."""
        return self.motion.truth(t_s)

    def set_motion(self, motion):
        """Another motion source from now on."""
        self.motion = motion

    def _advance_pointer(self):
        if self._step_bit:
            self._pointer = (self._pointer + 1) & 0x7F

    # samples

    def _sample(self):
        rate = self._rate_hz()
        if not rate:
            return
        bandwidth, limit, per_unit = self._setting()
        self._triad.set_filter(design(bandwidth, None, rate), rate, limit)
        last = int(self.now_ns * rate // 1_000_000_000)
        first = max(self._done + 1, last - _REMEMBER)
        for n in range(first, last + 1):
            sample = self.motion.at(n / rate)
            self._temp_c = sample[6]
            self._triad.step(*sample[self.PLACE], self._temp_c)
        self._done = max(self._done, last)
        words = (int(np.clip(round(v * per_unit), -32768, 32767)) for v in self._triad.value)
        for k, word in enumerate(words):
            word &= self.MASK
            self.registers[0x28 + 2 * k : 0x2A + 2 * k] = (word & 0xFFFF).to_bytes(2, "little")


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
        return self._RATES[control >> 6] if control & 0x08 else 0

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
        return self._RATES[code] if code < len(self._RATES) else 0

    def _setting(self):
        mg = self._MG[self.registers[_CTRL_REG4] >> 4 & 3]
        return self._rate_hz() / 9, 32.768 * mg / 16, 16000 / mg

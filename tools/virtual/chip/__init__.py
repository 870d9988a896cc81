# SPDX-License-Identifier: MIT
"""The MPU6050 as its bus sees it (PS-MPU-6000A r3.4, RM-MPU-6000A r4.2), a device for Bus.

Driven in physical units by a motion source (tools.virtual.motion). What the datasheet leaves open
is chosen so that a driver which waits as told works, and one which does not fails: a device reset
takes 50 ms in which writes are lost, power-on takes 20 ms in which nothing answers, FIFO_RESET
works only while FIFO_EN is 0 (as the register map says), the gyro swings in for 30 ms.
"""

from tools.virtual.chip import registers as reg
from tools.virtual.chip.interrupts import CLEAR_ON_ANY_READ
from tools.virtual.chip.part import Part

RESET_NS = 50_000_000
_DEVICE_RESET = 0x80
_FIFO_ENABLED, _FIFO_RESET, _SIGNALS_RESET = 0x40, 0x04, 0x01
_SELF_CLEARING = 0x07  # of USER_CTRL
_FIFO = (reg.FIFO_COUNTH, reg.FIFO_COUNTL, reg.FIFO_R_W)
_FIRST_OUTPUT, _LAST_OUTPUT = reg.ACCEL_XOUT_H, reg.GYRO_ZOUT_L


class MPU6050Chip(Part):
    """One chip that has had its supply for long and is asleep, as after power-on.

    motion              source of true motion; None: still, level, 25 degC
    profile             a name of tools.virtual.chip.profiles, or a WHO_AM_I value
    seed, noise         noise, trim codes and factory offsets come from the seed
    clock_error         fraction by which the chip's clock runs fast, e.g. 0.01
    gyro_bias_dps, accel_bias_g, gyro_bias_dps_per_c, accel_bias_g_per_c (from 25 degC)
    gyro_matrix, accel_matrix   three rows: measured = matrix x true + bias (scale, cross-axis)
    trim_codes          ((gyro x, y, z), (accel x, y, z)); self_test_error: fraction off the trim

    `registers`, `fifo`, `trim`, `truth(t_s)` are the back door. ValueError: unknown profile.
    """

    _pointer = 0
    _pointer_next = False
    _in_transaction = False
    _latched = False
    _clears = False
    _latch_ns = 0
    _busy_until = 0
    _count_low = 0

    # bus

    def start(self, read):
        """Addressed; False without supply. The outputs are latched at the first START."""
        if not self._powered or self.now_ns < self._silent_until:
            return False
        if not self._in_transaction:
            self._in_transaction = True
            self._latch_ns = self.now_ns
            if self._eager:
                self._latch()
        self._pointer_next = not read
        self._clears = read
        return True

    def write(self, value):
        """A byte from the master: the register number first, then values; always acknowledged."""
        if not 0 <= value <= 255:
            raise ValueError(f"{value!r} is not a byte (0..255)")
        if self._pointer_next:
            self._pointer_next = False
            self._pointer = value & 0x7F
        else:
            self._write_register(self._pointer, value)
            if self._pointer != reg.FIFO_R_W:
                self._pointer = (self._pointer + 1) & 0x7F
        return True

    def read(self):
        """A byte to the master, from the register pointed at."""
        address = self._pointer
        if address != reg.FIFO_R_W:
            self._pointer = (address + 1) & 0x7F
        if _FIRST_OUTPUT <= address <= _LAST_OUTPUT:
            if not self._latched:
                self._latch()
            value = self.registers[address]
        else:
            value = self._read_register(address)
        if self._clears:  # once a transaction: what comes within a burst stays
            self._clears = False
            if self.registers[reg.INT_PIN_CFG] & CLEAR_ON_ANY_READ:
                self._pin.take()
        return value

    def _read_register(self, address):
        if address == reg.INT_STATUS:
            self._sync_events()
            return self._pin.take()
        if address in _FIFO:
            return self._read_fifo(address)
        if address == reg.PWR_MGMT_1:
            self._finish_reset()
        return self.registers[address]

    def stop(self):
        """STOP, or another address: the output registers follow the sensors again."""
        self._in_transaction = False
        self._latched = False

    def _latch(self):
        self._sync(self._latch_ns)
        self._latched = True

    def _held(self):
        return self._frozen or self._latched

    def _sync_events(self):
        if self.now_ns >= self._wake_ns:
            self._events(self.now_ns)

    def _read_fifo(self, address):
        self._sync(self.now_ns)
        if address == reg.FIFO_R_W:
            return self.fifo.pop()
        if address == reg.FIFO_COUNTH:  # reading the high byte latches the low one
            count = len(self.fifo)
            self._count_low = count & 0xFF
            return count >> 8
        return self._count_low

    # effects of writing

    def _write_register(self, address, value):
        self._finish_reset()
        if self.now_ns < self._busy_until or address in reg.READ_ONLY:
            return
        self._sync(self.now_ns)
        if address == reg.PWR_MGMT_1 and value & _DEVICE_RESET:
            self._clear_registers()
            self.registers[address] |= _DEVICE_RESET
            self._busy_until = self.now_ns + RESET_NS
            return
        if address == reg.FIFO_R_W:
            self.fifo.push(bytes([value]))
            return
        if address == reg.SIGNAL_PATH_RESET:
            self._reset_paths(value)
            return
        if address == reg.USER_CTRL:
            self._user_control(value)
            value &= ~_SELF_CLEARING
        self.registers[address] = value
        self._configure()

    def _finish_reset(self):
        if self._busy_until and self.now_ns >= self._busy_until:
            self._busy_until = 0
            self.registers[reg.PWR_MGMT_1] &= ~_DEVICE_RESET

    def _reset_paths(self, value):
        """SIGNAL_PATH_RESET: the filters start anew; the output registers stay."""
        if value & 0x04:
            self._gyro.restart()
        if value & 0x02:
            self._accel.restart()

    def _user_control(self, value):
        if value & _FIFO_RESET and not value & _FIFO_ENABLED:
            self.fifo.clear()
        if value & _SIGNALS_RESET:
            self._gyro.restart()
            self._accel.restart()
            self.registers[_FIRST_OUTPUT : _LAST_OUTPUT + 1] = bytes(14)

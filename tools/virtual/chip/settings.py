# SPDX-License-Identifier: MIT
"""What the configuration registers mean, and the output registers made from a sample."""

from tools.virtual.chip import registers as reg
from tools.virtual.chip.profiles import ACCEL_LSB_PER_G, GYRO_LSB_PER_DPS

_LP_WAKE_HZ = (1.25, 5.0, 20.0, 40.0)
_ODR_HZ = (0.24, 0.49, 0.98, 1.95, 3.91, 7.81, 15.63, 31.25, 62.5, 125.0, 250.0, 500.0)
_TEMP_DIS = 0x08
_NO_FILTER = (500.0, None, 1000)


class Settings:
    """The meaning of `registers` at one moment; make a new one after a write."""

    def __init__(self, registers, profile, trim):
        self._registers, self._profile = registers, profile
        self.accel_lsb = ACCEL_LSB_PER_G[registers[reg.ACCEL_CONFIG] >> 3 & 3]
        self.gyro_lsb = GYRO_LSB_PER_DPS[registers[reg.GYRO_CONFIG] >> 3 & 3]
        self.limits = (32768 / self.gyro_lsb, 32768 / self.accel_lsb)  # dps, g
        self.self_test_g = self._chosen(reg.ACCEL_CONFIG, trim.accel_g)
        self.self_test_dps = self._chosen(reg.GYRO_CONFIG, trim.gyro_dps)
        self._accel_counts, self._gyro_counts = self._offsets(trim.accel_offsets)
        standby = registers[reg.PWR_MGMT_2]
        self._accel_axes = [axis for axis in range(3) if not standby & 0x20 >> axis]
        self._gyro_axes = [axis for axis in range(3) if not standby & 0x04 >> axis]
        self._temperature = not registers[reg.PWR_MGMT_1] & _TEMP_DIS

    def _chosen(self, config, trim):
        """Self-test response of the axes whose bit (7, 6, 5) is set."""
        bits = self._registers[config]
        return tuple(value if bits & 0x80 >> axis else 0.0 for axis, value in enumerate(trim))

    def _offsets(self, factory):
        """Offset registers as counts to add: 2048 LSB per g from the factory's value (bit 0 is
        not part of it), 32.8 LSB per dps, whatever the range."""
        accel = []
        for address, value in zip(self._profile.accel_offsets, factory):
            moved = (self._word(address) & ~1) - (value & ~1)
            accel.append(moved / 2048 * self.accel_lsb)
        gyro = [self._word(reg.GYRO_OFFSET + 2 * n) / 32.8 * self.gyro_lsb for n in range(3)]
        return accel, gyro

    def _word(self, address):
        return int.from_bytes(self._registers[address : address + 2], "big", signed=True)

    def filter_rows(self):
        """The profile's rows for gyro and accelerometer."""
        code = self._registers[reg.CONFIG] & 7
        gyro = self._profile.gyro_filters[code]
        second = self._profile.accel_filter_register
        if second is None:
            return gyro, self._profile.accel_filters[code]
        setting = self._registers[second]
        if setting & 8:  # ACCEL_FCHOICE_B: no filter
            return gyro, _NO_FILTER
        return gyro, self._profile.accel_filters[setting & 7]

    def cycle_hz(self):
        """Wake-ups per second in cycle mode."""
        if self._profile.cycle == "lp_wake":
            return _LP_WAKE_HZ[self._registers[reg.PWR_MGMT_2] >> 6]
        if self._profile.cycle == "odr":
            return _ODR_HZ[min(self._registers[reg.LP_ODR] & 15, 11)]
        return 1000.0 / (1 + self._registers[reg.SMPLRT_DIV])

    def put(self, sample, registers):
        """Write a sample ((g), (dps), degC) as counts; axes in standby keep their old value."""
        accel, gyro, temp_c = sample
        for n in self._accel_axes:
            counts = accel[n] * self.accel_lsb + self._accel_counts[n]
            _put(registers, reg.ACCEL_XOUT_H + 2 * n, counts)
        for n in self._gyro_axes:
            counts = gyro[n] * self.gyro_lsb + self._gyro_counts[n]
            _put(registers, reg.GYRO_XOUT_H + 2 * n, counts)
        if self._temperature:
            counts = (temp_c - self._profile.temp_zero_c) * self._profile.temp_lsb_per_c
            _put(registers, reg.TEMP_OUT_H, counts)


def packet(registers, enabled):
    """The output registers that FIFO_EN chooses, in register order."""
    chosen = b""
    if enabled & 0x08:
        chosen += registers[reg.ACCEL_XOUT_H : reg.TEMP_OUT_H]
    if enabled & 0x80:
        chosen += registers[reg.TEMP_OUT_H : reg.GYRO_XOUT_H]
    if enabled & 0x70 == 0x70:
        return chosen + registers[reg.GYRO_XOUT_H : reg.GYRO_ZOUT_L + 1]
    for axis in range(3):
        if enabled & 0x40 >> axis:
            address = reg.GYRO_XOUT_H + 2 * axis
            chosen += registers[address : address + 2]
    return chosen


def _put(registers, address, value):
    count = round(value)
    if not -32768 <= count <= 32767:
        count = -32768 if count < 0 else 32767
    registers[address] = count >> 8 & 0xFF
    registers[address + 1] = count & 0xFF

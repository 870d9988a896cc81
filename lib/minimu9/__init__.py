# SPDX-License-Identifier: MIT
"""Pololu MinIMU-9 v2 (paper 002's sensor): L3GD20 gyro and LSM303DLHC accelerometer.

The same interface as mpu6050.MPU6050, and the same counts: read() scales both chips to the
MPU6050's counts per g and per deg/s at the same range, so filters and the app take either sensor.
The two chips sample on their own clocks and are read one after the other: not one instant.
Needs lib/mpu6050 beside it, for what both sensors share: ranges and verified registers.
Sources: L3GD20 data sheet DocID022116, LSM303DLHC DocID018771; register names as there.
"""

import time
from array import array
from math import pi

import micropython
from micropython import const
from mpu6050 import ranges
from mpu6050.registers import Registers

_WHO_AM_I = const(0x0F)  # gyro only: the accelerometer has no documented one
_CTRL_REG1 = const(0x20)  # gyro DR [7:6] BW [5:4] PD [3] axes [2:0]; accel ODR [7:4] axes [2:0]
_CTRL_REG3 = const(0x22)  # gyro I2_DRDY [3]: data ready on the pin DRDY
_CTRL_REG4 = const(0x23)  # BDU [7], FS [5:4]; accel HR [3]
_CTRL_REG5 = const(0x24)  # BOOT [7]: registers and trim as after power-on
_GYRO_OUT = const(0xA6)  # OUT_TEMP, STATUS, OUT_X_L...: 0x26 with the auto-increment bit
_ACCEL_OUT = const(0xA8)  # OUT_X_L_A...: 0x28 with the auto-increment bit
_GYRO_760HZ = const(0xCF)  # 760 Hz, awake, all axes; low-pass BW [5:4]
_ACCEL_400HZ = const(0x77)
_GYRO_ID = const(0xD4)
_EIO = const(5)

# full scale, FS code, mdps per digit | g, FS code, mg per digit of the upper 12 bits
_GYRO = ((250, 0, 8.75), (500, 1, 17.5), (2000, 2, 70.0))
_ACCEL = ((2, 0, 1.0), (4, 1, 2.0), (8, 2, 4.0), (16, 3, 12.0))
_LOW_PASS_HZ = (30, 35, 50, 100)  # of the gyro at 760 Hz, by BW


@micropython.viper
def _scale(raw: ptr8, n: int, counts: ptr16, at: int, factor: int):
    """counts[at + k] = little-endian words of raw, times factor / 2^14, saturated."""
    k = 0
    while k < n:
        value = ((int(raw[2 * k]) | int(raw[2 * k + 1]) << 8) ^ 0x8000) - 0x8000
        value = (value * factor + 8192) >> 14
        if value > 32767:
            value = 32767
        elif value < -32768:
            value = -32768
        counts[at + k] = value & 0xFFFF
        k += 1


@micropython.viper
def _alike(raw: ptr8, n: int) -> int:
    """1 when all bytes are one and the same."""
    k = 1
    while k < n:
        if raw[k] != raw[0]:
            return 0
        k += 1
    return 1


class _Chip(Registers):
    def __init__(self, i2c, address, name, rows):
        super().__init__(i2c, address)
        self.NAME = name
        control1, control4 = rows
        self._table.extend(bytes((_CTRL_REG1, control1, 0xFF, _CTRL_REG4, control4, 0xFF)))


class _Profile:
    """What mpu6050.profiles tells of its parts."""

    name = "MinIMU-9 v2"
    temp_lsb_per_c = 1.0
    temp_offset_c = 0.0


class MinIMU9:
    """Both chips, woken, configured and verified. `counts`: ax ay az temp gx gy gz.

    gyro_dps 250, 500 or 2000; accel_g 2, 4, 8 or 16; dlpf_hz: the gyro's low-pass is the nearest
    of 30, 35, 50 and 100 Hz. Gyro 760 Hz, accelerometer 400 Hz. wait_ms: so long the chips may
    take to answer. OSError says what was seen; ValueError lists what can be set.
    """

    split, burst = False, None
    asleep = False
    profile = _Profile
    rate_hz = 760.0

    def __init__(self, i2c, address=0x6B, accel_address=0x19, gyro_dps=500, accel_g=8,
                 dlpf_hz=100, wait_ms=200, lock=None):  # fmt: skip
        self._choose(gyro_dps, accel_g, dlpf_hz)
        self.address = address
        self.counts = array("h", (0, 0, 0, 0, 0, 0, 0))
        self._gyro_raw, self._accel_raw = bytearray(8), bytearray(6)
        self._gyro_words = memoryview(self._gyro_raw)[2:]
        self._gyro = _Chip(i2c, address, "L3GD20", self._gyro_rows())
        self._accel = _Chip(i2c, accel_address, "LSM303DLHC", self._accel_rows())
        self._turn = self._gyro
        self.lock = lock
        self.who_am_i = self._identify(wait_ms)
        self.configure()

    def _choose(self, gyro_dps, accel_g, dlpf_hz):
        """Take these settings' codes and factors. ValueError, and then nothing has changed."""
        gyro = _row(_GYRO, gyro_dps, "gyro_dps")
        accel = _row(_ACCEL, accel_g, "accel_g")
        off = [abs(hz - dlpf_hz) for hz in _LOW_PASS_HZ]
        self._codes = off.index(min(off)), gyro[0], accel[0]
        self.gyro_lsb_per_dps = ranges.gyro(gyro_dps)[1]
        self.accel_lsb_per_g = ranges.accel(accel_g)[1]
        self.gyro_range_dps, self.accel_range_g, self.dlpf_hz = gyro_dps, accel_g, dlpf_hz
        self._gyro_factor = round(gyro[1] / 1000 * self.gyro_lsb_per_dps * 16384)
        self._accel_factor = round(accel[1] / 16000 * self.accel_lsb_per_g * 16384)

    def _gyro_rows(self):
        return _GYRO_760HZ | self._codes[0] << 4, 0x80 | self._codes[1] << 4

    def _accel_rows(self):
        return _ACCEL_400HZ, 0x88 | self._codes[2] << 4

    @property
    def delay_s(self):
        """Of the gyro's low-pass, first order; the data sheet gives none."""
        return 1 / (2 * pi * _LOW_PASS_HZ[self._codes[0]])

    def set_range(self, gyro_dps=None, accel_g=None):
        """Change full scales (deg/s, g) and with them the scale of all that is read later."""
        self.set_up(gyro_dps, accel_g)

    def set_up(self, gyro_dps=None, accel_g=None, dlpf_hz=None, rate_hz=None):
        """Other settings (None: as they are) for chips that go on measuring; the rates stay.

        ValueError before anything is written, OSError when a chip does not take them.
        """
        self._choose(
            gyro_dps or self.gyro_range_dps,
            accel_g or self.accel_range_g,
            dlpf_hz or self.dlpf_hz,
        )
        for chip, rows in ((self._gyro, self._gyro_rows()), (self._accel, self._accel_rows())):
            chip.set_bits(_CTRL_REG1, rows[0], 0xFF)
            chip.set_bits(_CTRL_REG4, rows[1], 0xFF)

    def _identify(self, wait_ms):
        seen = {}  # type: dict
        who = self._gyro.ask(_WHO_AM_I, (_GYRO_ID,), wait_ms, seen)
        if who is None and min(seen) < 0:
            text = "no L3GD20 at 0x%02X: check wiring and power; SDO low is 0x6A"
            raise OSError(-min(seen), text % self.address)
        if who != _GYRO_ID:
            most = max(seen, key=seen.get)
            text = "0x%02X: WHO_AM_I reads 0x%02X, expected 0x%02X (L3GD20)"
            raise OSError(_EIO, text % (self.address, most, _GYRO_ID))
        return who

    def read(self):
        """Fetch one sample of each chip into `counts`. OSError when the bus fails."""
        if self.lock:
            with self.lock:
                got = self.fetch()
        else:
            got = self.fetch()
        if got < 0:
            raise OSError(-got)

    @property
    def lock(self):
        """A context manager to be held during each transfer, or None."""
        return self._gyro.lock

    @lock.setter
    def lock(self, lock):
        self._gyro.lock = self._accel.lock = lock

    @micropython.native
    def fetch(self):
        """read() for a tick, which may not raise: 1, or -errno. Takes no lock."""
        accel, gyro, counts = self._accel, self._gyro, self.counts
        try:
            accel.bus.readfrom_mem_into(accel.address, _ACCEL_OUT, self._accel_raw)
            gyro.bus.readfrom_mem_into(gyro.address, _GYRO_OUT, self._gyro_raw)
        except OSError as error:
            return -(error.errno or _EIO)
        _scale(self._accel_raw, 3, counts, 0, self._accel_factor)
        _scale(self._gyro_words, 3, counts, 4, self._gyro_factor)
        counts[3] = 0x80 - (self._gyro_raw[0] ^ 0x80)  # the chip counts down as it warms
        if not self.plausible():
            for i in range(7):
                counts[i] = 0  # a fill pattern after the scaling too
        return 1

    poll = fetch

    def expire(self, age_us):
        """Nothing: poll() reads what is of now."""

    def start(self):
        """Nothing: collect() reads."""

    def collect(self):
        """Read both chips; True."""
        self.read()
        return True

    def finish(self):
        """No burst is ever under way."""

    @micropython.native
    def plausible(self):
        """False when the last sample is a fill pattern: a dead line, a broken transfer.

        The gyro with its temperature and status all one byte, or the accelerometer all 0xFF or
        0xFE, which its 12 bits cannot send.
        """
        accel = self._accel_raw
        return not (_alike(self._gyro_raw, 8) or (accel[0] >= 0xFE and _alike(accel, 6)))

    def same_part(self):
        """Whether the gyro is still the one that was identified. OSError."""
        seen = bytearray(1)
        self._gyro.load(_WHO_AM_I, seen)
        return seen[0] == self.who_am_i

    def adopt(self):
        """False: there is no other part that fits in its place."""
        return False

    def data_ready(self, enable=True):
        """Signal each fresh gyro sample on DRDY, high until it is read."""
        self._gyro.set_bits(_CTRL_REG3, 0x08 if enable else 0, 0x08)

    def accel_g(self):
        """(x, y, z) specific force in g of the last sample."""
        c, lsb = self.counts, self.accel_lsb_per_g
        return c[0] / lsb, c[1] / lsb, c[2] / lsb

    def gyro_dps(self):
        """(x, y, z) rate in degrees per second of the last sample."""
        c, lsb = self.counts, self.gyro_lsb_per_dps
        return c[4] / lsb, c[5] / lsb, c[6] / lsb

    def temp_c(self):
        """Degrees Celsius above an offset that the data sheet leaves open: for changes only."""
        return float(self.counts[3])

    def wake(self):
        """Nothing: it never sleeps."""

    def configure(self):
        """Apply both tables and verify them. OSError names the first bad register."""
        self._gyro.apply_all()
        self._accel.apply_all()

    def reset(self):
        """Reboot both chips and wait; configure() brings back the settings."""
        self.reset_chip()
        time.sleep_ms(100)

    def reset_chip(self):
        """Reboot both chips; repair() or configure() after 100 ms brings back the settings."""
        for chip in (self._gyro, self._accel):
            chip.store(_CTRL_REG1, 0x07)
            chip.store(_CTRL_REG5, 0x80)

    def reset_paths(self):
        """Nothing: a reboot has no second step here."""

    @property
    def bus(self):
        """The bus object in use."""
        return self._gyro.bus

    def use_bus(self, i2c):
        """Work on this bus object from now on."""
        self._gyro.bus = self._accel.bus = i2c

    @property
    def rows(self):
        """How many rows both tables have."""
        return self._gyro.rows + self._accel.rows

    def rewind(self):
        """Let the next check() or repair() begin with the first row."""
        self._gyro.rewind()
        self._accel.rewind()
        self._turn = self._gyro

    def check(self):
        """Compare the next row with its chip: False when it differs. One short transaction."""
        chip = self._turn
        self._turn = self._accel if chip is self._gyro else self._gyro
        return chip.check()

    def recheck(self):
        """Compare the row of the last check() once more: one bit of the answer may be wrong."""
        return (self._accel if self._turn is self._gyro else self._gyro).recheck()

    def repair(self):
        """Write and verify the next row; True after the last one of both chips. OSError."""
        if not self._turn.repair():
            return False
        done = self._turn is self._accel
        self._turn = self._gyro if done else self._accel
        return done


def _row(table, wanted, name):
    for row in table:
        if row[0] == wanted:
            return row[1:]
    raise ValueError("%s=%s: choose one of %s" % (name, wanted, [row[0] for row in table]))

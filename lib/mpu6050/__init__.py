# SPDX-License-Identifier: MIT
"""MPU6050 accelerometer and gyroscope on any object with MicroPython's I2C methods.

`read()` fetches, `accel_g()`, `gyro_dps()` and `temp_c()` convert. Frame: the sensor's own,
right-handed; flat and level reads +1 g on z. Sources: RM = register map RM-MPU-6000A r4.2,
PS = product specification PS-MPU-6000A r3.4.

What the app asks of a sensor; minimu9.MinIMU9 is another one:

- `counts`: array 'h' of ax ay az temp gx gy gz, the same one for as long as it lives
- `gyro_lsb_per_dps`, `accel_lsb_per_g`, `gyro_range_dps`, `accel_range_g`, `rate_hz`, `dlpf_hz`,
  `delay_s` (the gyro's low-pass); `who_am_i`, `address`; `profile` with `name`, `temp_lsb_per_c`,
  `temp_offset_c`; `split`: start() works in the background; `asleep`: wake() is needed
- for the foreground, OSError when the bus fails: `read()`; `plausible()`, `accel_g()`,
  `gyro_dps()`, `temp_c()` of what it fetched; `lock`: held in each transfer, or None
- for the tick, which take no lock and never raise: `start()`, `poll()` and `fetch()` (1, or
  -errno; poll() 0: nothing of now), `expire(age_us)`; `finish()`: the bus is free now.
  `burst`: poll() as a function and its three arguments where that costs less, or None.
  `collect()`: poll() for a loop of one's own, OSError
- settings: `set_up(gyro_dps, accel_g, dlpf_hz, rate_hz)`, `data_ready(enable)`, `use_bus(i2c)`;
  `bus`: the one in use
- whether it keeps them, row by row: `rows`, `rewind()`, `check()`, `recheck()`, `repair()`;
  whether it is the same: `same_part()`, `adopt()`; anew: `reset_chip()` and 100 ms later
  `reset_paths()`, which is `reset()`, then `configure()`; `wake()`
"""

import sys
import time
from array import array

import micropython
from micropython import const

from mpu6050 import ranges
from mpu6050.profiles import filter_row, identify, take_on
from mpu6050.registers import Registers

# [bits] that the driver uses; names as in RM section 3
_SMPLRT_DIV = const(0x19)
_CONFIG = const(0x1A)  # EXT_SYNC_SET [5:3] is left alone, DLPF_CFG [2:0]
_GYRO_CONFIG = const(0x1B)  # XG_ST YG_ST ZG_ST [7:5], FS_SEL [4:3]
_ACCEL_CONFIG = const(0x1C)  # XA_ST YA_ST ZA_ST [7:5], AFS_SEL [4:3]
_ACCEL_CONFIG_2 = const(0x1D)  # of the MPU-6500 family: A_DLPF_CFG [2:0]
_FIFO_EN = const(0x23)
# INT_LEVEL [7], INT_OPEN [6], LATCH_INT_EN [5], INT_RD_CLEAR [4], I2C_BYPASS_EN [1]
_INT_PIN_CFG = const(0x37)
_INT_ENABLE = const(0x38)  # DATA_RDY_EN [0]
_ACCEL_XOUT_H = const(0x3B)  # accelerometer, temperature, gyro: 14 bytes, high byte first
_SIGNAL_PATH_RESET = const(0x68)  # GYRO ACCEL TEMP [2:0]
_USER_CTRL = const(0x6A)  # FIFO_EN [6], I2C_MST_EN [5], resets [2:0] clear themselves
_PWR_MGMT_1 = const(0x6B)  # DEVICE_RESET [7], SLEEP [6], CYCLE [5], TEMP_DIS [3], CLKSEL [2:0]
_PWR_MGMT_2 = const(0x6C)  # LP_WAKE_CTRL [7:6], standby of each axis [5:0]
_WHO_AM_I = const(0x75)

_PLL_GYRO_X = const(0x01)  # CLKSEL: RM p. 41 recommends a gyro's clock over the internal one
_IDLE = array("i", (0,))  # stands for a Split's words where there is none
_EIO = const(5)
_GYRO_START_MS = const(35)  # PS p. 12: 30 ms from sleep to within 1 % of the final value


@micropython.viper
def _swap(burst: ptr8, counts: ptr8):
    """Big-endian words of the chip to the little-endian ones of every supported board."""
    i = 0
    while i < 14:
        counts[i] = burst[i + 1]
        counts[i + 1] = burst[i]
        i += 2


class MPU6050(Registers):
    """The sensor, woken, configured and verified.

    gyro_dps: 250, 500, 1000 or 2000; accel_g: 2, 4, 8 or 16; dlpf_hz: accelerometer bandwidth
    260, 184, 94, 44, 21, 10 or 5 (the gyro's is the same within 5 %); rate_hz: nearest possible
    rate of fresh samples, the true one is then in `.rate_hz`. ValueError for any other setting;
    OSError that says what was seen and what to check when the sensor cannot be used.

    allow_unknown: take a part of an unknown WHO_AM_I for an MPU6050. wait_ms: so long it may take
    to answer. attach: it measures already and shall go on, without a reset: what differs from
    the settings is written, nothing else; the causes of interrupts stay to be read. lock: see
    above; for a bus that others use already.
    """

    NAME = "MPU6050"

    def __init__(self, i2c, address=0x68, gyro_dps=500, accel_g=8, dlpf_hz=44, rate_hz=1000,
                 allow_unknown=False, wait_ms=200, attach=False, seen=None,
                 lock=None):  # fmt: skip
        gyro_code, self.gyro_lsb_per_dps = ranges.gyro(gyro_dps)
        accel_code, self.accel_lsb_per_g = ranges.accel(accel_g)
        dlpf_code, gyro_rate = ranges.dlpf(dlpf_hz)
        divider = ranges.divider(gyro_rate, rate_hz)
        self.gyro_range_dps, self.accel_range_g, self.dlpf_hz = gyro_dps, accel_g, dlpf_hz
        super().__init__(i2c, address)
        self.lock = lock
        self.counts = array("h", (0, 0, 0, 0, 0, 0, 0))
        self._burst = bytearray(14)
        self._split, self._busy, self.burst = None, _IDLE, None
        self.use_bus(i2c)
        seen = {} if seen is None else seen
        self.who_am_i, self.profile = identify(self, allow_unknown, wait_ms, seen)
        # (register, value, mask) row after row; waking comes first, or nothing else works
        self._table.extend(bytes((
            _PWR_MGMT_1, _PLL_GYRO_X, 0xEF,
            _PWR_MGMT_2, 0, 0xFF,
            _SMPLRT_DIV, divider, 0xFF,
            _CONFIG, dlpf_code, 0x07,
            _GYRO_CONFIG, gyro_code << 3, 0xF8,
            _ACCEL_CONFIG, accel_code << 3, 0xF8,
            _FIFO_EN, 0, 0xFF,
            _INT_PIN_CFG, 0, 0xF0,
            _INT_ENABLE, 0, 0xFF,
            _USER_CTRL, 0, 0x60,
        )))  # fmt: skip
        self.rate_hz = gyro_rate / (1 + divider)
        if self.profile.accel_filter and gyro_rate == 8000:
            self.rate_hz = 8000.0  # RM-MPU-6500A p. 12: the divider works at 1 kHz only
        filter_row(self)
        if attach:
            from mpu6050.attach import attach_to

            if attach_to(self):
                time.sleep_ms(_GYRO_START_MS)
        else:
            self.reset()
            self.configure()

    def use_bus(self, i2c):
        """Work on this bus object from now on, for instance after a bus recovery."""
        if self.lock:
            with self.lock:
                self._use_bus(i2c)
        else:
            self._use_bus(i2c)

    def _use_bus(self, i2c):
        self.bus = i2c
        if sys.platform == "rp2" and str(i2c).startswith("I2C("):
            if self._split:
                self._split.use_bus(i2c)
            else:
                from mpu6050.split_rp2 import Split

                self._split = split = Split(i2c, self.address, self.counts)
                # on the instance, so that no Python method stands in between: 12 us a call
                self.start, self.collect, self.poll = split.start, split.collect, split.poll
            self._busy, self.burst = self._split.busy, self._split.burst
        elif self._split:
            self._split, self._busy, self.burst = None, _IDLE, None
            del self.start, self.collect, self.poll

    @property
    def split(self):
        """Whether start() runs the burst in the background, so that collecting it costs less."""
        return self._split is not None

    @property
    def delay_s(self):
        """How old the gyro's low-pass makes a sample, seconds."""
        return ranges.delay_s(self.dlpf_hz, self.profile.family)

    def read(self):
        """Fetch one sample into `counts`: one 14-byte burst, one instant. OSError on failure."""
        if self.lock:
            with self.lock:
                self._read()
        else:
            self._read()

    def _read(self):
        if self._busy[0]:
            self._split.finish()
        self.bus.readfrom_mem_into(self.address, _ACCEL_XOUT_H, self._burst)
        _swap(self._burst, self.counts)

    def start(self):
        """Begin a burst and return at once; on RP2 it runs in the background (split_rp2.py)."""

    def collect(self):
        """True when the burst has arrived in `counts`, False while the bus works; OSError."""
        self.read()
        return True

    @micropython.native
    def fetch(self):
        """read() for a tick, which may not raise: 1, or -errno. Takes no lock."""
        if self._busy[0]:
            self._split.finish()  # of another sensor on the same wires
        try:
            self.bus.readfrom_mem_into(self.address, _ACCEL_XOUT_H, self._burst)
        except OSError as error:
            return -(error.errno or _EIO)
        _swap(self._burst, self.counts)
        return 1

    def poll(self):
        """For a tick: 1 when the burst that start() began has arrived in `counts`, 0 when there
        is none of now, else -errno. Takes no lock, never raises.
        """
        return self.fetch()

    def expire(self, age_us):
        """A burst that start() began longer ago than this is not of now: poll() drops it."""
        if self._split:
            self._split.expire(age_us)

    @micropython.native
    def finish(self):
        """Wait for a burst under way, still to be collected: then others may use the bus."""
        if self._busy[0]:
            self._split.finish()

    def plausible(self):
        """False when the last burst is a fill pattern: a chip asleep (0), a dead line (0xFF)...

        All seven words equal, or the last four filled with the 0xFE of a broken transfer. Four
        zeros or 0xFFFF may be a clone's gyro at rest, at the zero of its temperature register.
        """
        c = self.counts
        gx = c[4]
        if not (gx == c[5] == c[6] == c[3]):
            return True
        return not (gx == -258 or gx == c[0] == c[1] == c[2])

    def same_part(self):
        """Whether the part that answers now is still the one that was identified. OSError."""
        self.load(_WHO_AM_I, self._byte)
        return self._byte[0] == self.who_am_i

    def adopt(self):
        """Take on the other part that same_part() has seen; False when it is unknown.

        What it needs is in the table then, to be applied by configure() or repair().
        """
        return take_on(self, self._byte[0])

    def accel_g(self):
        """(x, y, z) specific force in g of the last sample."""
        c, lsb = self.counts, self.accel_lsb_per_g
        return c[0] / lsb, c[1] / lsb, c[2] / lsb

    def gyro_dps(self):
        """(x, y, z) rate in degrees per second of the last sample."""
        c, lsb = self.counts, self.gyro_lsb_per_dps
        return c[4] / lsb, c[5] / lsb, c[6] / lsb

    def temp_c(self):
        """Temperature of the chip in degrees Celsius of the last sample."""
        return self.counts[3] / self.profile.temp_lsb_per_c + self.profile.temp_offset_c

    def reset(self):
        """Reset the chip by the sequence of RM p. 41; it sleeps then, until configure()."""
        self.reset_chip()
        time.sleep_ms(100)
        self.reset_paths()
        time.sleep_ms(100)

    def reset_chip(self):
        """First step of a reset, for a loop that cannot wait; reset_paths() after 100 ms."""
        self.store(_PWR_MGMT_1, 0x80)

    def reset_paths(self):
        """Second step; the chip is ready for its configuration after another 100 ms."""
        self.store(_SIGNAL_PATH_RESET, 0x07)

    def configure(self):
        """Apply the whole table, verify it, and wait until the gyro has started. OSError."""
        self.apply_all()
        time.sleep_ms(_GYRO_START_MS)

    def set_range(self, gyro_dps=None, accel_g=None):
        """Change full scales (deg/s, g) and with them the scale of all that is read later."""
        self.set_up(gyro_dps, accel_g)

    def set_up(self, gyro_dps=None, accel_g=None, dlpf_hz=None, rate_hz=None):
        """Other settings (None: as they are) for a chip that goes on measuring: registers
        written and verified, scales changed with them. ValueError before anything is written,
        OSError when the chip does not take them: then call it again, or configure().
        """
        gyro_dps = gyro_dps or self.gyro_range_dps
        accel_g = accel_g or self.accel_range_g
        gyro_code, gyro_lsb = ranges.gyro(gyro_dps)
        accel_code, accel_lsb = ranges.accel(accel_g)
        dlpf_code, gyro_rate = ranges.dlpf(dlpf_hz or self.dlpf_hz)
        divider = ranges.divider(gyro_rate, rate_hz or self.rate_hz)
        self.set_bits(_SMPLRT_DIV, divider, 0xFF)
        self.set_bits(_CONFIG, dlpf_code, 0x07)
        self.set_bits(_GYRO_CONFIG, gyro_code << 3, 0x18)
        self.set_bits(_ACCEL_CONFIG, accel_code << 3, 0x18)
        if self.profile.accel_filter:
            self.set_bits(_ACCEL_CONFIG_2, dlpf_code, 0x0F)
        self.gyro_range_dps, self.gyro_lsb_per_dps = gyro_dps, gyro_lsb
        self.accel_range_g, self.accel_lsb_per_g = accel_g, accel_lsb
        self.dlpf_hz, self.rate_hz = dlpf_hz or self.dlpf_hz, gyro_rate / (1 + divider)
        if self.profile.accel_filter and gyro_rate == 8000:
            self.rate_hz = 8000.0

    def data_ready(self, enable=True, active_low=False, latch=False):
        """Signal each fresh sample on INT: a 50 us pulse, or a level held until the next read.

        Not enabled: INT's level and latch are set all the same.
        """
        pin = 0x10 | (0xC0 if active_low else 0) | (0x20 if latch else 0)  # low: open drain
        self.set_bits(_INT_PIN_CFG, pin, 0xF0)
        self.set_bits(_INT_ENABLE, 1 if enable else 0, 0x01)

    def bypass(self, on=True):
        """Connect the wires behind the chip (XDA, XCL) to its bus: a magnetometer there answers
        like any other device. It stays so when settings change and after a mended fault.
        """
        self.set_bits(_USER_CTRL, 0, 0x20)  # the chip is no master there
        self.set_bits(_INT_PIN_CFG, 0x02 if on else 0, 0x02)

    @property
    def asleep(self):
        """Whether sleep() or cycle() was called last, and not wake()."""
        return bool(self.wanted(_PWR_MGMT_1) & 0x60)

    def sleep(self):
        """Stop measuring, 5 uA; registers stay, samples read as they were."""
        self.set_bits(_PWR_MGMT_1, 0x40, 0x60)

    def wake(self):
        """Measure again after sleep() or cycle(); returns when the gyro has started."""
        self.set_bits(_PWR_MGMT_2, 0, 0xFF)
        self.set_bits(_PWR_MGMT_1, _PLL_GYRO_X, 0x6F)
        time.sleep_ms(_GYRO_START_MS)

    def cycle(self, hz):
        """Accelerometer only, woken 1.25, 5, 20 or 40 times a second (10 to 140 uA)."""
        from mpu6050.motion import cycle

        cycle(self, hz)

    def _load(self, register, buffer):
        if self._busy[0]:
            self._split.finish()
        self.bus.readfrom_mem_into(self.address, register, buffer)

    def _store(self, register, value):
        self.finish()
        super()._store(register, value)

# SPDX-License-Identifier: MIT
"""The chip's own FIFO: it collects every sample, a slower loop takes them in bursts.

A packet is 14 bytes, accelerometer, temperature and gyro in register order, or 12 without the
temperature. The FIFO size is no multiple of either, so a full FIFO has dropped bytes and its
packets are misaligned (RM p. 39); then, and after a broken transfer, only a reset helps.
"""

from array import array

import micropython
from micropython import const

_FIFO_EN = const(0x23)  # TEMP [7], XG YG ZG [6:4], ACCEL [3]
_USER_CTRL = const(0x6A)  # FIFO_EN [6], FIFO_RESET [2]
_FIFO_COUNTH = const(0x72)  # reading the high byte first latches both (RM p. 39)
_FIFO_R_W = const(0x74)

_CHUNK = const(8)  # packets of one burst: 2.6 ms at 400 kHz
_TEMP_STEP = const(700)  # counts, 2 degC: no chip warms so much from one sample to the next
_UNKNOWN = const(-32768)


@micropython.viper
def _unpack(data: ptr8, at: int, counts: ptr8, with_temp: int):
    i = 0
    while i < 14:
        if i == 6 and not with_temp:
            i = 8
        counts[i] = data[at + 1]
        counts[i + 1] = data[at]
        at += 2
        i += 2


class Fifo:
    """Samples of an MPU6050 collected by the chip at its `rate_hz`.

    `counts` is as the driver's (without `temp` its temperature stays 0). Counters: `samples`
    delivered, `overflows` and `misaligned` (each means samples were lost and the FIFO was reset).
    """

    def __init__(self, imu, temp=True):
        self._imu = imu
        self._temp = temp
        self._packet = packet = 14 if temp else 12
        self._limit = imu.profile.fifo_bytes - 2 * packet
        self._data = bytearray(_CHUNK * packet)
        view = memoryview(self._data)
        self._views = [view[: (n + 1) * packet] for n in range(_CHUNK)]  # slices made once
        self._count = bytearray(2)
        self._last_temp = _UNKNOWN
        self._broken = False  # a transfer failed half-way: nobody knows how many bytes are gone
        self.counts = array("h", (0, 0, 0, 0, 0, 0, 0))
        self.samples = self.overflows = self.misaligned = 0

    def start(self):
        """Empty the FIFO and begin to collect. OSError when the bus fails."""
        self._imu.set_bits(_FIFO_EN, 0xF8 if self._temp else 0x78, 0xFF)
        self.reset()

    def stop(self):
        """Collect no more. OSError when the bus fails."""
        self._imu.set_bits(_FIFO_EN, 0, 0xFF)
        self._imu.set_bits(_USER_CTRL, 0, 0x40)

    def reset(self):
        """Throw away what has been collected and go on aligned. OSError when the bus fails."""
        # FIFO_RESET acts only while FIFO_EN is 0 (RM p. 38)
        self._imu.store(_USER_CTRL, 0)
        self._imu.store(_USER_CTRL, 0x04)
        self._imu.set_bits(_USER_CTRL, 0x40, 0x40)
        self._last_temp = _UNKNOWN
        self._broken = False

    def waiting(self):
        """Whole packets in the FIFO; 0 after an overflow or misalignment, which is mended."""
        size = self._bytes()
        if size > self._limit:
            self.overflows += 1
            self.reset()
            return 0
        if size % self._packet and self._bytes() % self._packet:  # twice: not just being filled
            self.misaligned += 1
            self.reset()
            return 0
        return size // self._packet

    def read(self, update):
        """Call update(counts) for each sample waiting, oldest first; returns how many.

        Nothing is allocated (keep `update` in a variable: a bound method is made anew each time
        it is named). OSError when the bus fails; the FIFO is then reset by the next call.
        """
        if self._broken:
            self.misaligned += 1
            self.reset()
        waiting = self.waiting()
        done = 0
        while done < waiting:
            n = min(waiting - done, _CHUNK)
            self._broken = True
            self._imu.load(_FIFO_R_W, self._views[n - 1])
            self._broken = False
            for i in range(n):
                if not self._take(i * self._packet):
                    self.misaligned += 1
                    self.reset()
                    return done
                update(self.counts)
                done += 1
                self.samples += 1
        return done

    def _bytes(self):
        self._imu.load(_FIFO_COUNTH, self._count)
        return self._count[0] << 8 | self._count[1]

    def _take(self, at):
        """Unpack one packet; False when its temperature shows that it cannot be one."""
        _unpack(self._data, at, self.counts, self._temp)
        if not self._temp:
            return True
        temp, last = self.counts[3], self._last_temp
        self._last_temp = temp
        return last == _UNKNOWN or -_TEMP_STEP < temp - last < _TEMP_STEP

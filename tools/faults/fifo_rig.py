# SPDX-License-Identifier: MIT
"""The same watch over a program that reads the chip's FIFO fifty times a second."""

from array import array

from tools.faults.rig import REST_S, SETTLE_S, Rig

RATE_HZ = 250
READ_EVERY_S = 0.02


class FifoRig(Rig):
    """A reader of the FIFO with the integer Attitude behind it, bridged like the app's."""

    SPREAD_S = (0.006, 0.018)  # when there are samples in the FIFO

    def _begin(self):
        from attitude.fixed import Attitude
        from calibration import Calibration
        from mpu6050 import MPU6050
        from mpu6050.fifo import Fifo

        from firmware.board import find
        from firmware.tick import judge as guard
        from firmware.tick import words
        from firmware.tick.gap import Gap

        imu = MPU6050(find().i2c(), rate_hz=RATE_HZ)
        self.fifo = Fifo(imu)
        self.estimate = Attitude(rate_hz=RATE_HZ)
        self.estimate.calibrate(Calibration(gyro_bias_dps=(2.0, -1.5, 1.0)))
        self.memory = guard.memory()
        self.judge = guard.judge
        self.before = array("h", [0] * 7)  # the last good burst
        self.gap = Gap(words.make())
        self.lost = 0
        self.seen_s = self.now_s
        self.fifo.start()
        self.run(REST_S + SETTLE_S - self.now_s)

    def run(self, seconds):
        """Let virtual time pass, reading as the program would."""
        end = self.now_s + seconds
        while self.now_s < end:
            self.port.run_ms(min(READ_EVERY_S, end - self.now_s) * 1000)
            self._read()

    def _read(self):
        taken = self.fifo.read(self._take)
        lost = self.fifo.overflows + self.fifo.misaligned
        if lost == self.lost and taken:
            self.seen_s = self.now_s
        angles = self.estimate.angles_mdeg
        age_s = self.now_s - self.seen_s
        self.rows.append((self.now_s - 0.002, taken > 0, age_s <= 0.1, age_s * 1000, *angles))

    def _take(self, counts):
        lost = self.fifo.overflows + self.fifo.misaligned
        good = self.judge(counts, self.memory) <= 0
        if lost != self.lost:  # the first one after samples were lost
            self.lost = lost
            gap_s = self.now_s - self.seen_s
            self.gap.open(self.estimate, self.before)
            self.gap.close(self.estimate, counts, max(1, round(gap_s * 1e6)), 1_000_000 // RATE_HZ)
        if good:
            self.estimate.update(counts)
            self.before[:] = counts

    def stats(self):
        """What the reader counted."""
        return {name: getattr(self.fifo, name) for name in ("overflows", "misaligned", "samples")}

    @property
    def uncaught(self):
        """Exceptions that left a callback."""
        return len(self.port.errors)

# SPDX-License-Identifier: MIT
"""The chip's own clock and its sampling: which sample is taken when, computed when needed.

Nothing is computed while nobody looks: `run(until)` catches up. Where neither the FIFO nor the
motion engine has to see every sample, it catches up only as far back as the filters remember.
The motion is asked once per sample of the gyro, at that instant and in order of time, so what
vibrates faster than half the sample rate aliases, here ahead of the low-pass.
"""

from tools.virtual.chip.sensing import design

GYRO_SETTLE_NS = 30_000_000  # datasheet: 30 ms from sleep to ready
_GYRO_TRANSIENT_DPS = 15.0
_REMEMBER_S = 0.7  # 20 time constants of the slowest row, and its delay


class Sampler:
    """Ticks of the sampling clock. A tick is one gyro sample; `every` ticks make one output."""

    def __init__(self, accel, gyro, motion, clock_error):
        self.accel = accel
        self.gyro = gyro
        self.motion = motion
        self.motion_start_ns = 0
        self.clock_error = clock_error
        self.running = False
        self.every = 1  # ticks per output sample
        self.output = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)  # g, dps, degC
        self._base_ns = 0.0
        self._step_ns = 1e6
        self._rate_hz = 1000.0
        self._accel_every = 1
        self._done = 0
        self._settled_ns = 0

    # clock

    def set_rows(self, gyro_row, accel_row, limits, now_ns):
        """Filter rows of the profile, saturation (dps, g); takes effect from `now_ns` on."""
        rate = gyro_row[2]
        self._clock(rate, now_ns)
        self._accel_every = max(1, int(rate / accel_row[2]))
        self.gyro.set_filter(design(*gyro_row), rate, limits[0])
        self.accel.set_filter(design(*accel_row), accel_row[2], limits[1])

    def set_cycle(self, rate_hz, limits, now_ns):
        """Low-power cycles: one unfiltered sample per wake-up."""
        self._clock(rate_hz, now_ns)
        self._accel_every = 1
        self.gyro.set_filter((1.0, 0, 0.0), 1000.0, limits[0])
        self.accel.set_filter((1.0, 0, 0.0), 1000.0, limits[1])

    def set_clock_error(self, error, now_ns):
        """The chip's clock is fast by the fraction `error` from `now_ns` on."""
        self._rebase(now_ns)
        self.clock_error = error
        self._step_ns = 1e9 / (self._rate_hz * (1 + error))

    def switch(self, on, now_ns):
        """Start or stop sampling; starting, the gyro needs its 30 ms."""
        if on and not self.running:
            self._base_ns = float(now_ns)
            self._done = 0
            self._settled_ns = now_ns + GYRO_SETTLE_NS
            self.accel.restart()
            self.gyro.restart()
        self.running = on

    def _clock(self, rate_hz, now_ns):
        if rate_hz != self._rate_hz:
            self._rebase(now_ns)
            self._rate_hz = rate_hz
            self._step_ns = 1e9 / (rate_hz * (1 + self.clock_error))

    def _rebase(self, now_ns):
        if self.running:
            n = self.tick(now_ns)
            self._base_ns += n * self._step_ns
            self._done = 0

    def tick(self, t_ns):
        """Number of the last tick at or before `t_ns`, counted from the last change of rate."""
        return int((t_ns - self._base_ns) / self._step_ns + 1e-6)

    def time_ns(self, tick):
        """When a tick is, ns, rounded up."""
        return -int(-(self._base_ns + tick * self._step_ns) // 1)

    @property
    def done(self):
        """The last tick that was computed."""
        return self._done

    def output_at(self, t_ns):
        """Tick of the last output sample at or before `t_ns` (0: none yet)."""
        n = self.tick(t_ns)
        return n - n % self.every

    # samples

    def run(self, until_ns, on_output=None, on_accel=None):
        """Compute the ticks up to `until_ns`; True when there was an output sample.

        `on_output(t_ns)` and `on_accel(t_ns)` see every sample, when given.
        """
        if not self.running:
            return False
        last = self.tick(until_ns)
        first = self._done + 1
        if first > last:
            return False
        if on_output is None and on_accel is None:
            first = max(first, last - int(_REMEMBER_S * self._rate_hz))
        fresh = self._loop(first, last, on_output, on_accel)
        self._done = last
        return fresh

    def _loop(self, first, last, on_output, on_accel):
        at = self.motion.at
        accel, gyro = self.accel, self.gyro
        origin = self._base_ns - self.motion_start_ns
        step, every, accel_every = self._step_ns, self.every, self._accel_every
        settling = self._settled_ns > self._base_ns + first * step
        fresh = False
        output = None  # at the last output tick: later ticks must not leak into it
        for n in range(first, last + 1):
            t_s = (origin + n * step) * 1e-9
            ax, ay, az, gx, gy, gz, temp = at(t_s if t_s > 0.0 else 0.0)
            if settling:
                gx, gy, gz = self._settle(gx, gy, gz, self._base_ns + n * step)
            gyro.step(gx, gy, gz, temp)
            if n % accel_every == 0:
                accel.step(ax, ay, az, temp)
                if on_accel is not None:
                    on_accel(self.time_ns(n))
            if n % every == 0:
                fresh = True
                output = (accel.value, gyro.value, temp)
                if on_output is not None:
                    self.output = output
                    on_output(self.time_ns(n))
        if fresh:
            self.output = output
        return fresh

    def _settle(self, gx, gy, gz, t_ns):
        left = (self._settled_ns - t_ns) / GYRO_SETTLE_NS
        if left <= 0:
            return gx, gy, gz
        ready, swing = 1 - left, left * _GYRO_TRANSIENT_DPS
        return gx * ready + swing, gy * ready + swing, gz * ready + swing

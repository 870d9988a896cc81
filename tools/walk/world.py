# SPDX-License-Identifier: MIT
"""The board of a walk: powered, cut off, interrupted, held, looked at every few milliseconds."""

import contextlib
import io

from tools.virtual.bus import Bus
from tools.virtual.chip import MPU6050Chip
from tools.virtual.port import Port
from tools.walk.break_in import ctrl_c
from tools.walk.checks import Checks
from tools.walk.motion import Moved

# platform, MicroPython's version, SDA and SCL
BOARDS = {
    "soft": ("rp2", (1, 25, 0), (4, 5)),
    "hard": ("rp2", (1, 26, 1), (4, 5)),
    "esp32": ("esp32", (1, 25, 0), (21, 22)),
}
_SLICE_MS = 10


class PowerCut(BaseException):
    """The supply is gone: whatever still runs of the program does not."""


class World:
    """One sensor, a folder that is the flash, and a board; `app` is the App on it.

    said: what was printed since the last step; trouble_ns: the end of the last trouble.
    """

    def __init__(self, board, folder):
        self.board, self.folder = board, folder
        self.motion = Moved()
        self.chip = MPU6050Chip(self.motion, seed=5, gyro_bias_dps=(1.0, -0.8, 0.6))
        self.bus = Bus(self.chip)
        self.port = self.app = None
        self.should_run = False
        self.said, self.result = "", None
        self._after = None  # what a transfer of the program raises, and after how many
        self._boot(0)

    # ---- power

    def _boot(self, now_ns):
        platform, version, pins = BOARDS[self.board]
        self.port = Port(
            platform, {0: self.bus}, wiring={0: pins}, version=version, root=self.folder
        )
        self.port.clock.now_ns = now_ns
        self.port.__enter__()
        wire = self.port.wire(0)
        wire.after = self._hooked(wire.after)
        from firmware.app import App

        self._after = None
        self.motors = []  # tools.walk.motor.Motor: the user's own outputs
        self.made = []  # those that were taken away too
        self._listen()
        self.app = App()
        self.port.connect_int(self.chip, self.app.board.int_pin)
        self.checks = Checks(self)
        self.should_run = False

    def _listen(self):
        """The checks are told where a yaw begins at 0: at each start, after a filter without."""
        from firmware.learning import Learning
        from firmware.tick import Tick

        begin, use = Learning.begin, Tick.use

        def begun(learning):
            begin(learning)
            self.checks.began()

        def used(tick, new):
            anew = tick.now and new.knows_yaw and not tick.now[2].knows_yaw
            use(tick, new)
            if anew:
                self.checks.zero()

        Learning.begin, Tick.use = begun, used

    def close(self):
        """Leave the board; its uncaught errors are checked."""
        errors = self.port.errors
        self.port.__exit__(None, None, None)
        assert errors == [], errors

    def power_cycle(self, sensor_too):
        """The board's supply is cut, and comes back; the sensor's with it, or not."""
        now_ns = self.port.now_ns
        self.bus.faults.clear()
        if self.bus._open:
            self.bus.stop()
        self.close()
        if sensor_too:
            self.chip.power_off()
            self.chip.power_on()
        self._boot(now_ns + 50_000_000)

    def _hooked(self, after):
        def hook(wire):
            after(wire)
            clock = self.port.clock
            if self._after is None or not clock.in_foreground or clock.scheduler.running:
                return
            self._after -= 1
            if self._after < 0:
                raise PowerCut

        return hook

    # ---- time

    @property
    def now_s(self):
        """Virtual time, seconds."""
        return self.port.now_ns / 1e9

    def run(self, ms):
        """Let time pass, and look."""
        until = self.port.now_ns + round(ms * 1e6)
        while self.port.now_ns < until:
            self.port.run_ms(min(_SLICE_MS, (until - self.port.now_ns) / 1e6))
            self.checks.look()

    def call(self, function, *arguments, how=None, after=0, refusals=(ValueError, OSError)):
        """What the user's call returns, or the exception that he may see. how: "Ctrl-C" at the
        after-th jump of the program, "Ctrl-C below" at that of the foreground after ticks, "power
        cut" after so many transfers, or None."""
        self._after = after if how == "power cut" else None
        said = io.TextIOWrapper(io.BytesIO(), newline="")
        clock, result = self.port.clock, None
        below = how == "Ctrl-C below"
        breaking = contextlib.nullcontext()
        if how == "Ctrl-C" or below:
            breaking = ctrl_c(clock, after, below)
        try:
            with contextlib.redirect_stdout(said), breaking:
                result = function(*arguments)
        except (*refusals, KeyboardInterrupt, PowerCut) as error:
            result = error
        finally:
            self._after = None
            said.flush()
            self.said = said.buffer.getvalue().decode()
        if isinstance(result, PowerCut):
            self.power_cycle(True)
            return result
        self.result = result
        self.checks.called(result)
        return result

    def cleared(self):
        """The user has taken all outputs away."""
        assert not any(motor.on for motor in self.motors)
        self.motors = []

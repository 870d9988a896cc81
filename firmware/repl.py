# SPDX-License-Identifier: MIT
"""The app's parts, and what one asks of them at the REPL."""

from firmware.board import find
from firmware.config import Config
from firmware.faults.policy import Health
from firmware.outputs import Outputs
from firmware.telemetry import Console, Telemetry


class Repl:
    """What firmware.app.App runs, with start(), stop() and set().

    Attributes: config, board, imu, calibration, filter, health, outputs, telemetry, loop,
    warnings (texts).
    """

    def __init__(self, board=None, console=None):
        self.board = board or find()
        self.config = Config()
        self.warnings = self.config.load()
        self.telemetry = Telemetry(console or Console())
        self.outputs = Outputs()
        self.health = Health()
        self.imu = self.filter = self.loop = self.calibration = None

    def stats(self):
        """Timing (firmware.loop), faults by cause (faults.policy) and telemetry, as a dict."""
        out = self.loop.stats() if self.loop else {}
        out.update(self.health.stats())
        out["age_ms"] = self.age_us // 1000
        out["stale"] = self.stale
        out["output_errors"] = self.outputs.failed
        out["telemetry_lines"] = self.telemetry.lines
        out["telemetry_dropped"] = self.telemetry.dropped
        return out

    def watch(self, seconds=None):
        """Print the angles until a key is pressed (or for some seconds); the loop runs on."""
        self.telemetry.watch(seconds)

    def report(self):
        """How the sensor is (firmware.report), as a dict; takes half a second, best at rest."""
        from firmware.report import report

        return report(self)

    def samples(self):
        """`async for app in app.samples()`: wakes after each step."""
        return self.loop.samples(self)

    @property
    def roll_deg(self):
        """Rotation about the sensor's x axis, degrees."""
        return self.filter.roll_mdeg / 1000

    @property
    def pitch_deg(self):
        """Rotation about the sensor's y axis, degrees."""
        return self.filter.pitch_mdeg / 1000

    @property
    def yaw_deg(self):
        """Rotation about the vertical since the start, degrees; 0 with one-axis filters."""
        return self.filter.yaw_mdeg / 1000

    @property
    def fresh(self):
        """Whether the last tick had a new good burst."""
        return self.health.age_us == 0

    @property
    def age_us(self):
        """Age of the last good sample in microseconds, also when the ticks stay away."""
        return self.health.age_us + (self.loop.since_us() if self.loop else 0)

    @property
    def stale(self):
        """True when the last good sample is older than failsafe_ms, or the loop does not run."""
        return self.loop is None or not self.loop.running or self.age_us >= self.health.stale_us

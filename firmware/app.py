# SPDX-License-Identifier: MIT
"""The application: sensor -> filter with calibration -> outputs and telemetry, at a fixed rate.

app = App()
app.start()         # in the background; the REPL stays alive
app.roll_deg        # also pitch_deg, yaw_deg, stale; app.filter.roll_mdeg ...
app.set("kalman_r_measure", 0.1)        # at once, while it runs
app.stats()
app.stop()
"""

import gc

import micropython
from micropython import const

from firmware import filters
from firmware.calibration import Warming, keep_learned
from firmware.faults.mend import Sensing
from firmware.faults.policy import CLOCK, Health
from firmware.loop import Loop
from firmware.repl import Repl
from firmware.startup import calibration, sensor
from firmware.tick.gap import Bridge

_LEAD_US = const(450)  # a burst takes 400 us on the bus
_LOOKS_HZ = const(5)  # how often something slow is looked at
_CORRECT_TIMER = const(5)  # looks from one at the mean period to the next
_CORRECT_EDGES = const(1)  # the same when the sensor's clock sets the pace

# Knobs of the sensor and the loop: both are made anew when one changes.
_SET_UP = ("rate_hz", "drive", "burst", "address", "gyro_dps", "accel_g", "dlpf_hz", "sensor_hz")


class App(Repl):
    """One sensor, one filter, one loop, running; its parts are firmware.repl's."""

    # ---- the block diagram

    def _diagram(self):
        """step(dt_us): one tick, dt_us after the last. Sensor -> filter, calibrated -> outputs.

        What it works with are local names, as looking up and setting attributes would cost more
        than the work; what is idle is not called.
        """

        @micropython.native
        def step(
            dt_us,
            late_us=self.loop.period_us + (self.loop.period_us >> 1),
            counts=self.imu.counts,
            sensing=self.sensing,
            health=self.health,
            bridge=self.bridge,
            outputs=self.outputs,
            telemetry=self.telemetry,
        ):
            late = dt_us > late_us
            if late:
                bridge.remember(counts)
            fresh = sensing.fetch(dt_us)
            if fresh:
                if late or health.gap_us:
                    dt_us = self._close_gap(dt_us)
                if bridge.timed:
                    bridge.update(counts, dt_us)
                else:
                    bridge.update(counts)
            else:
                bridge.predict(counts, dt_us, health.age_us)
            if outputs.active:
                outputs.write(self, fresh, health.age_us >= health.stale_us)
            if telemetry.on:
                telemetry.tick(bridge.filter, health.age_us >= health.stale_us)

        return step

    def _close_gap(self, dt_us):
        """The first good burst after a gap; returns the time that is left to it."""
        if self.sensing.another:
            self._other_part()  # whose filter starts anew: there is nothing to bridge
        else:
            self.bridge.close(self.imu.counts, self.health.gap_us or dt_us)
        self.health.gap_us = 0
        return self.bridge.period_us

    def _step_failed(self):
        """A step raised, which only an error of ours or a full heap can bring about."""
        if self.stale:
            self.outputs.safe()

    @micropython.native
    def _slowly(self, looks):
        """_LOOKS_HZ times a second: what need not be done at every tick."""
        if looks % _LOOKS_HZ == 0:
            self._warming.look(self.filter)
        if looks % self._correct_every == 0:
            self._correct()

    def _correct(self):
        """The filter's period follows the measured one: the sensor's clock is no crystal."""
        mean = self.loop.recent_period_us()
        if not mean or abs(mean - self.bridge.period_us) <= 1:
            return
        nominal = self.loop.period_us
        off = abs(mean - nominal) * 200 > 3 * nominal
        if off and not self._clock_off:
            self.health.count(CLOCK)
        self._clock_off = off
        self.bridge.pace(mean)

    def _other_part(self):
        """Another part was plugged in, whose biases nobody knows."""
        self.sensing.another = False
        self.warnings.append("another sensor was plugged in (%s)" % self.imu.profile.name)
        self.calibration = self.calibration.mounting()
        self._warming = Warming(self.calibration, self.imu)
        self.filter = self._made(None)

    # ---- the whole

    def start(self):
        """Set all up and run in the background. OSError, with what to check, without a sensor."""
        self.stop()
        if self.imu is None:
            self.imu = sensor(self.board, self.config)
        self.calibration, warnings = calibration(self.imu, self.config)
        for text in self.warnings + warnings:
            print("warning:", text)
        self._wire()
        if self.config.watchdog_ms and self.outputs.feed is None:
            self.outputs.watch(self.board.watchdog(self.config.watchdog_ms).feed)
        gc.collect()  # else each call with a large frame searches a heap full of start-up's rests
        self.loop.start()

    def stop(self):
        """End the loop; outputs go to their safe values. start() begins again.

        A watchdog, once started, resets the board watchdog_ms later: nothing can stop it. What
        was learned of the gyro's bias is stored.
        """
        if self.loop and self.loop.running:
            self.loop.stop()
            self.outputs.safe()
            try:
                keep_learned(self._warming.learned(), self.imu)
            except (OSError, ValueError) as error:  # a full or worn flash, and no harm
                print("warning: what was learned of the gyro's bias is not stored:", error)

    def set(self, name, value):
        """Change a knob; it takes effect at once. ValueError names what is allowed."""
        config = self.config
        config.set(name, value)
        if name == "telemetry_hz":
            self.telemetry.set_rate(value, config.rate_hz)
        elif name == "failsafe_ms":
            self.health.stale_us = value * 1000
        elif name in _SET_UP:
            running = self.loop is not None and self.loop.running
            self.stop()
            self.imu = None
            if running:
                self.start()
        elif self.loop and (name == "filter" or name in filters.SETTINGS[config.filter]):
            self.filter = self._made(self.filter if name != "filter" else None)

    def self_test(self):
        """(passed, a line for each axis) of the chip's self-test, at rest; the loop pauses."""
        from firmware.report import tested

        running = self.loop is not None and self.loop.running
        self.stop()
        if self.imu is None:
            self.imu = sensor(self.board, self.config)
        result = tested(self.imu)
        if running:
            self.start()
        return result

    def calibrating(self):
        """The steps of a calibration (firmware.calibrating); ends the loop, start() goes on."""
        from firmware.calibrating import Calibrating

        self.stop()
        if self.imu is None:
            self.imu = sensor(self.board, self.config)
        return Calibrating(self.imu)

    # ---- set-up

    def _wire(self):
        config, board = self.config, self.board
        timed = config.drive == "timer"
        split = timed and config.burst != "blocking" and self.imu.split
        self.health = Health(
            config.failsafe_ms * 1000,
            10 + 3 * config.rate_hz // config.sensor_hz,  # a slower sensor's bursts come again
            1000000 // config.dlpf_hz,
            config.rate_hz // _LOOKS_HZ,
        )
        self.sensing = Sensing(self.imu, board, self.health, split, self._slowly)
        self.telemetry.set_rate(config.telemetry_hz, config.rate_hz)
        self.loop = Loop(
            None,
            board.timer if timed else board.data_ready,
            config.rate_hz,
            grid=timed,
            ahead=self.sensing.begin if split else None,
            lead_us=_LEAD_US,
            guard=None if timed else board.timer,
            failed=self._step_failed,
        )
        self.bridge = Bridge(self.loop.period_us, self.imu.gyro_lsb_per_dps)
        self.loop.step = self._diagram()
        self._correct_every = _CORRECT_TIMER if timed else _CORRECT_EDGES
        self._clock_off = False
        self._warming = Warming(self.calibration, self.imu)
        self.filter = self._made(None)

    def _made(self, old):
        """The filter of config.filter, going on where `old` is; changed between two ticks."""
        made = filters.make(self.config, self.calibration, self.imu)
        if old is not None:
            made.go_on_from(old)
        self.bridge.use(made)
        return made

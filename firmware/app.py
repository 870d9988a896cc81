# SPDX-License-Identifier: MIT
"""The application: sensor -> filter with calibration -> outputs and telemetry, at a fixed rate.

app = App()
app.start()         # in the background; the REPL stays alive
app.roll_deg        # also pitch_deg, yaw_deg, stale, uncertain; app.sample(): all of one instant
app.set("kalman_r_measure", 0.1)        # at once, while it runs
app.stats()
app.stop()
"""

import gc
import time
from array import array

import micropython
from micropython import const

from firmware import filters, startup
from firmware.board import find
from firmware.bus import Bus
from firmware.calibration import Warming, keep_learned
from firmware.config import Config
from firmware.faults.mend import Mend
from firmware.faults.policy import POLICY
from firmware.foreground import Foreground
from firmware.loop import Loop
from firmware.outputs import Outputs
from firmware.telemetry import Console, Telemetry
from firmware.tick import Tick, estimate, judge

_LEAD_US = const(450)  # a burst takes 400 us on the bus
_CORRECT_TIMER = const(5)  # looks at the sensor's clock, a fifth of a second each
_CORRECT_EDGES = const(1)

# places: firmware.tick.words, firmware.tick.estimate
_ODD = const(0)
_AGE_US = const(3)
_PREDICTED = const(4)
_STALE_US = const(5)
_UNUSED_US = const(6)
_RING_US = const(7)
_SURE = const(8)
_FORGET = const(9)
_SWAP = const(10)
_ZERO_YAW = const(11)
_UNSURE_US = const(16)
_YAW_LOST = const(17)
_ERRORS = const(20)
_LIMIT = const(22)
_BUSY = const(23)
_PAUSE = const(24)
_PATIENCE = const(27)
_COUNT = const(30)
_EST_UNCERTAIN = const(12)
_WRAP = const(0x3FFFFFFF)

# Knobs that change the chip, and those for which the ticks begin anew as well
_CHIP = ("gyro_dps", "accel_g", "dlpf_hz", "sensor_hz")
_PACE = ("rate_hz", "drive", "burst")


class Sample:
    """One consistent estimate. t_us: ticks_us() of its tick; angles in degrees, rates in deg/s,
    accel in g, all in the robot's frame; temp_c; age_us since the last good sample; at_rest,
    uncertain, stale."""

    def __repr__(self):
        return "roll %.2f, pitch %.2f, yaw %.2f deg%s" % (
            self.roll_deg,
            self.pitch_deg,
            self.yaw_deg,
            ", stale" if self.stale else ", uncertain" if self.uncertain else "",
        )


class App:
    """One sensor, one filter, one loop, running.

    Attributes: config, board, imu, calibration, filter, outputs, telemetry, loop, tick, bus,
    warnings (texts), angles_mdeg and rates_mdps (for controllers), period_us (the measured one).
    """

    _running = []  # type: list  # those whose loop ticks

    @classmethod
    def current(cls):
        """The App that runs, the one started last, or None."""
        return cls._running[-1] if cls._running else None

    def __init__(self, board=None, console=None):
        self.board = board or find()
        self.config = Config()
        self.warnings = self.config.load()
        self.tick = Tick()
        self.bus = Bus()
        self.telemetry = Telemetry(console or Console())
        self.period_us = 0
        self.outputs = Outputs(self.tick, self)
        self.imu = self.filter = self.loop = self.calibration = self.mend = self.warming = None
        self._copy = array("i", self.tick.est)
        self.angles_mdeg = memoryview(self.tick.est)[2:5]
        self.rates_mdps = memoryview(self.tick.est)[5:8]
        self._watched = False
        self._foreground = Foreground(self)
        self.tick.after = self._foreground.after

    def __repr__(self):
        if self.loop is None:
            return "<App, not started: app.start()>"
        if not self.loop.running:
            return "<App, stopped: app.start()>"
        return "<App, %s at %d Hz, %s tick: %s>" % (
            self.config.filter,
            self.config.rate_hz,
            self.stats_tick,
            self.sample(),
        )

    # ---- start and stop

    def start(self):
        """Set all up and run in the background. OSError, with what to check, without a sensor."""
        self.stop()
        for other in self._running:
            if self._same_sensor(other):
                raise OSError("this sensor has a running App: use App.current(), or stop it first")
        startup.sensor_rate_hz(self.config)
        if self.imu is None:
            self.imu = startup.sensor(self.board, self.config)
        self.calibration, warnings = startup.calibration(self.imu, self.config)
        for text in self.warnings + warnings:
            print("warning:", text)
        self._adopt_sensor()
        self._settings()
        self._wire(None)
        if self.config.watchdog_ms and not self._watched:
            self._watched = True
            self.outputs.watch(self.board.watchdog(self.config.watchdog_ms).feed)
        gc.collect()  # else each call with a large frame searches a heap full of start-up's rests
        self._first_sample()
        self._go()

    def stop(self):
        """End the loop; outputs go to their safe values. start() begins again.

        A watchdog, once started, resets the board watchdog_ms later: nothing can stop it. What
        was learned of the gyro's bias is stored.
        """
        if self._halt():
            self.outputs.safe()
            try:
                keep_learned(self.warming.learned(), self.imu)
            except (OSError, ValueError) as error:  # a full or worn flash, and no harm
                print("warning: what was learned of the gyro's bias is not stored:", error)

    def _halt(self):
        """End the ticks; True when there were any."""
        if self in self._running:
            self._running.remove(self)
        if self.loop is None or not self.loop.running:
            return False
        self.loop.stop()
        self.bus.forget()
        return True

    def _go(self):
        self._running.append(self)
        self.loop.start()

    def _same_sensor(self, other):
        return (
            other.board.i2c_id == self.board.i2c_id
            and other.config.address == self.config.address
        )

    def _adopt_sensor(self):
        self.imu.lock = self.bus
        self.bus.finish = self.imu.finish
        self.mend = Mend(self.imu, self.board, self.bus, self.tick.words, self._other_part)
        self.warming = Warming(self.calibration, self.imu, self.recalibrate)

    def _settings(self):
        """What the tick is told by knobs."""
        words, config = self.tick.words, self.config
        words[_STALE_US] = config.failsafe_ms * 1000
        words[_RING_US] = 1000000 // config.dlpf_hz
        words[_LIMIT] = config.output_failures
        words[_PATIENCE] = max(2, config.failsafe_ms * config.rate_hz // 1000)
        judge.allow(self.tick.memory, 10 + 3 * config.rate_hz // config.sensor_hz)
        self.telemetry.set_rate(config.telemetry_hz, config.rate_hz)

    def _wire(self, old):
        """The loop and the tick for these knobs, with a new filter that goes on from `old`."""
        config, board = self.config, self.board
        on_timer = config.drive == "timer"
        timed = filters.is_timed(config.filter)
        hard = not timed and board.has_hard(on_timer)
        lead_us = _LEAD_US if on_timer and config.burst != "blocking" and self.imu.split else 0
        self.stats_tick = "hard" if hard else "soft"
        source = board.timer if on_timer else board.data_ready
        readers = self.loop.readers if self.loop else None
        rate_hz = config.rate_hz if on_timer else self.imu.rate_hz
        self.loop = Loop(
            self.tick,
            board.ticking(source, hard),
            rate_hz,
            grid=on_timer,
            lead_us=lead_us,
            guard=None if on_timer else board.ticking(board.timer, hard and board.has_hard(True)),
        )
        if readers:
            self.loop.readers = readers
        self.period_us = self.loop.period_us
        self._use(self._made(old))
        self.tick.wire(self.imu, self.bus.words, self.loop.period_us, timed, lead_us)
        self._foreground.wire(rate_hz, _CORRECT_TIMER if on_timer else _CORRECT_EDGES)
        self.outputs.tune(self.loop.period_us)

    def _made(self, old):
        """The filter of these knobs, which stands where `old` stands now."""
        made = filters.make(self.config, self.calibration, self.imu, 1e6 / self.period_us)
        words = self.tick.words
        if old is not None:
            words[_PAUSE] = 1  # the old one does not move while it is looked at
            try:
                made.go_on_from(old, self._since_us())
            except BaseException:
                words[_PAUSE] = 0
                raise
        return made

    def _use(self, made):
        """The tick works with this filter from now on."""
        old, words = self.filter, self.tick.words
        if old is not None and words[_PAUSE]:
            self.tick.gap.rescale(old.gyro_lsb, made.gyro_lsb)
        self.filter = made
        self.tick.use(made)
        words[_ODD] = 1
        words[_PAUSE] = 0

    def _since_us(self):
        """Since the last tick, as far as angles are concerned."""
        return min(self.loop.since_us(), 1000000) if self.loop.running else 0

    def _first_sample(self):
        """The angles are true before the first tick: one sample, levelled."""
        words, tick, imu = self.tick.words, self.tick, self.imu
        for word in (_AGE_US, _UNUSED_US, _UNSURE_US, _YAW_LOST, _SWAP, _ZERO_YAW, _PAUSE):
            words[word] = 0
        for word in range(_COUNT, len(words)):
            words[word] = 0
        words[_PREDICTED] = words[_BUSY] = words[_ERRORS] = 0
        words[_SURE] = words[_FORGET] = words[_ODD] = 1
        imu.read()
        self.filter.update(imu.counts)
        estimate.publish(tick.est, self.filter.out, array("H", [c & 65535 for c in imu.counts]),
                         time.ticks_us())  # fmt: skip
        self.filter.keep()

    # ---- knobs

    def set(self, name, value):
        """Change a knob; it takes effect at once. ValueError names what is allowed; then all is
        as it was."""
        config = self.config
        before = config.values()
        config.set(name, value)
        try:
            startup.sensor_rate_hz(config)
            self._apply(name)
        except BaseException:
            config.take(before)
            if name in _CHIP or name in _PACE:
                self._change(name in _PACE)
            raise

    def _apply(self, name):
        config = self.config
        if self.loop is None:
            return
        if name in _CHIP or name in _PACE:
            self._change(name in _PACE)
        elif name == "address":
            self._change_sensor()
        elif name == "filter":
            if filters.is_timed(config.filter) != self.filter.timed:
                self._change(True)
            else:
                self._use(self._made(self.filter))
        elif name in filters.SETTINGS[config.filter]:
            self._prepare(settings=filters.settings(config, self.imu))
        else:
            self._settings()

    def _change(self, pace):
        """Set-up knobs of a running app: the chip, the coefficients, and with `pace` the ticks.

        The tick predicts meanwhile, or where it stands still the gap is bridged; the rest is not
        measured again and the outputs are not put away.
        """
        config, imu, words = self.config, self.imu, self.tick.words
        if self.loop is None:
            return
        running = self.loop.running
        since = time.ticks_us()
        with self.bus:
            if hasattr(imu, "set_up"):
                imu.set_up(config.gyro_dps, config.accel_g, config.dlpf_hz,
                           startup.sensor_rate_hz(config))  # fmt: skip
                imu.data_ready(config.drive == "data-ready")
            old = self.filter
            if pace:
                since = (since - self._since_us()) & _WRAP
                self._halt()
                self._wire(old)
            else:
                self._use(self._made(old))
            self._settings()
            words[_FORGET] = words[_ODD] = 1
        if pace and running:
            words[_AGE_US] += time.ticks_diff(time.ticks_us(), since)
            self._go()

    def _change_sensor(self):
        running = self.loop.running
        self.stop()
        self.imu = None
        if running:
            self.start()

    def _prepare(self, **what):
        """New coefficients, taken over between two ticks; the filter's state stays."""
        words = self.tick.words
        hard = self.loop.running and self.stats_tick == "hard"
        began = time.ticks_ms()
        while hard and words[_SWAP] and time.ticks_diff(time.ticks_ms(), began) < 30:
            time.sleep_us(100)  # the last ones are still to be taken over
        self.filter.prepare(**what)
        if hard:
            words[_SWAP] = 1
            words[_ODD] = 1
        else:
            self.filter.swap()

    def follow(self, period_us):
        """The ticks come every period_us, as measured: so shall the filter have it."""
        try:
            self._prepare(period_us=period_us)
            self.period_us = period_us
        except ValueError:  # further off than its coefficients reach: made for it
            self.period_us = period_us
            self._use(self._made(self.filter))
        self.outputs.tune(period_us)

    def recalibrate(self, calibration):
        """Correct the samples by this Calibration from the next tick on."""
        self._prepare(calibration=calibration)

    def _other_part(self):
        """Another part was plugged in, whose biases nobody knows."""
        self.warnings.append("another sensor was plugged in (%s)" % self.imu.profile.name)
        self.calibration = self.calibration.mounting()
        self.warming = Warming(self.calibration, self.imu, self.recalibrate)
        self._use(filters.make(self.config, self.calibration, self.imu, 1e6 / self.period_us))

    def zero_yaw(self):
        """The direction it looks in now is yaw 0."""
        if self.loop.running:
            self.tick.words[_ZERO_YAW] = self.tick.words[_ODD] = 1
        else:
            self.filter.zero_yaw()

    # ---- what one asks

    def sample(self):
        """A Sample: the whole estimate of one tick."""
        words = self._copy
        while not estimate.read(self.tick.est, words):
            pass
        made = Sample()
        made.t_us = words[1] & _WRAP
        made.roll_deg, made.pitch_deg, made.yaw_deg = [v / 1000 for v in words[2:5]]
        made.rates_dps = tuple([v / 1000 for v in words[5:8]])
        made.accel_g = tuple([v / self.imu.accel_lsb_per_g for v in words[8:11]])
        made.at_rest = words[11] != 0
        made.uncertain = words[12] != 0
        made.temp_c = words[13] / self.imu.profile.temp_lsb_per_c
        made.age_us = words[14] + self.loop.since_us()
        made.stale = self.stale
        return made

    def stats(self):
        """Timing (firmware.loop), faults by cause (faults.policy) and telemetry, as a dict."""
        out = self.loop.stats() if self.loop else {}
        words = self.tick.words
        out.update(self.faults())
        if self.loop:
            out["tick"] = self.stats_tick
        out["predicted"] = words[_PREDICTED]
        out["busy"] = words[_BUSY]
        out["errors"] = words[_ERRORS] + self._foreground.errors
        out["age_ms"] = self.age_us // 1000
        out["stale"] = self.stale
        out["uncertain"] = self.uncertain
        out["output_errors"] = self.outputs.failed
        out["output_late"] = self.outputs.late
        out["telemetry_lines"] = self.telemetry.lines
        out["telemetry_dropped"] = self.telemetry.dropped
        return out

    def faults(self):
        """{cause: how often} of those seen since the start (firmware.faults.policy)."""
        words, out = self.tick.words, {}
        for code in range(1, len(POLICY)):
            if words[_COUNT + code]:
                out[POLICY[code].cause] = words[_COUNT + code]
        over = judge.accel_saturated(self.tick.memory)
        if over:
            out["accel_saturated"] = over
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

    def self_test(self):
        """(passed, a line for each axis) of the chip's self-test, at rest; the loop pauses."""
        from firmware.report import tested

        running = self.loop is not None and self.loop.running
        self.stop()
        if self.imu is None:
            self.imu = startup.sensor(self.board, self.config)
        try:
            return tested(self.imu)
        finally:
            if running:
                self.start()

    def calibrating(self):
        """The steps of a calibration (firmware.calibrating); ends the loop, start() goes on."""
        from firmware.calibrating import Calibrating

        self.stop()
        if self.imu is None:
            self.imu = startup.sensor(self.board, self.config)
        return Calibrating(self.imu)

    @property
    def roll_deg(self):
        """Rotation about the robot's x axis, degrees."""
        return self.tick.est[2] / 1000

    @property
    def pitch_deg(self):
        """Rotation about the robot's y axis, degrees."""
        return self.tick.est[3] / 1000

    @property
    def yaw_deg(self):
        """Rotation about the vertical since the start, degrees; 0 with one-axis filters."""
        return self.tick.est[4] / 1000

    @property
    def fresh(self):
        """Whether the last tick had a new good burst."""
        return self.tick.words[_AGE_US] == 0

    @property
    def age_us(self):
        """Age of the last good sample in microseconds, also when the ticks stay away."""
        return self.tick.words[_AGE_US] + (self.loop.since_us() if self.loop else 0)

    @property
    def stale(self):
        """True when the last good sample is older than failsafe_ms, or the loop does not run."""
        return (
            self.loop is None
            or not self.loop.running
            or self.age_us >= self.tick.words[_STALE_US]
        )

    @property
    def uncertain(self):
        """True while the estimate is fresh but not known well enough to be claimed."""
        return not self.stale and self.tick.est[_EST_UNCERTAIN] != 0


micropython.alloc_emergency_exception_buf(200)  # also where boot.py is the user's own

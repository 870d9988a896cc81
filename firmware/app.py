# SPDX-License-Identifier: MIT
"""What one writes at the REPL: the application, running in the background at a fixed rate.

app = App()
app.start()         # the REPL stays alive
app.roll_deg        # also pitch_deg, yaw_deg, stale, uncertain; app.sample(): all of one instant
app.set("kalman_r_measure", 0.1)        # at once, while it runs; app.show() lists every knob
app.stats()
app.save()
app.stop()
"""

import gc
import sys

_OFTEN = 8192  # until it runs: else what stays is strewn all over the heap, between garbage
gc.threshold(_OFTEN)

from array import array

import micropython
from micropython import const

from firmware import board as boards
from firmware import bus, filters, learning, sample, settings, wiring
from firmware.briefly import Briefly, Lasting
from firmware.config import Config, defaults
from firmware.foreground import Foreground
from firmware.outputs import Outputs
from firmware.telemetry import Console, Telemetry
from firmware.tick import Tick, estimate
from firmware.watchdog import Feeding

# places: firmware.tick.words, firmware.tick.estimate
_ODD = const(0)
_AGE_US = const(3)
_STALE_US = const(5)
_ZERO_YAW = const(11)
_DUE = const(12)
_LATE_US = const(13)
_UNCERTAIN = const(12)
_YAW_DOUBT = const(28)

# knobs that change the chip, and those for which the ticks begin anew as well
CHIP = ("gyro_dps", "accel_g", "dlpf_hz", "sensor_hz")
PACE = ("rate_hz", "drive", "burst")
PLACE = ("address", "allow_unknown", "bus", "bus_hz", "pin_sda", "pin_scl", "pin_int")
ALL_OVER = CHIP + PACE + PLACE + ("filter",)  # a stream says all anew
# what a start alone needs; what reads and writes files
_FILES = ("firmware.calibration", "firmware.store", "calibration.fields")
_CALIBRATING = (
    "firmware.calibrating", "calibration.mounting", "calibration.poses", "calibration.solve",
    "calibration.rest",
) + _FILES  # fmt: skip
_REPORT = ("firmware.report", "mpu6050.selftest")
_FIND = ("firmware.startup", "firmware.first")
_START = _FIND + ("firmware.beginning", "calibration.rest") + _REPORT + _FILES
_CLAIMS = ("attitude.fixed.attitude.claims", "attitude.bounds")
_ROOM = const(16000)  # bytes, for a program of the user's
_SHORT = const(64000)  # a heap in which names are no small matter
_CODE = const(36000)  # what a start loads for a moment, and room for it
_UNDO = const(20)
_CHANGE_DPS2 = const(1000)  # of a rate that a hand changes
_CALIBRATING_S = const(900)


class App:
    """One sensor, one filter, one loop, running.

    name: of a second one, for a second sensor: its files are NAME.config.txt and
    NAME.calibration.txt. sensor: another kind than the MPU6050, a class with its interface
    (lib/mpu6050), such as minimu9.MinIMU9.

    Attributes: config, board, imu, calibration, filter, outputs, telemetry, loop, tick, bus,
    warnings (texts); for controllers angles_mdeg and rates_mdps (live, 3 each, robot's frame)
    and period_us (of the ticks, as measured).
    """

    _running = []  # type: list  # those begun and not stopped; a Ctrl-C may leave one that stands
    _knobs = set(defaults()) - {"filter", "bus"}  # these are the app's own too

    @classmethod
    def current(cls):
        """The App that runs, the one started last, or None."""
        last = None
        for app in cls._running:
            if app.running:
                last = app
        return last

    def __init__(self, board=None, console=None, name="", sensor=None):
        self.board = board or boards.here()
        self.kind = sensor
        self.config = Config(name)
        self.warnings = self.config.load()
        self._believe_knobs()
        self.config.change = self.set
        self.tick = Tick(bus.mask())
        self.bus = bus.of(0)
        self.telemetry = Telemetry(console or Console())
        self.period_us = 0
        self.tick_kind = "soft"
        self.guards = []
        self.outputs = Outputs(self.tick, self)
        self.imu = self.filter = self.loop = self.calibration = self.mend = self.learning = None
        self.angles_mdeg = memoryview(self.tick.est)[2:5]
        self.rates_mdps = memoryview(self.tick.est)[5:8]
        self.foreground = Foreground(self)
        self.tick.after = self.foreground.after
        self._stream = None
        self._copy = array("i", self.tick.est)
        self._calm = None  # feeds the watchdog while somebody calibrates
        self._watched = 0  # ms of the watchdog that runs
        self._attached = {}  # type: dict  # applications by name
        self._past = []

    def _believe_knobs(self):
        """Knobs from the flash that do not go together never stop a start."""
        if self.config.changed():
            try:
                self._fit()
            except ValueError as error:
                self.warnings.append("knobs on the flash: %s; all have their defaults" % error)
                self.config.reset()

    def _fit(self):
        """ValueError where knobs do not go together."""
        settings.check(self.config, self.board)
        try:
            self.board.use(self.config)
        except OSError:
            pass  # nobody knows its pins: start() says it

    def __setattr__(self, name, value):
        if name in self._knobs:
            raise AttributeError("%s is a knob: app.set(%r, ...)" % (name, name))
        object.__setattr__(self, name, value)

    def __repr__(self):
        if not self.running:
            return "<App, %s: app.start()>" % ("stopped" if self.loop else "not started")
        what = (self.config.filter, self.config.rate_hz, self.tick_kind)
        return "<App, %s at %d Hz, %s tick; app.help()>" % what

    def help(self):
        """Print what can be asked and told."""
        with Briefly("firmware.texts"):
            from firmware import texts

            texts.help()

    # ---- start and stop

    @property
    def running(self):
        """Whether the loop ticks."""
        return self.loop is not None and self.loop.running

    def start(self):
        """Set all up and run in the background. OSError, with what to check, without a sensor;
        ValueError where knobs do not go together."""
        self._begin(self.running)

    def _begin(self, ran):
        """Start; where it fails, a loop that ran before is said to stand still now."""
        before = gc.threshold()
        try:
            if self._calm:
                self._calm.__exit__()
                self._calm = None
            with Feeding(self):
                self._start()
        except BaseException as error:
            gc.threshold(before)
            if ran or isinstance(error, KeyboardInterrupt):
                print("stopped: app.start() begins anew")
            if isinstance(error, MemoryError):
                print("the heap has no room for it in one piece: app.save(), then Ctrl-D")
            raise

    def _start(self):
        self.stop()
        if not self.current():  # whose soft ticks each collection would hold up
            gc.threshold(_OFTEN)
        self.board.check_version()
        self.board.use(self.config)
        settings.check(self.config, self.board)
        filters.leave(_CODE)
        with Briefly(*_START):
            self._find_sensor()
            began = self._find_bias()
            self.calibration = began.calibration
            for text in self.warnings + began.warnings + self.board.warnings():
                print("warning:", text)
            self.warnings = began.warnings
        gc.collect()  # what stays comes after what goes: else it is islands in the heap
        wiring.adopt_sensor(self, began.known)
        wiring.settle(self)
        wiring.wire(self, None, wiring.made(self))
        self._watch()
        self.filter.standing()  # loads what the first sample shall not wait for
        with Briefly("firmware.first"):
            from firmware.first import begin

            gc.collect()  # else each call with a large frame searches a heap full of rests
            gc.threshold(-1)
            begin(self, began.still)
        self._running.append(self)
        self.loop.start()

    def _find_bias(self):
        from firmware.beginning import find  # a name that lives no longer than this

        return find(self.imu, self.config)

    def stop(self):
        """End the loop; outputs go to their safe values. start() begins again.

        A watchdog, once started, resets the board watchdog_ms later: nothing can stop it. What
        was learned of the gyro's bias and scale is stored.
        """
        running = self.running
        end = (int, self.outputs.safe)[running]
        try:
            if self.loop:  # its timers too, where a Ctrl-C in its end has left some
                self.loop.stop()
                self.bus.forget(self.tick.mask)
        finally:
            end()  # and no jump before it, at which a Ctrl-C would come in
        if running:
            try:
                self._keep_learned()
            except (OSError, ValueError) as error:  # a full or worn flash, and no harm
                print("warning: what was learned of the gyro is not stored:", error)
        if self in self._running:  # last: while it runs, the sensor is its own
            self._running.remove(self)

    def _keep_learned(self):
        learned = self.learning.learned()
        if learned or hasattr(self.filter, "calibration_learned"):
            with Briefly(*_CLAIMS + _FILES):
                from firmware.calibration import keep_learned, scale_learned

                scale = scale_learned(self.filter, self.calibration)
                keep_learned(learned, self.imu, self.config.calibration_path, scale)

    def _watch(self):
        """Start the watchdog where a knob asks for it; it bites from now on."""
        wanted = self.config.watchdog_ms
        if wanted and not self._watched:
            self._watched = wanted
            self.outputs.watch(self.board.watchdog(wanted).feed)
        elif wanted != self._watched:
            print("the watchdog stays at %d ms until a reset" % self._watched)

    def _find_sensor(self):
        """`imu` is there and measures as the knobs say. OSError says what to check."""
        self.board.use(self.config)
        self.bus = bus.of(self.board.i2c_id)
        with Briefly(*_FIND):
            from firmware import startup

            startup.check(self, self._running)
            if self.imu is None:
                self.imu = startup.sensor(self.board, self.config, self.bus, self.kind)
            else:
                startup.again(self.imu, self.board, self.config, self.bus)

    def paused(self, work):
        """What `work(imu)` returns, called while the loop stands still and the bus is ours."""
        running = self.running
        try:
            self.stop()
            with Feeding(self):
                self._find_sensor()
                return work(self.imu)
        finally:
            if running:
                self._begin(True)

    # ---- knobs

    def set(self, name, value):
        """Change a knob; it takes effect at once. ValueError names what is allowed; OSError when
        the sensor does not take it; then all is as it was."""
        self._change({name: value})

    def _change(self, values):
        """All of these knobs, or none."""
        if not _any(values, PACE):  # else later, for what stays is made later
            self.tidy()
        config = self.config
        before, running = config.values(), self.running
        past = self._past[1 - _UNDO :] + [{name: before.get(name) for name in values}]
        allowed, kept = False, before
        try:
            for name in values:
                config.set(name, values[name])
            if "filter" in values:
                _hear_names()
                filters.load(config.filter)  # here, where the stack is still far from its end
            allowed = True
            self._apply(values, before)
            if self._stream:
                for name in values:
                    self._stream.changed(None if name in ALL_OVER else name)
            kept = config.values()
            self._past = past
        finally:  # after a Ctrl-C too; the first line of this nothing can keep from being done
            config.take(kept)
            if kept is before and allowed:
                self._take_back(values, running)

    @property
    def stream(self):
        """The firmware.stream.Stream, loaded when somebody wants it."""
        if not self._stream:
            _hear_names()
            with Lasting(self.tidy()):
                from firmware.stream import Stream

                self._stream = Stream(self)
        return self._stream

    def tidy(self, name=None):
        """What stays shall not be strewn over the heap, behind garbage. False where it is there
        already, the module of this name, and where soft ticks would wait for collections; those
        of a float filter do anyway."""
        soft = self.running and self.tick_kind != "hard" and not self.filter.timed
        if soft or name in sys.modules:
            return False
        gc.collect()
        return True

    def _take_back(self, names, running):
        """All as it was; the loop goes on, or else the outputs are safe."""
        try:
            if self.loop and self.imu:
                self._put(names)
            if running and not self.running:
                self.loop.start()
        finally:
            if running and not self.running:
                self.outputs.safe()

    def _apply(self, names, before):
        config = self.config
        for controller in self._attached.values():
            if hasattr(controller, "check"):
                controller.check(config)
        moved = [name for name in names if name in PLACE or name.startswith("pin_")]
        if moved and self._move(moved, before):
            return
        if self.loop is None or self.imu is None:
            settings.check(config, self.board)
            return
        settings.check_pace(config, self.board)
        self._put(names)

    def _put(self, names):
        """What these knobs say now, into all that works with it."""
        config = self.config
        if _any(names, PACE):
            self.board.use(config)
        pace = _any(names, PACE) or filters.is_timed(config.filter) != self.filter.timed
        if pace or _any(names, CHIP):
            wiring.change(self, pace)
        else:
            if "filter" in names:
                self.tidy()
                wiring.renew(self)
            elif _any(names, filters.SETTINGS[config.filter]):
                wiring.prepare(self, settings=filters.settings(config, self.imu))
            wiring.settle(self)
        if "filter" in names:
            filters.leave(_ROOM)
        if _any([name.split("_")[0] for name in names], self._attached):
            self.outputs.tune(self.period_us)
        if "watchdog_ms" in names:
            self._watch()

    def _move(self, names, before):
        """Knobs of the board, or of where the sensor is: pins are looked at together when it
        starts, since they can only be changed one by one. True where it has started anew."""
        for name in names:
            if name.startswith("pin_"):
                self.board.check_pin(name, getattr(self.config, name))
        settings.check(self.config, self.board)
        elsewhere = [name for name in names if not name.startswith("pin_out")]
        if not self.running:
            if elsewhere:
                self.imu = None
            return False
        self.board.use(self.config)
        if elsewhere:
            self._change_sensor(before)
        return bool(elsewhere)

    def _change_sensor(self, before):
        running, old = self.running, self.imu
        self.stop()
        self.imu = None
        try:
            if running:
                self._start()
        except BaseException:
            self.config.take(before)
            self.board.use(self.config)
            old.use_bus(self.board.i2c())  # the search for the other one has used its wires
            self.imu = old
            self._begin(True)
            raise

    def show(self):
        """Print each knob: `*` differs from its default, `~` lets the ticks pause when changed."""
        self.config.show(PACE + PLACE)
        if self._watched:
            self._watch()  # says where the one that runs is another

    def changed(self):
        """{name: value} of the knobs that differ from their defaults."""
        return self.config.changed()

    def undo(self):
        """Take back the last set() or defaults(); returns {name: value} as it is again."""
        past = self._past
        if not past:
            return {}
        self._change(past[-1])
        self._past = past[:-1]
        return past[-1]

    def defaults(self):
        """All knobs back to their defaults, at once; save() keeps that."""
        changed = self.config.changed()
        if changed:
            own = defaults()
            self._change({name: own[name] for name in changed})

    def save(self):
        """Keep the knobs on the flash, for the next start. OSError when it refuses; ValueError
        where pins do not go together: it would not start with them."""
        self._fit()
        self.config.save()
        return "saved; %s" % (self.config.changed() or "all knobs have their defaults")

    # ---- applications

    def has(self, name):
        """Whether the application of this name runs on this app."""
        controller = self._attached.get(name)
        return controller is not None and self.outputs.has(controller.update)

    def attach(self, name, controller):
        """Let a controller of firmware.apps drive, and run. It has update(app), safe() and
        tune(period_us), which is called also when one of its knobs (NAME_...) changes; where it
        has check(config), that refuses knobs with a ValueError."""
        self._attached[name] = controller
        self.outputs.add(controller.update, controller.safe, hard=True, tune=controller.tune)
        if not self.running:
            self.start()

    # ---- directions

    def zero_yaw(self):
        """The direction it looks in now is yaw 0; yaw is certain again."""
        if self.running:
            self.tick.words[_ZERO_YAW] = self.tick.words[_ODD] = 1
        elif self.filter:
            self.filter.zero_yaw()

    def level_here(self):
        """It stands level now: roll and pitch read 0 from here on, kept with the mounting.

        Hold it still for a second. calibration.rest.NotStill (a ValueError) says how it moved.
        """
        return self.paused(self._level)

    def _level(self, imu):
        filters.forget_unused()
        with Briefly("firmware.levelling", *_FILES):
            from firmware.levelling import level

            return level(imu, self.config.calibration_path)

    def forget_scale(self):
        """The gyro's scale is unknown again: as learned in motion, and as stored. OSError."""
        with Briefly(*_FILES):
            from firmware.calibration import forget_scale

            self.paused(lambda imu: forget_scale(self.config.calibration_path))

    def recalibrate(self, calibration):
        """Correct the samples by this Calibration from the next tick on."""
        self.calibration = calibration
        wiring.prepare(self, calibration=calibration)

    def rested(self, calibration):
        """A rest has shown that the gyro's bias is this Calibration's."""
        wiring.rested(self, calibration)

    def other_part(self):
        """Another part was plugged in, whose biases nobody knows, nor how it was turned."""
        self.warnings.append("another sensor was plugged in (%s)" % self.imu.profile.name)
        self.calibration = self.calibration.mounting()
        wiring.learn(self, learning.NOTHING)
        wiring.begin_anew(self)

    # ---- what one asks

    def _must_run(self):
        if not self.running:
            raise ValueError("the loop does not run: app.start()")

    def sample(self):
        """A firmware.sample.Sample: the whole estimate of one tick, and whether to believe it."""
        if self.imu is None:
            self._must_run()
        words = self._copy
        while not estimate.read(self.tick.est, words):
            pass
        return sample.make(words, self.imu.accel_lsb_per_g, self.age_us, self.stale)

    def stats(self):
        """Timing, faults by cause and what else is counted, as a dict (firmware.stats)."""
        with Lasting(self.tidy("firmware.stats")):
            from firmware.stats import stats

        return stats(self)

    def report(self):
        """How the sensor is (firmware.report), as a dict; takes half a second, best at rest."""
        self._must_run()
        with Briefly(*_REPORT + _CLAIMS):
            from firmware.report import report

            return report(self)

    def watch(self, seconds=None):
        """Print the angles until a key is pressed (or for some seconds); the loop runs on."""
        self._must_run()
        self.tick.words[_DUE] = 0  # the foreground follows each tick from now on
        self.telemetry.watch(seconds)

    def samples(self):
        """`async for app in app.samples()`: wakes after each step; any number of readers."""
        if self.loop is None:
            self._must_run()
        return self.loop.samples(self)

    def self_test(self):
        """(passed, a line for each axis) of the chip's self-test, at rest; the loop pauses."""
        return self.paused(self._tested)

    def _tested(self, imu):
        with Briefly(*_REPORT):
            from firmware.report import tested

            return tested(imu)

    def calibrating(self):
        """The steps of a calibration (firmware.calibrating); ends the loop, start() goes on."""
        self.stop()
        self._calm = Feeding(self, _CALIBRATING_S)
        self._calm.__enter__()
        self._find_sensor()
        _hear_names()
        filters.forget_unused()
        with Briefly(*_CALIBRATING):  # the steps hold what they need
            from firmware.calibrating import Calibrating

            return Calibrating(self.imu, self.config.calibration_path)

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
    def yaw_doubt_deg(self):
        """How far outages may have put the yaw off since the start or zero_yaw(), degrees; one
        that lasts has hidden a change of the rate by now."""
        age_us = min(self.age_us, 1000000)
        if age_us <= self.tick.words[_LATE_US]:
            age_us = 0
        return self.tick.words[_YAW_DOUBT] / 1000 + _CHANGE_DPS2 / 2e12 * age_us * age_us

    @property
    def turned_deg(self):
        """Like yaw_deg, and whole turns counted: 725 after two turns and five degrees."""
        est = self.tick.est
        return (est[4] + 360000 * est[15]) / 1000

    @property
    def fresh(self):
        """Whether the last tick had a new good burst."""
        return self.tick.words[_AGE_US] == 0

    @property
    def age_us(self):
        """Age of the last good sample in microseconds, also when the ticks stay away."""
        return self.loop.age_us() if self.loop else 0

    @property
    def stale(self):
        """True when the last good sample is older than failsafe_ms, or the loop does not run."""
        return not self.running or self.age_us >= self.tick.words[_STALE_US]

    @property
    def uncertain(self):
        """True while the estimate is fresh but not known well enough to be claimed."""
        return not self.stale and self.tick.est[_UNCERTAIN] != 0


_heard = []  # type: list  # something, once it has heard the names


def _hear_names():
    """To be called before much code is loaded beside an app: what it brings of names is heard
    together, while there is a piece of heap for them (firmware.names)."""
    if _heard or gc.mem_free() > _SHORT:
        return
    _heard.append(1)
    gc.collect()
    try:
        with Briefly("firmware.names"):
            from firmware.names import hear

            hear()
    except ImportError:  # of an image: a frozen name needs no heap
        pass
    except MemoryError:  # then what comes finds none either, and says so
        gc.collect()


def _any(names, among):
    for name in names:
        if name in among:
            return True
    return False


micropython.alloc_emergency_exception_buf(200)  # also where boot.py is the user's own

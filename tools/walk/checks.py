# SPDX-License-Identifier: MIT
"""What the project promises, whatever happened. Registers are re-typed from the register map."""

from copy import copy
from math import acos, asin, atan2, cos, degrees, radians, sin

from tools.virtual.motion import quaternions as quat

TILT_DEG = 3.0
QUIET_S = 2.0
_ZERO_YAW = 11  # places of firmware.tick.words
_ERRORS = 20
_AT_REST = 11  # of firmware.tick.estimate
_DLPF_HZ = (260, 184, 94, 44, 21, 10, 5)  # DLPF_CFG (RM p. 13)
_GYRO_DPS = (250, 500, 1000, 2000)  # FS_SEL (RM p. 31)
_ACCEL_G = (2, 4, 8, 16)  # AFS_SEL (RM p. 29)
_TILTS_DPS = 2.5  # about a level axis, slower for a moment may pass for a bias
_SAFE_US = {"quad": 1000, "balance": 0}


def _twin(controller, app):
    """A controller made anew from the same knobs."""
    made = copy(controller)
    made.tune(app.period_us)
    return made


def _gains(controller):
    """All numbers that come from knobs and the period."""
    found = [value for value in vars(controller).values() if isinstance(value, int)]
    if hasattr(controller, "pid"):
        return found, list(controller.pid._coef)
    words = controller.control._s
    return found, [list(words[at : at + 16]) for at in (16, 36, 56)]


class Checks:
    """Looks at a tools.walk.world.World between its steps; AssertionError says what is broken."""

    def __init__(self, world):
        self.world = world
        self.trouble_s = world.now_s
        self.held_s = world.now_s  # the end of the last pause
        self.reference = None  # the true yaw that reads 0
        self.zeroing = False  # zero_yaw() was called, and waits for a tick
        self.allowed = 0.0  # how far the yaw may have drifted, degrees
        self.bias_known = False
        self.blind = False
        self.known = 0  # of the bias: firmware.learning
        self.looked_s = world.now_s
        self.unseen_dps = 0.0  # the fastest turn of the outage that is
        self.rested = False  # whether it was called a rest when that began

    # ---- what the steps tell

    def trouble(self, until_s=None, held=False):
        """Something happens that ends at until_s, now by default."""
        now = self.world.now_s
        self.trouble_s = max(self.trouble_s, until_s or now)
        if held:
            self.held_s = now

    def paused(self, began_s):
        """No tick came since began_s: an outage that nothing looked at."""
        app, now = self.world.app, self.world.now_s
        if not app.running or app.tick.est[_AT_REST] != 1 or now - began_s <= 1:
            return
        times = [began_s + (now - began_s) * part / 50 for part in range(51)]
        if max(map(self.world.motion.rate_dps, times)) > 1:
            self.reference = None

    def began(self):
        """start(): yaw is 0 where it looks now. A steady turn about the vertical, or a slow
        beginning, that was taken for the gyro's bias cannot be known: nothing is asked of that
        until the next start."""
        world, app, motion = self.world, self.world.app, self.world.motion
        back = [max(0.0, world.now_s - app.config.rest_s * part / 8) for part in range(9)]
        still = max(map(motion.rate_dps, back)) == 0.0
        told = any("bias not measured" in text for text in app.warnings)
        measured = app.config.rest_s > 0 and not told
        self.bias_known = measured and still
        self.blind = measured and not still and min(map(motion.level_dps, back)) < _TILTS_DPS
        self.known = app.learning.known
        self.zero()

    def zero(self):
        """The yaw is 0 where it looks now."""
        self.reference = self._heading()
        self.allowed = 1.0 + 0.025 * self.world.motion.rate_dps(self.world.now_s)
        self.zeroing = False

    def changed(self):
        """A set-up knob: half a degree each."""
        self.allowed += 0.7

    def called(self, result):
        """A call of the user's ended; a loop that should run does, or it is said."""
        world = self.world
        if world.should_run and not world.app.running:
            text = world.said + str(result)
            assert "stopped" in text, "the loop stands still, and nobody said so: %s" % text
            world.should_run = False
        self.look()

    # ---- what is looked at

    def look(self):
        """All of it."""
        world, app = self.world, self.world.app
        now = world.now_s
        self._drift(now - self.looked_s)
        self._first_rest(app)
        self._outage(app)
        self.looked_s = now
        self.zeroing = self.zeroing and app.running and app.tick.words[_ZERO_YAW] == 1
        self._nothing_raised(app)
        self._motors(app, now)
        if not app.running:
            assert app.stale
            return
        quiet = now - self.trouble_s
        if quiet > QUIET_S:
            assert not app.stale, "stale %.1f s after the last trouble" % quiet
            self._in_effect(app)
        if not app.stale and not app.uncertain:
            self._angles_right(app)

    def _nothing_raised(self, app):
        world = self.world
        assert world.port.errors == [], world.port.errors
        assert app.tick.words[_ERRORS] == 0, app.tick.error
        assert app.foreground.error is None, repr(app.foreground.error)
        raised = sum(motor.raised for motor in world.made)
        assert app.outputs.failed <= raised, repr(app.outputs.error)

    def _drift(self, dt_s):
        rate = self.world.motion.rate_dps(self.looked_s)
        self.allowed += dt_s * ((0.1 if self.bias_known else 2.0) + 0.015 * rate)

    def _first_rest(self, app):
        """As in began(), where the loop finds a rest and no bias is known yet."""
        if app.running and app.learning.known != self.known:
            motion, then = self.world.motion, self.looked_s
            if not self.known and motion.rate_dps(then) and motion.level_dps(then) < _TILTS_DPS:
                self.blind = True
            self.known = app.learning.known

    def _outage(self, app):
        """What turns from rest to rest in an outage of more than a second nobody can know."""
        if not app.running or app.age_us < 20000:
            self.unseen_dps, self.rested = 0.0, app.tick.est[_AT_REST] == 1
            return
        rate = self.world.motion.rate_dps(self.world.now_s)
        self.unseen_dps = max(self.unseen_dps, rate)
        if self.rested and app.age_us > 1000000 and self.unseen_dps > 1:
            self.reference = None

    def _motors(self, app, now):
        limit = app.config.failsafe_ms / 1000 + 0.03
        for motor in self.world.motors:
            if motor.on:
                assert app.running, "the loop has ended, and an output has not its safe value"
                since = now - max(motor.at_ns / 1e9, self.held_s)
                assert since < limit, "an output is not fed for %.3f s" % since
        for name, safe_us in _SAFE_US.items():
            if not app.has(name):
                continue
            armed = getattr(app, name).armed
            for pin in app.board.outputs:
                pwm = self.world.port.pin(pin).pwm
                at_ns, freq, duty = pwm.history[-1]
                if abs(duty / 65535 * 1e6 / freq - safe_us) < 1:
                    continue
                assert armed, "a motor turns, and %s is not armed" % name
                since = now - max(at_ns / 1e9, self.held_s)
                assert since < limit, "a motor is not fed for %.3f s" % since

    def _in_effect(self, app):
        config, registers = app.config, self.world.chip.registers
        own = 8000 if config.dlpf_hz == 260 else 1000
        wanted = config.rate_hz if config.drive == "data-ready" else config.sensor_hz
        assert registers[0x19] == round(own / wanted) - 1, "SMPLRT_DIV"
        assert _DLPF_HZ[registers[0x1A] & 7] == config.dlpf_hz, "CONFIG"
        assert _GYRO_DPS[registers[0x1B] >> 3 & 3] == config.gyro_dps, "GYRO_CONFIG"
        assert _ACCEL_G[registers[0x1C] >> 3 & 3] == config.accel_g, "ACCEL_CONFIG"
        assert registers[0x6B] & 0x40 == 0, "asleep"
        settings = app.filter._settings
        name = config.filter.split(".")[-1].replace("kalman2", "kalman")
        for knob, value in config.values().items():
            if knob.startswith(name + "_"):
                assert settings[knob[len(name) + 1 :]] == value, knob
        for controller in (getattr(app, n) for n in ("quad", "balance") if app.has(n)):
            assert _gains(controller) == _gains(_twin(controller, app)), "its gains"
        assert app.tick.now[2] is app.filter
        assert app.tick.words[5] == 1000 * config.failsafe_ms
        assert abs(app.period_us * config.rate_hz / 1e6 - 1) < 0.03, app.period_us
        assert abs(app.filter.period_us * config.rate_hz / 1e6 - 1) < 0.03, app.filter.period_us

    def _angles_right(self, app):
        sample = app.sample()
        if self.blind or not self._tuned(app.config):
            return
        error = self.tilt_error(sample)
        assert error < TILT_DEG, "tilt %.1f degrees off, and claimed" % error
        known = self.reference is not None and not self.zeroing
        if app.filter.knows_yaw and abs(sample.pitch_deg) < 60 and known:
            off = (sample.yaw_deg - self._heading() + self.reference + 180) % 360 - 180
            allowed = self.allowed + app.yaw_doubt_deg
            assert abs(off) < allowed, "yaw %.1f degrees off, allowed %.1f" % (off, allowed)

    def _tuned(self, config):
        """Whether the settings are those of somebody who wants right angles."""
        if config.dlpf_hz < 21 or config.sensor_hz < 200 or config.still_dps > 6:
            return False
        if not config.filter.endswith("attitude"):
            return False  # of roll or pitch alone, and only as good as it is tuned
        return (
            0.5 <= config.attitude_tau_s <= 20
            and config.attitude_rest_tau_s <= config.attitude_tau_s
            and config.attitude_rest_tau_s >= 0.3
            and config.attitude_bias_tau_s >= 10
        )

    # ---- truth

    def _truth(self):
        """At the instant of the last tick: (quaternion of the sensor, rows of its mounting)."""
        app, world = self.world.app, self.world
        since_s = app.loop.since_us() / 1e6 if app.loop and app.loop.running else 0.0
        m = app.calibration.gyro_matrix if app.calibration else (1, 0, 0, 0, 1, 0, 0, 0, 1)
        return world.chip.truth(world.now_s - since_s), (m[:3], m[3:6], m[6:])

    def tilt_error(self, sample):
        """Degrees between the true vertical and the claimed one, in the robot's frame."""
        q, rows = self._truth()
        up = quat.gravity(q)
        true = [sum(a * b for a, b in zip(row, up, strict=True)) for row in rows]
        roll, pitch = radians(sample.roll_deg), radians(sample.pitch_deg)
        told = (-sin(pitch), sin(roll) * cos(pitch), cos(roll) * cos(pitch))
        product = sum(a * b for a, b in zip(true, told, strict=True))
        cross = sum((a - b) ** 2 for a, b in zip(true, told, strict=True)) ** 0.5
        return degrees(2 * asin(min(1.0, cross / 2)) if product > 0 else acos(max(-1.0, product)))

    def _heading(self):
        """The true yaw of the robot's x axis, degrees."""
        (w, x, y, z), rows = self._truth()
        nose = quat.to_sensor((w, -x, -y, -z), *rows[0])
        return degrees(atan2(nose[1], nose[0]))

# SPDX-License-Identifier: MIT
"""What Attitude does once per block: rest, what up is, the loop's gain, and learning."""

from math import degrees, radians, sqrt

from .bounds import Bounds
from .gyro_learning import GyroLearning
from .gyro_view import GyroView
from .quaternion import levelling, product, rotate_back, unit, without_yaw
from .rest import Rest
from .up import Up

_YOUNG_S = 0.72  # the mean alone levels
_OLD_S = 100.0  # as if it had been running for so long, once it has rested
_RATE_S = 3.0  # over which rates are squared
_LOOK_S = 0.24  # between two looks, at one level axis and at the other; later twice as long
_LATER = 256  # looks
_YAW_S = 40.0  # for which an old bias answers for the yaw
_START_TILT, _REST_TILT = radians(15.0), radians(0.2)  # how badly a tilt is lost; after a rest
_TOLD = radians(3.0)  # how well another filter knows a bias
_TILT = radians(1.0)  # how well it is known when a slow tilt has passed for rest
_FASTER, _FASTEST, _FASTER_G, _SHAKEN = 0.3, 4.0, 0.003, 0.06
_START_SIGMAS = 3.0
_LEAST_G = 0.3  # less of gravity tells nothing
_WILD = 1.3  # rad: a block that turns further is no place to learn from, nor to level by its mean
LEARNING = ("start_sigma_dps", "scale_sigma", "cross_sigma", "bias_tau_s")


class Slow:
    """Keeps `.gain` (rad/s) and what is known of the gyro; settings as for Attitude."""

    def __init__(self, loop, tau_s, rest_tau_s, most_dps, most_sigmas, **settings):
        self.tau_s = tau_s
        self.rest_tau_s = rest_tau_s
        self.most_dps = most_dps
        self.most_sigmas = most_sigmas
        self.loop = loop
        self.learning = GyroLearning(
            **{name: settings.pop(name) for name in LEARNING if name in settings}
        )
        self.rest = Rest(**settings)
        self.view, self.up, self.bounds = GyroView(), Up(), Bounds()
        self.reset()

    def reset(self):
        """Forget everything."""
        self.blank = True  # not levelled yet: then yaw is 0
        self.rest.reset()
        self.learning.reset()
        self.bounds.clear()
        self._begin()
        self.forget_yaw()

    def known(self, settings):
        """See Attitude.known."""
        if self.blank:
            self.learning.known(settings)

    def relevel(self):
        """The next blocks level anew; what is known of the gyro stays."""
        self.rest.relevel()
        self._begin()

    def forget_yaw(self):
        """Yaw counts from here: what it was off by is no more."""
        self.view.forget_yaw()
        self.bounds.forget_yaw()
        self._held = [0.0, 0.0]

    def begin_at(self, bias_dps, home_dps, at_rest):
        """After reset(): begin with this bias, and the one last seen at rest or None; levelled,
        at_rest: by a rest."""
        self.blank = False
        self.rest.begin_at(home_dps)
        self.learning.rest([radians(b) for b in bias_dps])
        if home_dps is None:
            self.learning.sigma[:3] = [max(_TOLD, abs(radians(b))) for b in bias_dps]
        # a filter that has not told its bias at rest may not know all of it
        self._age_s = _OLD_S if home_dps else _YOUNG_S
        self._unknown = _REST_TILT if home_dps and at_rest else _START_TILT
        self.gain = self._gain_now()

    def _begin(self):
        self.view.clear()
        self.up.clear()
        self.gain = 0.0  # rad/s
        self._squares = [0.0, 0.0, 0.0]  # of the rates, (rad/s)^2, over some seconds
        self._age_s = self._looked_s = 0.0
        self._axis = 0  # looked at last
        self._unknown = 0.0  # tilt that is unknown from now on, rad
        self._change = None  # of the errors, by the last look
        self._held = [0.0, 0.0]  # of the yaw, taken off at rest since its bias was kept, before

    @property
    def young(self):
        """While the mean alone levels."""
        return self._age_s < _YOUNG_S

    def over_range(self):
        """The gyro has lost a part of a turn: as unsure as just after the start."""
        if self._age_s > 2.0 * _YOUNG_S:
            self._age_s = 2.0 * _YOUNG_S
            self.gain = max(self.gain, 1.0 / _YOUNG_S)
        self.bounds.over_range()
        self.view.clear()  # what is wrong now is no fault that could be learned
        self._unknown = _START_TILT

    def update(self, q, now, span_s, accel):
        """The attitude after a block: now is its mean of the matrix' rates (deg/s) and of the
        acceleration (g), accel the last sample's."""
        learning, rest = self.learning, self.rest
        q = self.made_good(q)
        was_at_rest = rest.at_rest
        q = self._watch_rest(q, now, span_s, accel)
        rates = [radians(rate) - bias for rate, bias in zip(now, learning.bias)]
        wild = max([abs(rate) for rate in rates]) * span_s > _WILD
        accel = now[3:]
        if self.young:  # later what a turn smears passes for acceleration
            accel = _at_the_end(accel, rates, span_s)
        self.up.update(q, None if wild else accel, span_s)
        q = self._level(q, span_s)
        last, self.gain = self.gain, self._gain_now()
        if rest.at_rest != was_at_rest:  # at rest is no velocity; one that ends it goes on
            self.loop.rescale(0.0 if rest.at_rest or not last else self.gain / last)
            self.view.clear()
            self._unknown = max(self._unknown, 0.0 if rest.at_rest else _REST_TILT)
        if self._unknown:
            self.view.begin_tilt()
            learning.unknown_tilt(self._unknown)
            self._unknown = 0.0
        limited = self.loop.limited()
        self._limit(span_s)
        k = min(1.0, span_s / _RATE_S)
        self._squares = [s + k * (rate * rate - s) for s, rate in zip(self._squares, rates)]
        if wild:
            self.view.clear()
        if not rest.at_rest:
            q = self._learn(q, rates, span_s, None if wild else limited)
        self.bounds.update(self.loop, span_s, rest.at_rest, self._age_s < 3.0 * _YOUNG_S)
        return q

    def _watch_rest(self, q, now, span_s, accel):
        """At rest the gyro reads its bias."""
        rest, learning, view = self.rest, self.learning, self.view
        was_at_rest, first = rest.at_rest, rest.since_s is None
        sigma = [degrees(learning.sigma[n]) for n in (0, 1, 2)]
        rest.update(now, span_s, accel, [degrees(b) for b in learning.bias], sigma)
        if not rest.at_rest:
            if was_at_rest:
                learning.bias = [radians(b) for b in rest.before_dps]
                q = self._turn(q, 0.0, 0.0, -sum(self._held))
                if rest.since_s is None:  # it was a slow tilt
                    learning.sigma[:3] = [_TILT] * 3
            return q
        if was_at_rest:  # what it has turned about the vertical was no turn
            turned = [span_s * (radians(rate) - b) for rate, b in zip(now, learning.bias)]
            yaw = sum([a * b for a, b in zip(rotate_back(q, 0.0, 0.0, 1.0), turned)])
            q = self._turn(q, 0.0, 0.0, yaw)
            if rest.kept_s == 0.0:
                self._held = [0.0, self._held[0]]
            self._held[0] += yaw
        else:
            self._held = [0.0, 0.0]
            # yaw as if the bias had been known
            change = [radians(b) - old for b, old in zip(rest.bias_dps, learning.bias)]
            q = self._turn(q, 0.0, 0.0, sum([a * b for a, b in zip(view.yaw, change)]))
            view.yaw[:3] = [0.0, 0.0, 0.0]
        learning.rest([radians(b) for b in rest.bias_dps])
        if first and not rest.moved:  # still since power-on: start again, with the bias
            q = without_yaw(levelling(*rest.mean[3:]))
            self.forget_yaw()
        self._age_s = max(self._age_s, _OLD_S)
        return q

    def _level(self, q, span_s):
        """Young, the mean is up; later a lost attitude starts again."""
        young = self.young
        found = self.up.levelled(q) if young else self.up.found(q)
        if young and not found:
            return q  # no gravity has been seen yet
        self._age_s += span_s
        if young:
            if self._age_s >= _YOUNG_S:
                self._unknown = self._levelled()
            q, self.blank = without_yaw(found) if self.blank else found, False
            return q
        if found:
            q, self._age_s = found, _YOUNG_S + span_s
            self.loop.clear()
            self.view.clear()
            self._unknown = _START_TILT
        return q

    def _levelled(self):
        """How well the mean has levelled, rad: what accelerated meanwhile, and turned unseen."""
        unseen = _YOUNG_S * 0.5 * self.learning.rate_sigma((0.0, 0.0, 0.0))
        return min(_START_TILT, sqrt(self.up.level_g**2 + 0.5 * unseen * unseen))

    def _gain_now(self):
        """In rad/s. None at first (the mean levels), then high until the age is 2 tau_s; the
        faster, the more the gyro may err beside what accelerations do."""
        if self.young:
            return 0.0
        errs = self.tau_s * self.learning.rate_sigma(self._squares)
        faster = sqrt(_FASTER * errs / (_FASTER_G + _SHAKEN * self.up.level_g))
        gain = max(max(1.0, min(_FASTEST, faster)) / self.tau_s, 2.0 / self._age_s)
        return max(gain, 1.0 / self.rest_tau_s) if self.rest.at_rest else gain

    def _limit(self, span_s):
        """What the gyro does not explain is an acceleration."""
        loop, learning = self.loop, self.learning
        if self.rest.at_rest or not self.gain:
            loop.limit_g = None
            return
        errs = self.most_sigmas * learning.rate_sigma(self._squares) + radians(self.most_dps)
        x, y = learning.sigma[12:]
        unknown = max([abs(row[12]) for row in self.view.tilt]) * sqrt(x * x + y * y)
        loop.limit_g = errs / self.gain + _START_SIGMAS * unknown
        if loop.watch_speed(self.up.now[0], self.up.now[1], span_s):
            self._unknown = _START_TILT

    def _learn(self, q, rates, span_s, limited):
        """Follow how the gyro's errors show; every so often, look at what has shown. limited:
        what has reached its limit, None: nothing can be followed."""
        view, learning = self.view, self.learning
        if self.gain and limited:
            view.follow_level(q, rates, span_s, self.gain * span_s, limited)
        keep = 1.0 - span_s / _YAW_S
        self.bounds.bias_forgotten(view, learning, keep)
        view.follow_yaw(q, rates, span_s, keep)
        if not self.gain or not limited:
            return q
        self._looked_s += span_s
        wait_s = _LOOK_S if learning.looks < _LATER else 2.0 * _LOOK_S
        if self._looked_s < wait_s - 0.5 * span_s:
            return q
        span_s, self._looked_s = self._looked_s, 0.0
        axis = self._axis = 1 - self._axis
        if self.up.now[2] <= _LEAST_G or limited[axis]:
            return q  # in free fall, or pushed
        learning.walk(span_s, self.rest.since_s)
        shaken = self.up.level_g * max(1.0, self.gain * self.tau_s)
        position = (self.loop.px, self.loop.py)[axis]
        self._change = learning.look(view.of(2, axis), position, shaken)
        self.bounds.explained(axis, learning.explained)
        return q

    def made_good(self, q):
        """Attitude and loop as if what the last look has told had always been known."""
        change, self._change = self._change, None
        if not change:
            return q
        self.learning.correct(change)
        tilt, velocity, position = [
            [sum([a * b for a, b in zip(self.view.of(kind, axis), change)]) for axis in (0, 1)]
            for kind in (0, 1, 2)
        ]
        loop = self.loop
        loop.vx, loop.vy = loop.vx - velocity[0], loop.vy - velocity[1]
        loop.px, loop.py = loop.px - position[0], loop.py - position[1]
        yaw = sum([a * b for a, b in zip(self.view.yaw, change)])
        return self._turn(q, tilt[0], tilt[1], yaw)

    def _turn(self, q, tilt_x, tilt_y, yaw):
        """Take off what the level axes and the yaw are too far, rad."""
        return unit(product((1.0, 0.5 * tilt_y, -0.5 * tilt_x, -0.5 * yaw), q))

    def state(self):
        """All that changes, for set_state()."""
        own = (self.blank, self.gain, tuple(self._squares), self._age_s, self._looked_s,
               self._axis, self._unknown, self._change, tuple(self._held))
        parts = (self.rest, self.learning, self.view, self.up, self.bounds)
        return own, tuple([part.state() for part in parts])

    def set_state(self, state):
        """Go on from a state()."""
        own, states = state
        (self.blank, self.gain, squares, self._age_s, self._looked_s, self._axis,
         self._unknown, self._change, held) = own
        self._squares, self._held = list(squares), list(held)
        parts: tuple = (self.rest, self.learning, self.view, self.up, self.bounds)
        for part, value in zip(parts, states):
            part.set_state(value)


def _at_the_end(v, rates, span_s):
    """The block's mean in the axes that the sensor has at its end: half of its turn further."""
    x, y, z = [0.5 * span_s * rate for rate in rates]
    a, b, c = v
    return a + z * b - y * c, b + x * c - z * a, c + y * a - x * b

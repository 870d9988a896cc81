# SPDX-License-Identifier: MIT
"""What is known of the gyro's bias while the loop runs.

A rest is known by both sensors; a bias by rests that agree, and by what is stored for this
temperature. A steady turn about the vertical looks the same to both: it is told from a rest by
what is known, and where nothing is, the later and smaller rate is the bias. What was measured in
motion is none.
"""

from calibration.thermal import BiasLearner
from calibration.watch import BIAS_LIMIT_DPS, Watch, near, turn_dps
from micropython import const

# how well the bias is known
NOTHING = const(0)
ONCE = const(1)  # measured at one rest, which may have been a turn
SURE = const(2)  # stored and not contradicted, or measured at two rests

# a bias is no further from that of the last rest, and for each degC
_BOUND_DPS = const(0.15)
BOUND_DPS_PER_C = 0.05
_LOOKS = const(15)  # at 5 a second: three seconds of rest
_ON_END = const(4)  # of which so many on end make a mean to be learned
TILTED_G = 0.008  # from the first to the last of them
_RESTS = const(20)  # a minute of it is no turn
_LONG = const(40)  # nor are two, of a rate that is not the bias as known
_TURN_DPS = const(1.97)  # a start's rest that was a turn: that much faster
_DRIFT_DPS = const(2.0)  # and further no bias moves by itself
# without a rest: when all of the bias is known so well in motion, deg/s; then what is left of
# it, turned from the vertical, tilts by little until the filter has seen it
_LEARNED_DPS = const(5.0)
_SECONDS = const(8)  # for so long
_UNSURE_US = const(16)  # a place of firmware.tick.words
_LONG_US = const(60000000)
_PUSHED = const(2)  # of a filter's doubts
_LOOK_US = const(400000)  # two looks: until the next one the tilt is as uncertain as at this
_SLOPE_MAX = const(0.7)  # deg/s per degC: twice the datasheet's (PS p. 12)


class Learning:
    """Follows the chip's temperature, and learns the gyro's bias at rests, some looks a second.

    cal: the calibration at the start; known: how well its bias is; imu: the driver; words:
    firmware.tick.words, where the tilt is called uncertain. warmed, taken: called with a
    Calibration that the temperature, or a rest, has made another. Allocates when three seconds of
    rest have been seen, or the temperature has moved by a degree.
    """

    def __init__(self, cal, known, imu, words, still_dps, warmed, taken):
        self.cal, self.known = cal, known
        self._imu, self._words = imu, words
        self._warmed, self._taken = warmed, taken
        self._watch = Watch(imu, _LOOKS, still_dps / 2)
        self._learner = BiasLearner(cal)
        self._degree = int(imu.profile.temp_lsb_per_c)
        self._raw = imu.counts[3]
        self._slopes = any(cal.gyro_slope_dps_per_c) or any(cal.accel_slope_g_per_c)
        self._bias, self._temp_c = cal.gyro_bias_dps, cal.temp_c  # of the last rest
        self._on_end = []  # rests that agree, since it moved last
        self._agreed = 0  # how many have
        self._other, self._other_on_end = None, 0  # a rate that may be the bias instead
        self._former = None  # and one that was taken for it
        self._moved = False
        self._unsure = known == NOTHING
        self._rested = 0  # looks in a row at which the filter called it rest
        self._learned = 0  # seconds in a row in which it knew all of the bias without
        self.rests = 0  # that were learned

    def look(self, filter, at_rest, second):
        """Some times a second; `second`: once a second."""
        if self._watch.fresh():
            self._look(filter, at_rest, second)
        elif self._unsure:  # an outage shows no rest
            self._words[_UNSURE_US] = _LONG_US
        if filter.uncertain == _PUSHED and self._words[_UNSURE_US] < _LOOK_US:
            self._words[_UNSURE_US] = _LOOK_US  # how long it levels after a gap the tick knows

    def _look(self, filter, at_rest, second):
        counts = self._imu.counts
        if second and self._slopes and abs(counts[3] - self._raw) > self._degree:
            self._raw = counts[3]
            self._warmed(self.cal.at(self._imu.temp_c()))
        if self._unsure:
            self._rested = self._rested + 1 if at_rest else 0
            self._unsure = self._rested < _LOOKS // 2  # by then the filter knows it by itself
            if second:
                self._learned = self._learned + 1 if _has_learned(filter) else 0
                self._unsure = self._unsure and self._learned < _SECONDS
            self._words[_UNSURE_US] = _LONG_US if self._unsure else 0
        seen = self._watch.look()
        if seen < 0:
            self._has_moved()
        elif seen:
            self._judge(self._watch.rest())

    def begin(self):
        """The loop begins."""
        if self._unsure:
            self._words[_UNSURE_US] = _LONG_US

    def _has_moved(self):
        self._moved = True
        self._on_end, self._other_on_end = [], 0

    def _judge(self, still):
        """Three seconds of rest, or of a steady turn."""
        bound = _BOUND_DPS + BOUND_DPS_PER_C * abs(still.temp_c - self._temp_c)
        if not near(still.gyro_dps, (0.0, 0.0, 0.0), BIAS_LIMIT_DPS):
            self._has_moved()  # no bias is so large
        elif self.known == NOTHING:
            self._take(still)
        elif near(still.gyro_dps, self._bias, bound):
            self._agree(still)
        elif self._former and near(still.gyro_dps, self._former, bound):
            self._take(still)
            self.known = SURE
        elif not turn_dps(still, self._bias, bound):
            self._take(still)  # it is level, and that is no turn
        elif self._was_a_turn(still, bound):
            former = self._bias
            self._take(still)
            self._former = former
        else:
            self._on_end = []

    def _agree(self, still):
        if self._on_end and not near(still.accel_g, self._on_end[0].accel_g, TILTED_G):
            self._has_moved()  # slowly
            return
        self._on_end.append(still)
        self._other_on_end = 0
        self._agreed += 1
        if self._moved or self._agreed >= _RESTS:
            self.known, self._former = SURE, None
        if len(self._on_end) == _ON_END:
            gyro = [sum(axis) / _ON_END for axis in zip(*[one.gyro_dps for one in self._on_end])]
            self._bias, self._temp_c = gyro, sum([one.temp_c for one in self._on_end]) / _ON_END
            self._learner.rested(self._temp_c, gyro)
            self.rests += 1
            self._on_end, self._moved = [], False

    def _was_a_turn(self, still, bound):
        """Whether what passed for the bias was a turn, and this is it."""
        if not (self._other and near(still.gyro_dps, self._other, bound)):
            self._other, self._other_on_end = still.gyro_dps, 0
        self._other_on_end += 1
        is_dps = _along(still.gyro_dps, still.accel_g)
        was_dps = _along(self._bias, still.accel_g)
        if self._other_on_end >= _LONG and abs(is_dps - was_dps) < _DRIFT_DPS:
            return True
        slower = abs(was_dps) - abs(is_dps) > _TURN_DPS
        return self.known == ONCE and slower and self._other_on_end >= self._agreed

    def _take(self, still):
        """This is the bias; whatever was learned before is not."""
        self.cal = self.cal.at(still.temp_c).but(gyro_bias_dps=still.gyro_dps)
        self.known, self.rests, self._agreed = ONCE, 0, 0
        self._bias, self._temp_c, self._on_end = still.gyro_dps, still.temp_c, []
        self._moved, self._former, self._unsure = False, None, False
        self._learner = BiasLearner(self.cal)
        self._words[_UNSURE_US] = 0
        self._taken(self.cal)

    def learned(self):
        """The calibration with what is worth storing, or None: nothing new, not sure, not sound.
        """
        if self.known != SURE or not self.rests:
            return None
        new = self._learner.calibration()
        if max([abs(s) for s in new.gyro_slope_dps_per_c]) > _SLOPE_MAX:
            new = new.but(gyro_slope_dps_per_c=self.cal.gyro_slope_dps_per_c)
        return new


def _has_learned(filter):
    """Whether it knows its gyro's bias without a rest, which few filters can."""
    if filter.uncertain or not hasattr(filter, "bias_sigma_dps"):
        return False
    return max(filter.bias_sigma_dps) < _LEARNED_DPS


def _along(v, accel_g):
    length = sum([a * a for a in accel_g]) ** 0.5
    return sum([x * a for x, a in zip(v, accel_g)]) / length

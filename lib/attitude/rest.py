# SPDX-License-Identifier: MIT
"""When a sensor rests, and what its gyro reads then: the bias."""

_MEAN_S = 0.5
_TILTED_G = 0.05  # the mean acceleration moves by less while it rests
_FIRST_TILTED_G = 0.0167  # the same at the first rest, of whose bias nothing is known: a degree
_STEP_DPS, _DRIFT_DPS_S = 0.2, 0.0005  # a steady rate further from the last bias is motion
_STEADY_S = 120.0  # but one that is steady for longer is none
_SIGMAS = 4.0  # from a bias that is not known well
_KEEP_S = 1.0  # the bias that stays when it moves is older: motion begins before it is seen


class Rest:
    """Finds rest and averages the bias there, from means over short blocks.

    rest_s          how long it must be still before it counts as rest
    rest_gyro_dps, rest_accel_g   largest deviation from the half-second mean that is still
    rest_shaken_g   the same of a single sample's acceleration: motors shake what flies
    rest_bias_s     averaging time of the bias at rest
    bias_limit_dps  change of the bias that is believed, however long it was not seen
    start_bias_dps  the same before the first rest (datasheet: +-20 deg/s from the factory)
    """

    def __init__(self, rest_s=1.5, rest_gyro_dps=1.0, rest_accel_g=0.04, rest_shaken_g=16.0,
                 rest_bias_s=6.0, bias_limit_dps=2.0, start_bias_dps=20.0):
        if rest_bias_s <= 0:
            raise ValueError("rest_bias_s must be positive")
        self.rest_s = rest_s
        self.rest_gyro_dps = rest_gyro_dps
        self.rest_accel_g = rest_accel_g
        self.rest_shaken_g = rest_shaken_g
        self.rest_bias_s = rest_bias_s
        self.bias_limit_dps = bias_limit_dps
        self.start_bias_dps = start_bias_dps
        self.reset()

    def reset(self):
        """Forget the bias and what rest looked like."""
        self.mean = None  # of the last half second: gyro (deg/s), accelerometer (g)
        self.moved = False  # since the start
        self.since_s = None  # since the last rest; None before the first
        self._tilts = False  # the mean acceleration has moved
        self._sure = False  # the first rest was no slow tilt
        self.bias_dps = [0.0, 0.0, 0.0]  # averaged at rest
        self.before_dps: tuple = (0.0, 0.0, 0.0)  # the same, _KEEP_S to twice that ago
        self._next_dps: tuple = (0.0, 0.0, 0.0)
        self._first = (0.0, 0.0, 0.0)  # acceleration when it became still
        self._still_s = self._steady_s = self._rested_s = self.kept_s = 0.0

    def relevel(self):
        """After a gap: the bias stays, what rest looks like does not."""
        self.mean = None
        self.moved = True  # who knows
        self._still_s = self._steady_s = 0.0

    def begin_at(self, home_dps):
        """After reset(): begin with this bias as last seen at rest, None when it never was."""
        self.moved = True
        if home_dps:
            self.since_s = 0.0
            self.bias_dps = list(home_dps)
            self.before_dps = self._next_dps = tuple(home_dps)

    @property
    def home_dps(self):
        """The bias as last seen at rest; None before the first rest."""
        return None if self.since_s is None else self.before_dps

    @property
    def at_rest(self):
        """True when it has stood still for rest_s."""
        return self._still_s >= self.rest_s

    def update(self, now, span_s, accel, bias_dps, sigma_dps):
        """Take a block's means: gyro x y z in deg/s, accelerometer x y z in g, over span_s, and
        its last acceleration; what the bias is believed to be, and how well that is known.

        A first rest that ends in a slow tilt was none: what its gyro read was the tilt.
        """
        rested = self.at_rest
        steady = self._is_steady(now, span_s, accel)
        if self.since_s is not None:
            self.since_s += span_s
        steady = steady and self._is_bias(bias_dps, sigma_dps)
        if steady and not self._tilts:
            self._still_s = min(self._still_s + span_s, self.rest_s)
        else:
            self._still_s = 0.0
            self.moved = True
        if self.at_rest:
            self._average(now, span_s, rested)
        elif rested and steady and not self._sure:
            self.since_s = None
        elif rested:
            self._sure = True

    def _is_steady(self, now, span_s, accel):
        """Whether gyro and accelerometer stay at their mean; `_tilts`: but not the mean itself."""
        if self.mean is None:
            self.mean = list(now)
        mean = self.mean
        if self._still_s == 0.0:
            self._first = tuple(mean[3:])
        k = min(1.0, span_s / _MEAN_S)
        steady, self._tilts = True, False
        tilted_g = _TILTED_G if self._sure else _FIRST_TILTED_G
        for i in range(6):
            mean[i] += k * (now[i] - mean[i])
            if abs(now[i] - mean[i]) > (self.rest_gyro_dps if i < 3 else self.rest_accel_g):
                steady = False
            if i >= 3 and abs(accel[i - 3] - mean[i]) > self.rest_shaken_g:
                steady = False
            if i >= 3 and abs(mean[i] - self._first[i - 3]) > tilted_g:
                self._tilts = True
        lasts = steady and not self._tilts
        self._steady_s = min(self._steady_s + span_s, 2.0 * _STEADY_S) if lasts else 0.0
        return steady

    def _is_bias(self, bias_dps, sigma_dps):
        """Whether the mean rate can be the bias: what is known of it bounds what is believed."""
        for i in range(3):
            off = abs(self.mean[i] - bias_dps[i])
            if self.since_s is None:
                limit = min(self.start_bias_dps, _STEP_DPS + _SIGMAS * sigma_dps[i])
            else:
                limit = min(self.bias_limit_dps, _STEP_DPS + _DRIFT_DPS_S * self.since_s)
                if self._steady_s > _STEADY_S:
                    limit = self.bias_limit_dps
                home = abs(self.mean[i] - self.before_dps[i])
                off = home if self.at_rest else min(off, home)
            if off > limit or abs(self.mean[i]) > self.start_bias_dps:
                return False
        return True

    def _average(self, now, span_s, rested):
        if not rested:
            self._rested_s, self.kept_s = self.rest_s, 0.0
        self._rested_s = min(self._rested_s + span_s, self.rest_bias_s)
        self._sure = self._sure or self._rested_s == self.rest_bias_s
        k = min(1.0, span_s / self._rested_s)
        for i in range(3):
            self.bias_dps[i] += k * (now[i] - self.bias_dps[i])
        if self.since_s is None:
            self.bias_dps = self.mean[:3]
        self.kept_s += span_s
        if not rested:
            self.before_dps = self._next_dps = tuple(self.bias_dps)
        elif self.kept_s >= _KEEP_S:
            self.kept_s = 0.0
            self.before_dps, self._next_dps = self._next_dps, tuple(self.bias_dps)
        self.since_s = 0.0

    def state(self):
        """All that changes, for set_state()."""
        return (self.mean and tuple(self.mean), self.moved, self.since_s, tuple(self.bias_dps),
                self.before_dps, self._next_dps, self._first, self._still_s, self._steady_s,
                self._rested_s, self.kept_s, self._sure)

    def set_state(self, state):
        """Go on from a state()."""
        (mean, self.moved, self.since_s, bias, self.before_dps, self._next_dps, self._first,
         self._still_s, self._steady_s, self._rested_s, self.kept_s, self._sure) = state
        self.mean = mean and list(mean)
        self.bias_dps = list(bias)

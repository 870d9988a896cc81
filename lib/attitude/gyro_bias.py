# SPDX-License-Identifier: MIT
"""Gyro bias, learned at once whenever the sensor rests, slowly while it moves."""

_MEAN_S = 0.5
_QUICK_S = 5.0


class GyroBias:
    """Finds rest and keeps `.bias_dps` (a list of three), from means over short blocks.

    rest_s          how long it must be still before it counts as rest
    rest_gyro_dps, rest_accel_g   largest deviation from the half-second mean that is still
    rest_bias_s     averaging time of the bias at rest
    bias_tau_s      time constant of the bias in motion
    bias_limit_dps  bias change that is believed; a steady rate beyond it is motion, not bias
    start_bias_dps  the same before the first rest (datasheet: +-20 deg/s from the factory)
    """

    def __init__(self, rest_s=1.5, rest_gyro_dps=1.0, rest_accel_g=0.04, rest_bias_s=6.0,
                 bias_tau_s=30.0, bias_limit_dps=2.0, start_bias_dps=20.0):
        if min(rest_bias_s, bias_tau_s) <= 0:
            raise ValueError("rest_bias_s and bias_tau_s must be positive")
        self.rest_s = rest_s
        self.rest_gyro_dps = rest_gyro_dps
        self.rest_accel_g = rest_accel_g
        self.rest_bias_s = rest_bias_s
        self.bias_tau_s = bias_tau_s
        self.bias_limit_dps = bias_limit_dps
        self.start_bias_dps = start_bias_dps
        self.reset()

    def reset(self):
        """Forget the bias and what rest looked like."""
        self.bias_dps = [0.0, 0.0, 0.0]
        self.mean = None  # of the last half second: gyro (deg/s), accelerometer (g)
        self.learned = False  # has rested once
        self.moved = False
        self._home = [0.0, 0.0, 0.0]  # the bias as last seen at rest
        self._still_s = self._rested_s = self._known_s = 0.0

    def relevel(self):
        """After a gap: the bias and what is known of it stay, what rest looks like does not."""
        self.mean = None
        self.moved = True  # who knows
        self._still_s = 0.0

    def begin_at(self, bias_dps, home_dps):
        """Begin with this bias, and the one last seen at rest, None when it never has been."""
        self.reset()
        self.moved = True
        self.bias_dps = list(bias_dps)
        self._home = list(home_dps or bias_dps)
        if home_dps:
            self.learned = True
            self._rested_s, self._known_s = self.rest_bias_s, self.bias_tau_s

    @property
    def home_dps(self):
        """The bias as last seen at rest; None before the first rest."""
        return tuple(self._home) if self.learned else None

    @property
    def at_rest(self):
        """True when it has stood still for rest_s."""
        return self._still_s >= self.rest_s

    @property
    def _limit(self):
        return self.bias_limit_dps if self.learned else self.start_bias_dps

    def update(self, now, span_s):
        """Take a block's means: gyro x y z in deg/s, accelerometer x y z in g, over span_s."""
        if self._is_still(now, span_s):
            self._still_s = min(self._still_s + span_s, self.rest_s)
        else:
            self._still_s = 0.0
            self.moved = True
        if not self.at_rest:
            return
        self._home = self.mean[:3]
        self._known_s = self.bias_tau_s
        if not self.learned:
            self.learned = True
            self.bias_dps = self.mean[:3]
        self._rested_s = min(self._rested_s + span_s, self.rest_bias_s)
        k = min(1.0, span_s / self._rested_s)
        for i in range(3):
            self.bias_dps[i] += k * (now[i] - self.bias_dps[i])

    def _is_still(self, now, span_s):
        """Whether gyro and accelerometer stay at their mean, and the gyro near its bias."""
        if self.mean is None:
            self.mean = list(now)
        mean = self.mean
        k = min(1.0, span_s / _MEAN_S)
        still = True
        for i in range(6):
            mean[i] += k * (now[i] - mean[i])
            if abs(now[i] - mean[i]) > (self.rest_gyro_dps if i < 3 else self.rest_accel_g):
                still = False
            if i < 3 and abs(now[i] - self._home[i]) > self._limit:
                still = False
        return still

    def learn(self, change_dps, span_s):
        """In motion: go the way that the level loop's correction shows, in deg/s, for span_s.

        Quick as long as the bias has been watched for a short time only; never far from the bias
        last seen at rest.
        """
        self._known_s = min(self._known_s + span_s, self.bias_tau_s)
        k = span_s / max(_QUICK_S, self._known_s)
        for i in range(3):
            home = self._home[i]
            bias = self.bias_dps[i] + k * change_dps[i]
            self.bias_dps[i] = max(home - self._limit, min(home + self._limit, bias))

    def state(self):
        """All that changes, for set_state()."""
        return (tuple(self.bias_dps), self.mean and tuple(self.mean), self.learned, self.moved,
                tuple(self._home), self._still_s, self._rested_s, self._known_s)

    def set_state(self, state):
        """Go on from a state()."""
        (bias, mean, self.learned, self.moved, home,
         self._still_s, self._rested_s, self._known_s) = state
        self.bias_dps = list(bias)
        self.mean = mean and list(mean)
        self._home = list(home)

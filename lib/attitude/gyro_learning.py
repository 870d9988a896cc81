# SPDX-License-Identifier: MIT
"""What the gyro's errors are, and how well that is known: a Kalman filter of GyroView's errors.

The errors hardly change, so there is nothing to predict: only a bias walks. What is seen is the
position of the level loop, which a perfect gyro would leave at zero but for the accelerations.
Whatever is learned is made good as if it had always been known: in the rates to come, and by the
view in attitude and loop, whose position is therefore all of the innovation. Of the covariance
it keeps what earns its cost: each error's sigma, and how the scales are related, since often all
of them are off by the same.
"""

from math import radians, sqrt

SCALES = (3, 7, 11)  # the matrix' diagonal

_MOST_SIGMAS = 3.0  # an innovation counts no more
_MOST_SCALE = 0.06  # twice the datasheet's tolerance
_CORRELATED = 9.0  # the position's noise lasts for seconds: looks that tell as much as one
_LEAST_G = 0.002  # noise of a position, and what it is taken for at first
_NOISE_K = 0.008  # of a look: 80 s for both axes
_SHAKEN, _SHAKEN_AT_FIRST, _SHAKEN_LOOKS = 0.02, 0.06, 80.0  # noise by the level acceleration
_REST_SIGMA = radians(0.01)  # how well a rest tells the bias
_LEAST = 6e-5  # nothing is ever known better
_RELATED = 0.98
_BELIEVED = 0.5  # of what a look tells: others may explain it as well, and are not related here
_WALKED, _WALKS = radians(0.05), radians(0.002)  # it is no further from the last rest's: a + b t


class GyroLearning:
    """Keeps `matrix` (9 numbers) and `bias` (3, rad/s): a true rate is matrix w - bias.

    start_sigma_dps  how well the bias is known before the first rest, deg/s
    scale_sigma      how well each axis' scale is known: 0.02 of a part that nobody calibrated
    cross_sigma      the same of the other elements of the matrix
    bias_tau_s       time constant of a bias in motion, seconds
    """

    def __init__(self, start_sigma_dps=10.0, scale_sigma=0.02, cross_sigma=0.003,
                 bias_tau_s=30.0):
        if min(start_sigma_dps, bias_tau_s) <= 0 or min(scale_sigma, cross_sigma) < 0:
            raise ValueError("start_sigma_dps, bias_tau_s must be positive, no sigma negative")
        self.start_sigma_dps = start_sigma_dps
        self.scale_sigma = scale_sigma
        self.cross_sigma = cross_sigma
        self.bias_tau_s = bias_tau_s
        self._walk = radians(0.9 / bias_tau_s) ** 2  # (rad/s)^2 per second
        self.reset()

    def known(self, settings):
        """Some of the settings, before anything has been learned."""
        for name, value in settings.items():
            setattr(self, name, value)
        self.reset()

    def reset(self):
        """Nothing is known but the settings."""
        self.matrix = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
        self.bias = [0.0, 0.0, 0.0]
        self.sigma = [radians(self.start_sigma_dps)] * 3 + [self.cross_sigma] * 9 + [0.0] * 2
        for n in SCALES:
            self.sigma[n] = self.scale_sigma
        self.related = [0.0] * 3  # correlations of the scales: y with z, z with x, x with y
        self._noise = _LEAST_G * _LEAST_G  # g^2, variance of what no error explains
        self.looks = 0
        self.explained = 0.0  # variance of the last look's position by the errors, g^2

    def rest(self, bias):
        """At rest the bias (rad/s) is read and the tilt is seen."""
        self.bias = list(bias)
        self.sigma[:3] = [_REST_SIGMA] * 3
        self.unknown_tilt(0.0)

    def unknown_tilt(self, sigma):
        """The attitude is wrong by this sigma (rad) on each level axis, as never before."""
        self.sigma[12:] = [sigma] * 2

    def walk(self, span_s, since_s):
        """The biases walk for span_s; they were read since_s ago (None: never)."""
        for n in (0, 1, 2):
            sigma = self.sigma[n] + 0.5 * self._walk * span_s / self.sigma[n]
            if since_s is None or sigma < _WALKED + _WALKS * since_s:
                self.sigma[n] = sigma

    def look(self, seen, position_g, shaken_g):
        """What a level axis' position tells: the change of each error (ERRORS numbers).

        seen is the view of that position, shaken_g the level acceleration of late.
        """
        shares = [sigma * part for sigma, part in zip(self.sigma, seen)]
        told = self._related(shares)
        explained = self.explained = max(0.0, dot(told, shares))
        more = (_SHAKEN_AT_FIRST - _SHAKEN) / (1.0 + self.looks / _SHAKEN_LOOKS)
        noise = (_SHAKEN + more) * shaken_g
        total = explained + noise * noise + max(_LEAST_G * _LEAST_G, _CORRELATED * self._noise)
        root = sqrt(total)
        off = max(-_MOST_SIGMAS, min(_MOST_SIGMAS, position_g / root))
        told = [max(-1.0, min(1.0, part / root)) for part in told]
        change = [sigma * part * off for sigma, part in zip(self.sigma, told)]
        unexplained = max(0.0, position_g * position_g - explained)
        self._noise += _NOISE_K * (unexplained - self._noise)
        self.looks += 1
        self._settle(told)
        return change

    def _related(self, shares):
        """What each share of a position stands for, with those of the related scales."""
        told = list(shares)
        for n, related in enumerate(self.related):
            a, b = SCALES[n - 2], SCALES[n - 1]
            told[a] += related * shares[b]
            told[b] += related * shares[a]
        return told

    def _settle(self, told):
        """How well the errors are known after a look that told so many sigmas of each."""
        left = []
        for part in told:
            a = _BELIEVED * part * part  # its root to the third order
            left.append(1.0 - a * (0.5 + a * (0.125 + a * 0.0625)))
        for n in range(3):
            a, b = SCALES[n - 2], SCALES[n - 1]
            related = (self.related[n] - told[a] * told[b]) / (left[a] * left[b])
            self.related[n] = max(-_RELATED, min(_RELATED, related))
        self.sigma = [max(min(s, _LEAST), s * part) for s, part in zip(self.sigma, left)]

    def correct(self, change):
        """Calibrate by the gyro's part of a change."""
        matrix, bias = self.matrix, list(self.bias)
        for i in range(3):
            bias[i] += change[i]
            for k in range(3):  # the bias is of a rate that is true
                bias[i] -= change[3 + 3 * i + k] * self.bias[k]
        for n in range(9):
            ideal = 0.0 if n % 4 else 1.0
            value = matrix[n] - change[3 + n]
            matrix[n] = max(ideal - _MOST_SCALE, min(ideal + _MOST_SCALE, value))
        self.bias = bias

    def rate_sigma(self, squares):
        """By how much a level rate may be wrong, rad/s, at these mean squares of the rates."""
        total = 0.0
        for n in range(12):
            total += self.sigma[n] ** 2 * (1.0 if n < 3 else squares[n % 3])
        return sqrt(total * 2.0 / 3.0)

    def variance(self, view):
        """Of what the errors add up to in this view (a row of ERRORS or 12 numbers)."""
        shares = [sigma * part for sigma, part in zip(self.sigma, view)]
        return max(0.0, dot(self._related(shares), shares))

    def state(self):
        """All that changes, for set_state()."""
        return (tuple(self.matrix), tuple(self.bias), tuple(self.sigma), tuple(self.related),
                self._noise, self.looks)

    def set_state(self, state):
        """Go on from a state()."""
        matrix, bias, sigma, related, self._noise, self.looks = state
        self.matrix, self.bias = list(matrix), list(bias)
        self.sigma, self.related = list(sigma), list(related)


def dot(a, b):
    """The sum of the products, as far as the shorter one goes."""
    total = 0.0
    for x, y in zip(a, b):
        total += x * y
    return total

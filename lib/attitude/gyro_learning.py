# SPDX-License-Identifier: MIT
"""What the gyro's errors are, and how well that is known: a Kalman filter of GyroView's errors.

The errors hardly change, so there is nothing to predict: only a bias walks. What is seen is the
position of the level loop, which a perfect gyro would leave at zero but for the accelerations.
Whatever is learned is made good as if it had always been known: in the rates to come, and by the
view in attitude and loop, whose position is therefore all of the innovation.
"""

from math import radians, sqrt

from .gyro_view import ERRORS

_MOST_SIGMAS = 3.0  # an innovation counts no more
_MOST_SCALE = 0.06  # twice the datasheet's tolerance
_CORRELATED = 9.0  # the position's noise lasts for seconds: looks that tell as much as one
_LEAST_G = 0.002  # noise of a position, and what it is taken for at first
_NOISE_K = 0.008  # of a look: 80 s for both axes
_SHAKEN, _SHAKEN_AT_FIRST, _SHAKEN_LOOKS = 0.02, 0.06, 80.0  # noise by the level acceleration
_REST_SIGMA = radians(0.01)  # how well a rest tells the bias
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
        self.covariance = [[0.0] * ERRORS for _ in range(ERRORS)]
        for n in range(12):
            scale = self.scale_sigma if n % 4 == 3 else self.cross_sigma
            self.begin(n, radians(self.start_sigma_dps) if n < 3 else scale)
        self._noise = _LEAST_G * _LEAST_G  # g^2, variance of what no error explains
        self.looks = 0
        self._told, self._total, self._share = [0.0] * ERRORS, 1.0, 0.0  # of the last look
        self.explained = 0.0  # variance of the last look's position by the errors, g^2

    def begin(self, n, sigma):
        """Error n is unknown by sigma and related to no other."""
        for row in self.covariance:
            row[n] = 0.0
        self.covariance[n] = [0.0] * ERRORS
        self.covariance[n][n] = sigma * sigma

    def sigma(self, n):
        """How well error n is known."""
        return sqrt(max(0.0, self.covariance[n][n]))

    def rest(self, bias):
        """At rest the bias (rad/s) is read and the tilt is seen."""
        self.bias = list(bias)
        for n in (0, 1, 2):
            self.begin(n, _REST_SIGMA)
        for n in (12, 13):
            self.begin(n, 0.0)

    def walk(self, span_s, since_s):
        """The biases walk for span_s; they were read since_s ago (None: never)."""
        most = None if since_s is None else (_WALKED + _WALKS * since_s) ** 2
        for n in (0, 1, 2):
            variance = self.covariance[n][n] + self._walk * span_s
            if most is None or variance < most:
                self.covariance[n][n] = variance

    def look(self, seen, position_g, shaken_g):
        """Take a level axis' position; change() and settle() take what it tells.

        seen is the view of that position, shaken_g the level acceleration of late.
        """
        rows = self.covariance
        told = [dot(row, seen) for row in rows]
        explained = self.explained = max(0.0, dot(told, seen))
        more = (_SHAKEN_AT_FIRST - _SHAKEN) / (1.0 + self.looks / _SHAKEN_LOOKS)
        noise = (_SHAKEN + more) * shaken_g
        noise = noise * noise + max(_LEAST_G * _LEAST_G, _CORRELATED * self._noise)
        total = explained + noise
        most = _MOST_SIGMAS * sqrt(total)
        self._told, self._total = told, total
        self._share = max(-most, min(most, position_g)) / total
        unexplained = max(0.0, position_g * position_g - explained)
        self._noise += _NOISE_K * (unexplained - self._noise)
        self.looks += 1

    def change(self):
        """Of each error, what the last look tells (ERRORS numbers)."""
        return [self._share * part for part in self._told]

    def settle(self):
        """The covariance after the last look."""
        rows, told = self.covariance, self._told
        for n in range(ERRORS):
            part = told[n] / self._total
            rows[n] = [value - part * other for value, other in zip(rows[n], told)]

    def correct(self, change):
        """Calibrate by the gyro's part of a change: what is left of a rate w reads
        w + bias' + matrix' w too much."""
        a, b = self.matrix, self.bias
        matrix, bias = list(a), list(b)
        for i in range(3):
            bias[i] += change[i]
            for k in range(3):
                part = change[3 + 3 * i + k]
                bias[i] -= part * b[k]
                for j in range(3):
                    matrix[3 * i + j] -= part * a[3 * k + j]
        for n in range(9):
            ideal = 0.0 if n % 4 else 1.0
            matrix[n] = max(ideal - _MOST_SCALE, min(ideal + _MOST_SCALE, matrix[n]))
        self.matrix, self.bias = matrix, bias

    def rate_sigma(self, squares):
        """By how much a level rate may be wrong, rad/s, at these mean squares of the rates."""
        sigma = 0.0
        for n in range(12):
            sigma += self.covariance[n][n] * (1.0 if n < 3 else squares[n % 3])
        return sqrt(sigma * 2.0 / 3.0)

    def variance(self, view):
        """Of what the errors add up to in this view (a row of ERRORS or 12 numbers)."""
        return max(0.0, dot([dot(row, view) for row in self.covariance], view))

    def state(self):
        """All that changes, for set_state()."""
        rows = tuple([tuple(row) for row in self.covariance])
        look = (tuple(self._told), self._total, self._share)
        return tuple(self.matrix), tuple(self.bias), rows, self._noise, self.looks, look

    def set_state(self, state):
        """Go on from a state()."""
        matrix, bias, rows, self._noise, self.looks, look = state
        told, self._total, self._share = look
        self._told = list(told)
        self.matrix, self.bias = list(matrix), list(bias)
        self.covariance = [list(row) for row in rows]


def dot(a, b):
    """The sum of the products, as far as the shorter one goes."""
    total = 0.0
    for x, y in zip(a, b):
        total += x * y
    return total

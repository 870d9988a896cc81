# SPDX-License-Identifier: MIT
"""Kalman filter of several dimensions on small matrices, without numpy.

A matrix is a list of rows; a vector is a list. Meant for two to six states at some tens of hertz:
on an RP2040 correct() of two states takes 6 ms, and allocates: it is not for the tick.
"""


def _times(a, b):
    columns = list(zip(*b))
    return [[sum([x * y for x, y in zip(row, column)]) for column in columns] for row in a]


def _times_vector(a, v):
    return [sum([x * y for x, y in zip(row, v)]) for row in a]


def _plus(a, b, sign=1.0):
    return [[x + sign * y for x, y in zip(row_a, row_b)] for row_a, row_b in zip(a, b)]


def _transposed(a):
    return [list(column) for column in zip(*a)]


def _identity(n):
    return [[1.0 if i == j else 0.0 for j in range(n)] for i in range(n)]


def _solved(a, b):
    """X of a X = b by elimination with row pivots; ValueError where a is singular."""
    n = len(a)
    rows = [list(a[i]) + list(b[i]) for i in range(n)]
    for i in range(n):
        best = max(range(i, n), key=lambda k: abs(rows[k][i]))
        if rows[best][i] == 0.0:
            raise ValueError("KalmanND: singular matrix; is R positive?")
        rows[i], rows[best] = rows[best], rows[i]
        scale = 1.0 / rows[i][i]
        rows[i] = [x * scale for x in rows[i]]
        for k in range(n):
            if k != i and rows[k][i] != 0.0:
                factor = rows[k][i]
                rows[k] = [x - factor * y for x, y in zip(rows[k], rows[i])]
    return [row[n:] for row in rows]


class KalmanND:
    """x' = F x + B u + w, z = H x + v; Q and R are the covariances of w and v.

    Paper 001 (6-DOF IMU), eqs. 12-13 and Fig. 5; paper 000, eqs. 6-14 (its eq. 7 misprints
    P + F^T for P F^T). The covariance is corrected in Joseph's form, (I - K H) P (I - K H)^T +
    K R K^T: in single precision the papers' (I - K H) P can round to zero after one precise
    measurement, and the filter then listens to none ever after.

    F (n x n), H (m x n), Q (n x n), R (m x m), B (n x k or None); x and P: the start, zero and
    identity by default. Each may be replaced while it runs, F and B for a measured dt, say.
    """

    def __init__(self, F, H, Q, R, B=None, x=None, P=None):
        n = len(F)
        for name, matrix, rows, columns in (
            ("F", F, n, n), ("H", H, len(H), n), ("Q", Q, n, n), ("R", R, len(H), len(H)),
            ("B", B, n, None if not B else len(B[0])), ("P", P, n, n),
        ):
            if matrix is not None and (
                len(matrix) != rows or any(len(row) != columns for row in matrix)
            ):
                raise ValueError("KalmanND: %s must be %d x %s" % (name, rows, columns))
        self.F = F
        self.H = H
        self.Q = Q
        self.R = R
        self.B = B
        self.reset(x, P)

    def reset(self, x=None, P=None):
        """Start from state x with covariance P; the gain is computed again at each step."""
        n = len(self.F)
        self.x = [0.0] * n if x is None else list(x)
        self.P = _identity(n) if P is None else [list(row) for row in P]
        self.K = None
        self.steady = False

    def predict(self, u=None):
        """One step of time, with the control input u -> x."""
        x = _times_vector(self.F, self.x)
        if u is not None:
            x = [a + b for a, b in zip(x, _times_vector(self.B, u))]
        self.x = x
        if not self.steady:
            self.P = _plus(_times(_times(self.F, self.P), _transposed(self.F)), self.Q)
        return x

    def correct(self, z):
        """One measurement z (a vector) -> x."""
        if not self.steady:
            self._compute_gain()
        miss = [a - b for a, b in zip(z, _times_vector(self.H, self.x))]
        self.x = [a + b for a, b in zip(self.x, _times_vector(self.K, miss))]
        return self.x

    def update(self, z, u=None):
        """predict(u), then correct(z) -> x."""
        self.predict(u)
        return self.correct(z)

    def use_steady_gain(self, tolerance=1e-6, most=10000):
        """Compute the gain that F, H, Q, R lead to and keep it: a step then costs two products.

        For one correct() per predict(). Returns K. ValueError if it does not settle within
        `most` steps, as with an unobservable state that has noise.
        """
        self.steady = False
        for _ in range(most):
            old = self.K
            self.P = _plus(_times(_times(self.F, self.P), _transposed(self.F)), self.Q)
            self._compute_gain()
            if old is not None and _distance(old, self.K) <= tolerance * _distance(self.K):
                self.steady = True
                return self.K
        raise ValueError("KalmanND: the gain has not settled after %d steps" % most)

    def _compute_gain(self):
        H, P = self.H, self.P
        PHt = _times(P, _transposed(H))
        S = _plus(_times(H, PHt), self.R)
        K = _transposed(_solved(S, _transposed(PHt)))  # S is symmetric
        left = _plus(_identity(len(P)), _times(K, H), -1.0)
        P = _plus(
            _times(_times(left, P), _transposed(left)), _times(_times(K, self.R), _transposed(K))
        )
        self.P = _plus([[0.5 * x for x in row] for row in P],
                       [[0.5 * x for x in row] for row in _transposed(P)])
        self.K = K


def _distance(a, b=None):
    difference = a if b is None else _plus(a, b, -1.0)
    return max([abs(x) for row in difference for x in row])

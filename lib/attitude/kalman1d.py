# SPDX-License-Identifier: MIT
"""Kalman filter of one variable."""


class Kalman1D:
    """One noisy value, in its own unit; q and r are variances in that unit squared.

    Paper 000 (KalmanFilterLite), eqs. 2-4 and 15: P += Q, K = P / (P + R), X += K (M - X),
    P *= 1 - K. Its Fig. 8 has q 0.125, r 10. The list of symbols names P twice; nothing hangs
    on it.
    Paper 001, eqs. 9-11, is the same with q = 0 (E_EST is p, E_MEA is r). Without q the gain
    falls as 1/n: the output becomes the mean since the start and stops following the sensor,
    which looks smooth in its Fig. 4 and is of no use for an angle that moves.
    Paper 004 (MPU6050 Kalman) adds the gyro: pass rate * dt as `increment`, with q = (4 dt)^2,
    r = 3^2, p = 2^2. Its text gives R = (3 Ts)^2 and step 5 the factor (I - K F); its program
    has 3^2 and 1 - K, which is what works.
    """

    def __init__(self, q=0.125, r=10.0, p=1.0):
        if q < 0.0 or r < 0.0 or p < 0.0:
            raise ValueError("q, r and p are variances: not below 0")
        self.q = q
        self.r = r
        self._p_start = p
        self.reset()

    def reset(self, value=0.0, p=None):
        """Continue from this value with variance p (default: the constructor's)."""
        self.value = value
        self.p = self._p_start if p is None else p
        self.gain = 0.0

    def state(self):
        """What reset() takes to continue here."""
        return self.value, self.p

    def update(self, measurement, increment=0.0):
        """One measurement -> estimate; increment: known change since the last one (gyro * dt).

        A measurement that is not a finite number is left out: the estimate is predicted only.
        """
        value = self.value
        if increment - increment == 0.0:  # false for inf and nan
            value += increment
        p = self.p + self.q
        total = p + self.r
        if total > 0.0 and measurement - measurement == 0.0:
            gain = p / total
            value += gain * (measurement - value)
            p *= 1.0 - gain
            self.gain = gain
        self.p = p
        self.value = value
        return value

# SPDX-License-Identifier: MIT
"""Complementary filter: the gyro for what is fast, the accelerometer for what lasts."""

from attitude.tilt import wrap_deg


class Complementary:
    """Angle of one axis in degrees: A = alpha (A + rate dt) + (1 - alpha) accel_angle.

    Paper 000 (KalmanFilterLite), eq. 1, with P = alpha and Q = 1 - alpha; paper 002, eqs. 11-12;
    paper 001, eqs. 7-8 with alpha 0.9996, where the term printed as the "corrected gyro angle"
    must be the filter's last output plus the gyro's increment: taken as the gyro's own sum, the
    filter keeps 99.96 % of the drift that it is there to remove.

    Settings: tau_s, the time constant in seconds (about the time the gyro is trusted), means the
    same at every rate. alpha is per sample, as in the papers; with rate_hz, the rate that this
    alpha was tuned for, it is turned into tau_s. Without either, alpha is used as it stands.

    Motion about one axis only: body rates are not Euler rates. Use Attitude for free motion.
    """

    def __init__(self, alpha=0.98, tau_s=None, rate_hz=None):
        if not 0.0 <= alpha <= 1.0:
            raise ValueError("alpha %s: must be within 0 and 1" % alpha)
        if tau_s is not None and tau_s < 0.0:
            raise ValueError("tau_s %s: must not be negative" % tau_s)
        if tau_s is None and rate_hz is not None:
            if alpha == 1.0 or rate_hz <= 0.0:
                raise ValueError("alpha with rate_hz: alpha below 1, rate_hz above 0")
            tau_s = alpha / ((1.0 - alpha) * rate_hz)
        self.alpha = alpha
        self.tau_s = tau_s
        self.reset()

    def reset(self, angle_deg=0.0):
        """Continue from this angle; give the first accelerometer angle to start on it."""
        self.angle_deg = angle_deg

    def state(self):
        """What reset() takes to continue here."""
        return self.angle_deg

    def update(self, accel_angle_deg, gyro_dps, dt_s):
        """Angles in degrees, rate in deg/s, seconds since the last call -> angle within +-180.

        The difference is taken the short way round, so a roll through 180 degrees is no jump.
        A sample that is not a finite number is left out: the gyro's counts as rate 0, the
        accelerometer's as one that agrees.
        """
        angle = self.angle_deg
        if gyro_dps - gyro_dps == 0.0:  # false for inf and nan
            angle += gyro_dps * dt_s
        if accel_angle_deg - accel_angle_deg == 0.0:
            alpha = self.alpha if self.tau_s is None else self.tau_s / (self.tau_s + dt_s)
            angle += (1.0 - alpha) * wrap_deg(accel_angle_deg - angle)
        self.angle_deg = angle = wrap_deg(angle)
        return angle

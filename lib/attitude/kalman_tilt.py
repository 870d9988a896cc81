# SPDX-License-Identifier: MIT
"""Kalman filter of two states: the angle of one axis and the bias of its gyro."""

from attitude.tilt import wrap_deg


class KalmanTilt:
    """Angle of one axis in degrees and gyro bias in deg/s; settings are variances.

    Paper 000 (KalmanFilterLite), eqs. 16-27: q_angle (deg^2/s) and q_bias ((deg/s)^2/s) are the
    process noise, r_measure (deg^2) the accelerometer's. Misprints there: (7) reads P + F^T for
    P F^T; (12) calls the 2 x 1 gain 2 x 2; the last lines of (16) subtract dt (theta - theta_b)
    where they mean theta + dt (rate - bias); (17) has a minus before the last bracket of P00
    where (18) is right with plus; (24) K[0] = P01 / S, where (23) is right with P00 / S.
    Paper 002, eqs. 14-23, is the same filter; its pseudo code computes kv from Pxx where it
    needs Pxv, and adds Pvv to Pxx where Pxv is meant.

    P is symmetric, so P01 stands for both. Motion about one axis only, see Complementary.
    """

    def __init__(self, q_angle=0.001, q_bias=0.003, r_measure=0.03):
        if q_angle < 0.0 or q_bias < 0.0 or r_measure <= 0.0:
            raise ValueError("q_angle, q_bias: not below 0; r_measure: above 0")
        self.q_angle = q_angle
        self.q_bias = q_bias
        self.r_measure = r_measure
        self.reset()

    def reset(self, angle_deg=0.0, bias_dps=0.0, p00=0.0, p01=0.0, p11=0.0):
        """Continue from this state; the papers start with all of it zero.

        Give the first accelerometer angle, and the gyro's mean at rest, to start on them.
        """
        self.angle_deg = angle_deg
        self.bias_dps = bias_dps
        self.rate_dps = 0.0
        self.p00 = p00
        self.p01 = p01
        self.p11 = p11

    def state(self):
        """What reset() takes to continue here."""
        return self.angle_deg, self.bias_dps, self.p00, self.p01, self.p11

    def update(self, accel_angle_deg, gyro_dps, dt_s):
        """Angles in degrees, rate in deg/s, seconds since the last call -> angle within +-180.

        A sample that is not a finite number is left out: the gyro's counts as its last rate,
        the accelerometer's leaves the prediction as it is. `.rate_dps` is the rate less bias.
        """
        if gyro_dps - gyro_dps == 0.0:  # false for inf and nan
            self.rate_dps = gyro_dps - self.bias_dps
        angle = self.angle_deg + dt_s * self.rate_dps  # eq. 16
        p01 = self.p01
        p11 = self.p11
        p00 = self.p00 + dt_s * (dt_s * p11 - p01 - p01 + self.q_angle)  # eq. 18
        p01 -= dt_s * p11
        p11 += dt_s * self.q_bias
        s = p00 + self.r_measure  # eq. 22
        if s > 0.0 and accel_angle_deg - accel_angle_deg == 0.0:
            y = wrap_deg(accel_angle_deg - angle)  # eq. 20, the short way round
            k0 = p00 / s  # eq. 23
            k1 = p01 / s
            angle += k0 * y  # eq. 25
            self.bias_dps += k1 * y
            p11 -= k1 * p01  # eq. 27
            p01 -= k0 * p01
            p00 -= k0 * p00
        self.p00 = p00
        self.p01 = p01
        self.p11 = p11
        self.angle_deg = angle = wrap_deg(angle)
        return angle

# SPDX-License-Identifier: MIT
"""The calls of paper 000's library KalmanFilterLite on KalmanTilt, for programs written for it."""

from attitude.kalman_tilt import KalmanTilt


class Kalman:
    """setAngle, set_params, getAngle as in the paper's section "Usage"; degrees, deg/s, s."""

    def __init__(self):
        self._filter = KalmanTilt()

    def setAngle(self, angle_deg):
        """Start from this angle."""
        self._filter.reset(angle_deg)

    def set_params(self, q_angle, q_bias, r_measure):
        """New variances at once; the state stays."""
        self._filter.q_angle = q_angle
        self._filter.q_bias = q_bias
        self._filter.r_measure = r_measure

    def getAngle(self, ax, gx, dt):
        """ax: the accelerometer's angle (not its g), gx: the rate -> angle in degrees."""
        return self._filter.update(ax, gx, dt)

# SPDX-License-Identifier: MIT
"""Tilt as the papers have it: from two axes, by asin or atan, and the gyro's integral.

Axes are Plumb's (attitude.tilt). The papers named in the docstrings call these axes otherwise;
each docstring translates. No function here fails on a zero vector, which reads as level, or on
the rounding of single precision.
"""

from math import asin, atan2, pi, sin, sqrt

_DEG = 180.0 / pi


def tilt_two_axes_deg(ax_g, ay_g, az_g):
    """(roll, pitch) in degrees, paper 002 (stabilised platform), eqs. 3-4: atan2 of two axes.

    The paper calls atan2(ax, az) roll and atan2(ay, az) pitch; here they are named by the axis
    that turns, and the sign of ax follows the right-hand rule. Each angle is right only while
    the other is near zero: at roll 60 a pitch of 10 reads 19.4. In return both reach +-180.
    """
    return atan2(ay_g, az_g) * _DEG, atan2(-ax_g, az_g) * _DEG


def tilt_asin_deg(ax_g, ay_g, az_g):
    """(roll, pitch) in degrees within +-90, paper 001 (6-DOF IMU), eqs. 5-6: asin(a / |a|).

    The paper calls asin(ay/|a|) pitch and asin(ax/|a|) roll. Eq. 6 lacks a minus sign: with it
    as printed the accelerometer's angle runs against the integral of gyro y (eq. 2) and the
    blend of eq. 8 pulls the wrong way. Noise grows without bound near +-90 degrees.
    """
    norm = sqrt(ax_g * ax_g + ay_g * ay_g + az_g * az_g)
    if norm == 0.0:
        return 0.0, 0.0
    return _asin_deg(ay_g / norm), _asin_deg(-ax_g / norm)


def tilt_atan_deg(ax_g, ay_g, az_g):
    """(roll, pitch) in degrees within +-90, paper 004 (MPU6050 Kalman), item 6: atan.

    Each axis over the root of the other two: equal to the asin form, but smooth up to the pole
    and, written with atan2, without its division by zero. Upside down reads as level. The
    paper's programs turn radians into degrees by 3.142 and 3.141, wrong by 0.01 to 0.02 %.
    """
    return (
        atan2(ay_g, sqrt(ax_g * ax_g + az_g * az_g)) * _DEG,
        atan2(-ax_g, sqrt(ay_g * ay_g + az_g * az_g)) * _DEG,
    )


def yaw_transfer_deg(roll_deg, pitch_deg, yaw_step_deg):
    """(roll, pitch) in degrees after a turn of yaw_step_deg about z; paper 001, eqs. 3-4.

    A tilted sensor that turns about its own z hands its roll to its pitch and back. The paper's
    theta is roll here and its phi is pitch. Eqs. 3-4 print the transfer as the angle itself; it
    is an increment, added to the angle. The second line uses the new roll on purpose: with
    the old one the tilt would grow by sin^2/2 at each step, so a full circle would not close.
    Valid for small tilt, and steps of a few degrees.
    """
    s = sin(yaw_step_deg / _DEG)
    roll_deg += pitch_deg * s
    pitch_deg -= roll_deg * s
    return roll_deg, pitch_deg


class GyroIntegral:
    """Angle in degrees by the trapezoid rule; paper 002, eqs. 5-10.

    Eqs. 7 and 9 print the increment of one step as if it were the angle; it is summed up here,
    and `.increment_deg` is what eqs. 11-12 (complementary filter) want. The paper's pseudo code
    gives them the sum instead, so that its filter adds the whole past turn again at each step.
    """

    def __init__(self):
        self.reset()

    def reset(self, angle_deg=0.0, rate_dps=0.0):
        """Continue from this angle and rate (degrees, degrees per second)."""
        self.angle_deg = angle_deg
        self.increment_deg = 0.0
        self.rate_dps = rate_dps

    def update(self, gyro_dps, dt_s):
        """One sample (deg/s), dt_s after the last -> angle in degrees; it is not wrapped."""
        self.increment_deg = (self.rate_dps + gyro_dps) * 0.5 * dt_s
        self.rate_dps = gyro_dps
        self.angle_deg += self.increment_deg
        return self.angle_deg

    def state(self):
        """What reset() takes to continue here."""
        return self.angle_deg, self.rate_dps


def _asin_deg(ratio):
    # a quotient by the norm may round to just above one, where asin raises ValueError
    return asin(max(-1.0, min(1.0, ratio))) * _DEG
